"""The parts: pins with their kinds, package, and a price's order of magnitude."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


class Pin(Enum):
    """What a pin does, for the rule check."""

    PASSIVE = "passive"
    INPUT = "input"
    OUTPUT = "output"
    POWER_IN = "power_in"
    POWER_OUT = "power_out"
    GATE = "gate"
    UNUSED = "unused"


_KINDS = {"i": Pin.INPUT, "o": Pin.OUTPUT, "p": Pin.POWER_IN, "s": Pin.POWER_OUT}
_KINDS |= {"-": Pin.PASSIVE, "g": Pin.GATE, "x": Pin.UNUSED}


@dataclass(frozen=True)
class Part:
    """One kind of part.

    Attributes
    ----------
    letter
        Of its references: R, C, Q, U, …
    package
        Footprint.
    euros
        Price of one, order of magnitude.
    pins
        Kind of each pin, by its name; numbers of each, by the name.
    """

    name: str
    letter: str
    package: str
    euros: float
    pins: dict[str, Pin] = field(default_factory=dict)
    numbers: dict[str, str] = field(default_factory=dict)


def part(name: str, letter: str, package: str, euros: float, pins: str) -> Part:
    """A part; ``pins`` are "number name kind", separated by commas."""
    rows = [row.split() for row in pins.split(",")]
    kinds = {title: _KINDS[kind] for _, title, kind in rows}
    return Part(name, letter, package, euros, kinds, {t: number for number, t, _ in rows})


_FET = "1 G g, 2 S -, 3 D -"
R = part("resistor 1 %", "R", "0603", 0.01, "1 A -, 2 B -")
PRECISE = part("resistor 0.1 % 25 ppm/K", "R", "1206", 0.3, "1 A -, 2 B -")
POWER_R = part("resistor 0.5 W", "R", "2010", 0.1, "1 A -, 2 B -")
C = part("capacitor", "C", "0603", 0.03, "1 A -, 2 B -")
DIODE = part("BAT54S", "D", "SOT-23", 0.05, "1 A -, 2 K -, 3 MID -")
SIGNAL = part("1N4148W", "D", "SOD-123", 0.02, "1 K -, 2 A -")
PFET = part("IRLML9301", "Q", "SOT-23", 0.2, _FET)
POWER_PFET = part("IRFR9024N", "Q", "DPAK", 0.8, "1 G g, 2 D -, 3 S -")
NFET = part("IRLML6344", "Q", "SOT-23", 0.2, _FET)
SHIFTER = part("2N7002", "Q", "SOT-23", 0.03, _FET)
REFERENCE_1V2 = part("LM4041A-1.2", "U", "SOT-23", 1.0, "1 K -, 2 A -, 3 NC x")
REFERENCE_2V5 = part("LM4040A-2.5", "U", "SOT-23", 1.0, "1 K -, 2 A -, 3 NC x")
_AMP = "1 OUT o, 2 V- p, 3 IN+ i, 4 IN- i, 5 V+ p"
OPA = part("OPA197", "U", "SOT-23-5", 2.0, _AMP)
FOLLOWER = part("TLV2371", "U", "SOT-23-5", 1.0, _AMP)
INA = part(
    "INA118",
    "U",
    "SOIC-8",
    8.0,
    "1 RG1 -, 2 IN- i, 3 IN+ i, 4 V- p, 5 REF i, 6 OUT o, 7 V+ p, 8 RG2 -",
)
DEMUX = part(
    "CD74HC237", "U", "SOIC-16", 0.6,
    "1 A0 i, 2 A1 i, 3 A2 i, 4 LE i, 5 E1 i, 6 E2 i, 7 Y7 o, 8 GND p, 9 Y6 o, 10 Y5 o, 11 Y4 o, "
    "12 Y3 o, 13 Y2 o, 14 Y1 o, 15 Y0 o, 16 VCC p",
)  # fmt: skip
MUX = part(
    "CD74HC4067", "U", "SOIC-24", 1.0,
    "1 COM -, 2 I7 -, 3 I6 -, 4 I5 -, 5 I4 -, 6 I3 -, 7 I2 -, 8 I1 -, 9 I0 -, 10 S0 i, 11 S1 i, "
    "12 GND p, 13 S3 i, 14 S2 i, 15 E i, 16 I15 -, 17 I14 -, 18 I13 -, 19 I12 -, 20 I11 -, "
    "21 I10 -, 22 I9 -, 23 I8 -, 24 VCC p",
)  # fmt: skip
NOR = part("74HC1G02", "U", "SOT-23-5", 0.1, "1 B i, 2 A i, 3 GND p, 4 Y o, 5 VCC p")
PUMP = part(
    "TC7660", "U", "SOIC-8", 1.0,
    "1 NC x, 2 CAP+ -, 3 GND p, 4 CAP- -, 5 VOUT s, 6 LV x, 7 OSC x, 8 V+ p",
)  # fmt: skip
JACK = part("12 V jack, 2.1 mm", "J", "through hole", 0.5, "1 TIP s, 2 SLEEVE s")
FUSE = part("fuse, resettable, 0.5 A", "F", "1206", 0.2, "1 A -, 2 B s")
CLAMP = part("TVS SMAJ15A", "D", "SMA", 0.2, "1 K -, 2 A -")
TERMINAL = part("electrode terminal", "J", "through hole", 0.3, "1 PIN -")
JUMPER = part("jumper, three pins", "J", "2.54 mm", 0.1, "1 A -, 2 MID -, 3 B -")
