"""What the emulator saw of its board (``-w``): ``firmware/emulator/watch.h``."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

CLOCK = 16e6
CHANNELS = 16
TOP_OF_STACK = 0x21FF
"""Last address of the ATmega2560's memory."""


@dataclass(frozen=True)
class Watch:
    """Cycles of the simulated clock.

    ``spent`` in the instruction at each word of flash; ``net`` (16,) of pairs, by the lower
    channel: from the other one to it, less from it to the other. ``said``: from the end of a drive
    to the last byte of the newest message; ``deaf``: without interrupts.
    """

    cycle: int
    connected: bool
    since: int
    longest_on: int
    shortest_off: int
    resets: int
    lowest_stack: int
    said: int
    deaf: int
    spent: np.ndarray
    net: np.ndarray

    @classmethod
    def read(cls, path: Path) -> Watch:
        words = np.fromfile(path, "<u8")
        cycle, connected, since, on, off, resets, stack, said, deaf = words[:9].tolist()
        net = words[-CHANNELS:].astype(np.int64)
        on_off = (cycle, bool(connected), since, on, off)
        return cls(*on_off, resets, stack, said, deaf, words[9:-CHANNELS], net)

    @property
    def on(self) -> int:
        """Cycles that a drive has been on, at most; one that still is counts too."""
        return max(self.longest_on, self.cycle - self.since if self.connected else 0)

    @property
    def stack(self) -> int:
        """Most bytes that the stack has held: looked at after each instruction."""
        return TOP_OF_STACK - self.lowest_stack

    def cycles_in(self, elf: Path, function: str) -> int:
        """Cycles spent in the code of a function, interrupts left out."""
        start, size = symbol(elf, function)
        return int(self.spent[start // 2 : (start + size) // 2].sum())


def symbol(elf: Path, name: str) -> tuple[int, int]:
    """Address and size in bytes."""
    command = ["avr-nm", "--print-size", elf]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for parts in map(str.split, listed.splitlines()):
        if len(parts) == 4 and parts[3].partition(".")[0] == name:
            return int(parts[0], 16), int(parts[1], 16)
    raise LookupError(f"{name} is not in {elf}: has the compiler put it into its caller?")
