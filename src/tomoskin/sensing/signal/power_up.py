"""The first power-up: what a multimeter shows at each test point of the board."""

from __future__ import annotations

from dataclasses import dataclass

_SUPPLY, _REFERENCE, _DUMP = 12.0, 1.225, 22.0
"""V; V across the sense resistor; Ω from the bus to ground while no source is enabled."""

STAGES = {
    "supply": "12 V in, limited to 200 mA, no Arduino, jumpers on 2-3, nothing at the terminals",
    "Arduino": "the same, the Arduino plugged, not flashed or in reset",
    "ring": "the ring of resistors at the terminals, the firmware idle",
}
"""What is connected, in order."""


@dataclass(frozen=True, slots=True)
class MeterStep:
    """One reading of a multimeter.

    Attributes
    ----------
    stage
        One of :data:`STAGES`.
    point
        Where its red lead is; the black one is on GND unless the point says otherwise.
    low, high
        What is expected, V.
    otherwise
        Where to look when it is not.
    """

    stage: str
    point: str
    low: float
    high: float
    otherwise: str

    @property
    def expected(self) -> str:
        """``11.80 to 12.20 V``."""
        digits = 3 if self.high < 0.05 else 2
        return f"{self.low:.{digits}f} to {self.high:.{digits}f} V"

    def accepts(self, volts: float) -> bool:
        """Whether ``volts`` is what is expected."""
        return self.low <= volts <= self.high


def meter_steps(current: float) -> tuple[MeterStep, ...]:
    """The readings in their order, of a board that is set to ``current`` A."""
    sense, bus = _SUPPLY - _REFERENCE, _DUMP * current
    return (
        MeterStep("supply", "+12V", 11.8, 12.2, "0 V: polarity, fuse F1"),
        MeterStep(
            "supply",
            "1 kΩ between E1 and E2, across it",
            -0.001,
            0.001,
            "a gate is not off at rest: Q101 to Q103, Q201 to Q203; the same for other pairs",
        ),
        MeterStep(
            "supply", "SENSE", 11.7, 12.2, "U21, U22: the source has no path for its current"
        ),
        MeterStep("Arduino", "+5V", 4.75, 5.25, "USB, header J61"),
        MeterStep("Arduino", "-5V", -5.05, -4.6, "U1, C2, C3"),
        MeterStep("Arduino", "2.5V", 2.49, 2.51, "U2, U3"),
        MeterStep("Arduino", "BUS", 0.95 * bus, 1.05 * bus, "U23, Q22, R27"),
        MeterStep("Arduino", "SENSE", sense - 0.2, sense + 0.2, "R23, R24, Q21"),
        MeterStep("Arduino", "MINUS", -0.005, 0.005, "jumper J41 on 2-3"),
        MeterStep("Arduino", "MIDDLE", -0.005, 0.005, "jumper J42 on 2-3"),
        MeterStep("ring", "E1, black lead on E2", -0.001, 0.001, "Q101 to Q103, Q201 to Q203"),
    )
