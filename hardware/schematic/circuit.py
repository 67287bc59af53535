"""A circuit: parts whose pins are on nets; its rule check, netlist and bill of materials."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field

from schematic.parts import Part, Pin, R

RAILS = {"GND", "+12V"}
"""What a gate may be held at: there whenever a current can flow."""

_E24 = "10 11 12 13 15 16 18 20 22 24 27 30 33 36 39 43 47 51 56 62 68 75 82 91"
STOCK = {10 * int(two) for two in _E24.split()} | {round(10 ** (2 + n / 96)) for n in range(96)}
"""Three digits of the values that resistors and capacitors are sold with: E24 and E96."""

Node = tuple[str, str]
"""Reference and pin's name."""


@dataclass(frozen=True)
class Placed:
    """A part in a circuit: what kind, which value, which net each pin is on."""

    part: Part
    value: str
    nets: dict[str, str]


@dataclass
class Circuit:
    """Parts by their references, in the order in which they were added."""

    placed: dict[str, Placed] = field(default_factory=dict)
    _count: Counter[str] = field(default_factory=Counter)

    def add(self, part: Part, nets: str, value: str = "") -> str:
        """Place a part; ``nets`` names one net for each pin that is used, in the pins' order."""
        names = [name for name, kind in part.pins.items() if kind is not Pin.UNUSED]
        self._count[part.letter] += 1
        reference = f"{part.letter}{self._count[part.letter]}"
        self.placed[reference] = Placed(
            part, value or part.name, dict(zip(names, nets.split(), strict=True))
        )
        return reference

    def nets(self) -> dict[str, list[Node]]:
        """The pins on each net."""
        nets: dict[str, list[Node]] = defaultdict(list)
        for reference, placed in self.placed.items():
            for pin, net in placed.nets.items():
                nets[net].append((reference, pin))
        return dict(nets)

    def problems(self) -> list[str]:
        """What a rule check finds.

        A net with one pin; two outputs on one net; an input that nothing drives; a supply pin off
        every supply; a transistor's gate that no resistor holds at a rail when nothing drives it; a
        resistor or capacitor of a value that nobody sells.
        """
        found = [
            f"{reference}: {placed.value} is no stock value (E24, E96)"
            for reference, placed in self.placed.items()
            if placed.part.letter in "RC" and not _is_stock(placed.value)
        ]
        for net, nodes in self.nets().items():
            kinds = [self.placed[reference].part.pins[pin] for reference, pin in nodes]
            drives = kinds.count(Pin.OUTPUT) + kinds.count(Pin.POWER_OUT)
            if len(nodes) < 2:
                found.append(f"{net}: only {nodes[0]}")
            if kinds.count(Pin.OUTPUT) > 1 or (Pin.OUTPUT in kinds and Pin.POWER_OUT in kinds):
                found.append(f"{net}: two outputs")
            if Pin.INPUT in kinds and not drives and Pin.PASSIVE not in kinds:
                found.append(f"{net}: nothing drives it")
            if Pin.POWER_IN in kinds and Pin.POWER_OUT not in kinds:
                found.append(f"{net}: supplied by nothing")
            if Pin.GATE in kinds and not self._held(nodes):
                found.append(f"{net}: a gate that no resistor holds")
        return found

    def _held(self, nodes: list[Node]) -> bool:
        """Whether a resistor goes from these pins to a rail."""
        on = [self.placed[reference] for reference, _ in nodes]
        return any(one.part is R and RAILS & set(one.nets.values()) for one in on)

    def netlist(self) -> str:
        """The netlist in KiCad's form (version E), which its layout editor reads."""
        lines = ['(export (version "E")', "  (components"]
        for reference, placed in self.placed.items():
            lines.append(
                f'    (comp (ref "{reference}") (value "{placed.value}")'
                f' (footprint "{placed.part.package}"))'
            )
        lines += ["  )", "  (nets"]
        for code, (net, nodes) in enumerate(sorted(self.nets().items()), start=1):
            pins = " ".join(
                f'(node (ref "{reference}") (pin "{self.placed[reference].part.numbers[pin]}"))'
                for reference, pin in nodes
            )
            lines.append(f'    (net (code "{code}") (name "{net}") {pins})')
        return "\n".join([*lines, "  )", ")"]) + "\n"

    def bill(self) -> str:
        """Bill of materials: CSV of what to order, prices of one by their order of magnitude."""
        wanted: dict[tuple[str, str, str, float], list[str]] = defaultdict(list)
        for reference, placed in self.placed.items():
            part = placed.part
            value = "" if part.letter == "J" or placed.value == part.name else placed.value
            wanted[(part.name, value, part.package, part.euros)].append(reference)
        lines = ["part,value,package,number,euros_each,euros,references"]
        for (name, value, package, euros), references in wanted.items():
            count = len(references)
            row = [f'"{name}"', value, package, count, euros, round(count * euros, 2)]
            lines.append(",".join([*map(str, row), " ".join(references)]))
        total = sum(placed.part.euros for placed in self.placed.values())
        return "\n".join([*lines, f"total,,,{len(self.placed)},,{total:.0f},"]) + "\n"


def _is_stock(value: str) -> bool:
    """Whether ``1.47k`` or ``470p C0G`` is sold."""
    number = float(value.partition(" ")[0].rstrip("pnumkM"))
    digits = number * 10 ** (2 - math.floor(math.log10(number)))
    return any(math.isclose(digits, stock) for stock in STOCK)
