"""What the layouts add to the circuit, for the decks: ``python hardware/parasitics.py``.

It writes ``decks/layout.lib``; ``… --check`` fails when that says something else.
"""

from __future__ import annotations

import sys

from copper import ROOT, Copper, heating
from stackup import LAYERS, VIA_OHMS

FILE = ROOT / "decks" / "layout.lib"
BOARDS = (8, 16)
_TERMINAL = 5e-3
"""Ω of a screw terminal, assumed: new ones have a few milliohms."""

_COSS = 93e-12
"""F of a p-MOSFET that is off, on BUS, as in models.lib."""

VOLTS = {"+12V": 12, "RAW": 12, "INPUT": 12, "BUS": 12, "SENSE": 12, "EL": 12}
VOLTS |= {"+5V": 5, "-5V": -5, "GND": 0}
"""Of nets that stand at a rail or reach one; what is not here lies between them."""

AMPERES = {"BUS": 0.1, "SENSE": 0.1, "EL": 0.1, "+12V": 0.3, "RAW": 0.3, "INPUT": 0.3}
AMPERES |= {"+5V": 0.1, "-5V": 0.02}
"""What a net carries at most; signals carry less than 10 mA."""

_SIGNAL = 0.01


def short(net: str) -> str:
    """The name of a net without its sheet: /Supply/RAW is RAW."""
    return net.rsplit("/", 1)[-1]


def measured() -> dict[str, float]:
    """The largest of each on both boards, Ω and F."""
    found: dict[str, float] = {}
    for channels in BOARDS:
        copper = Copper.read(ROOT / "kicad" / f"board-{channels}.kicad_pcb")
        one = _of_channels(copper, channels)
        one["cbus"] = channels * _COSS + copper.capacitance("/BUS")
        one["cminus"] = copper.capacitance("/MINUS")
        for name, value in one.items():
            found[name] = max(value, found.get(name, 0.0))
    return found


def _of_channels(copper: Copper, channels: int) -> dict[str, float]:
    worst: dict[str, float] = {}
    for number in range(1, channels + 1):
        part = 100 * number
        terminal, tap = (f"J{part + 1}", "1"), (f"R{part + 6}", "1")
        high, low = (f"Q{part + 2}", "3"), (f"Q{part + 3}", "3")
        (bus,) = copper.potentials(("Q21", "2"), (f"Q{part + 2}", "2"))
        _, from_high = copper.potentials(high, terminal, tap)
        to_low, before = copper.potentials(terminal, low, tap)
        one = {
            "rbus": bus,
            "rlead": max(from_high, to_low - before) + _TERMINAL,
            "rground": before + VIA_OHMS,
            "cel": copper.capacitance(copper.pads[terminal].net),
            "ctap": copper.capacitance(copper.pads[f"R{part + 6}", "2"].net),
        }
        worst = {name: max(value, worst.get(name, 0.0)) for name, value in one.items()}
    return worst


def warmest(channels: int) -> dict[str, float]:
    """K by which the narrowest track of each kind of net warms, at its current (IPC-2221)."""
    copper = Copper.read(ROOT / "kicad" / f"board-{channels}.kicad_pcb")
    found: dict[str, float] = {}
    for net, (width, layer) in copper.narrowest().items():
        kelvins = heating(AMPERES.get(short(net), _SIGNAL), width, LAYERS[layer])
        found[short(net)] = max(kelvins, found.get(short(net), 0.0))
    return found


def spacing(volts: float) -> float:
    """Distance that IPC-2221B asks between bare conductors outside, mm (table 6-1, B2).

    A flat board without slots has one distance: creepage and clearance are the same.
    """
    steps = ((30, 0.1), (50, 0.6), (100, 0.6), (150, 0.6), (170, 1.25))
    return next(distance for most, distance in steps if volts <= most)


def written() -> str:
    """``decks/layout.lib``."""
    names = {
        "rbus": "from the source's transistor along BUS to the farthest channel's",
        "rlead": "between a channel's tap and its terminal, and the terminal itself",
        "rground": "from the tap to the low side's transistor, and a via to the plane",
        "cbus": "of BUS: 16 transistors that are off, and its tracks",
        "cel": "of an electrode's tracks and pads",
        "ctap": "at an amplifier's input, before its filter",
        "cminus": "of the line that the amplifiers read against",
    }
    lines = [
        "* What the layouts add: hardware/parasitics.py makes this file of tracks, vias, pads and",
        "* stack-up of both boards; the largest of each. The ground plane itself is left out.",
    ]
    for name, value in measured().items():
        lines.append(f".param {name}={value:.3g} $ {names[name]}")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write the file, or say whether the one that is there is right."""
    made = written()
    if sys.argv[1:] != ["--check"]:
        FILE.write_text(made, encoding="utf-8")
        return 0
    if FILE.read_text(encoding="utf-8") != made:
        print(f"{FILE.name} is stale: run python hardware/parasitics.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
