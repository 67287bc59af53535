"""The committed netlists, to be asked without KiCad."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import netlist

ROOT = Path(netlist.__file__).resolve().parent


@dataclass(frozen=True)
class Circuit:
    """A board's parts and nets."""

    board: str
    parts: dict[str, netlist.Part]
    nets: netlist.Nets

    @classmethod
    def read(cls, board: str) -> Circuit:
        """That of ``hardware/<board>.net``."""
        text = (ROOT / f"{board}.net").read_text(encoding="utf-8")
        return cls(board, *netlist.parse(text))

    @property
    def channels(self) -> int:
        """How many electrodes it has."""
        return int(self.board.rsplit("-", 1)[1])

    @cached_property
    def net_of(self) -> dict[tuple[str, str], str]:
        """The net of each pin."""
        return {node: name for name, nodes in self.nets.items() for node in nodes}

    def between(self, letter: str) -> Iterator[tuple[str, str]]:
        """The two nets of each part of two pins."""
        for reference in self.parts:
            if reference.startswith(letter):
                yield self.net_of[reference, "1"], self.net_of[reference, "2"]

    def value(self, *pins: tuple[str, str], kinds: str = "RC") -> str:
        """Value of the resistor or capacitor between the nets of two pins; there must be one."""
        wanted = sorted(self.net_of.get(pin, pin[0]) for pin in pins)
        found = {
            part.value
            for reference, part in self.parts.items()
            if reference[0] in kinds and sorted(self.net_of[reference, n] for n in "12") == wanted
        }
        assert len(found) == 1, (wanted, found)
        return found.pop()
