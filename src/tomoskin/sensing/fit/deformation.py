"""How a sheet is deformed, in numbers and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np

from tomoskin.sensing.fit.strain import ANGLE, LOG_WIDTH, OFFSET
from tomoskin.sensing.fit.strain_state import StrainState

_NINETY = 1.645
"""Deviations either way that hold nine of ten."""

_SURER, _EVEN = 2.1, 1.15
"""Times the deviations of the fit that the numbers of a fold, and of a stretch, are off: real folds
are as no family has them. Chosen so that nine of ten lie in their intervals: the twin's and another
law's, seeds 1 to 20, 8 and 16 electrodes."""

_BOX = math.sqrt(12.0)
"""Breadth of a strip that is bent evenly, in its profile's standard deviations."""

_CURVED = 0.1
"""Part of L by which a strain may be otherwise than a power law says: its deviation."""

_CLEAR = 4.0
"""Deviations by which one number must differ from another for the two to be told apart."""

_WIDE = 0.17
"""Width of a fold, in parts of the sheet's breadth, from which it may be a cylinder's."""


@dataclass(frozen=True, slots=True)
class EstimatedNumber:
    """A number, and the ends of the interval that holds it in nine of ten cases."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, deviation: float) -> Self:
        """Normally distributed."""
        return cls(value, value - _NINETY * deviation, value + _NINETY * deviation)

    @property
    def facts(self) -> dict[str, float]:
        """For programs."""
        return {"value": self.value, "low": self.low, "high": self.high}


@dataclass(frozen=True, slots=True)
class StrainLaw:
    """What a skin file says of how its sheet answers strain; None where it does not.

    Attributes
    ----------
    gauge, gauge_across
        Relative rise of resistance per mean strain in the plane, and per deviator of it.
    height
        Of the conductive layer above the surface that keeps its length, m.
    """

    gauge: float | None = None
    gauge_across: float | None = None
    height: float | None = None


Unit = Literal["rad", "strain", "relative"]


@dataclass(frozen=True, slots=True)
class Deformation:
    """How the sheet is deformed as a whole in one frame.

    Attributes
    ----------
    kind
        "fold": bent along a line. "stretch": strained evenly. "common": conducts otherwise
        everywhere alike. "unknown": as no fold and no stretch does.
    axis
        Direction of the fold, or of the larger strain, rad from x, from 0 to π; None of a common
        change.
    offset
        Distance of the sheet's origin from the fold, m: the fold lies so far to the right of it as
        seen along the axis; None where it is no fold.
    width
        Of the strip that is bent, m; None where it is no fold.
    amount
        In ``unit``: "rad", by which a fold is bent, where the skin file says how the material
        answers strain and how high it lies; "strain" where it says the first; else "relative", by
        which part the conductance differs: in the middle of the fold, or in the mean.
    across
        Of a stretch, the same across the axis; None else.
    confused
        What this frame does not tell it from, or None.
    """

    kind: Literal["fold", "stretch", "common", "unknown"]
    amount: EstimatedNumber | None
    unit: Unit
    axis: EstimatedNumber | None = None
    offset: EstimatedNumber | None = None
    width: EstimatedNumber | None = None
    across: EstimatedNumber | None = None
    confused: str | None = None

    @classmethod
    def of(cls, state: StrainState, law: StrainLaw) -> Deformation:
        """As a ``state`` of the fit says."""
        return _fold(state, law) if state.at.kind == "fold" else _stretch(state, law)

    @classmethod
    def unknown(cls) -> Deformation:
        """One of which no number is known."""
        return cls("unknown", None, "relative")

    @property
    def text(self) -> str:
        """What it is, in a sentence for people."""
        if self.kind == "fold" and self.axis and self.offset:
            return (
                f"the sheet is bent along a line at {math.degrees(self.axis.value):.0f}°, "
                f"{1e3 * abs(self.offset.value):.0f} mm from its middle{self._amount}{self._but}"
            )
        if self.kind == "stretch" and self.axis:
            return (
                f"the sheet is stretched along {math.degrees(self.axis.value):.0f}°"
                f"{self._amount}{self._but}"
            )
        if self.kind == "common":
            return f"the whole sheet conducts otherwise{self._amount}{self._but}"
        return (
            "the sheet is deformed as no single fold or stretch explains, so no touch is shown "
            "until it lies flat"
        )

    @property
    def _amount(self) -> str:
        if self.amount is None:
            return ", more than its model holds"
        if self.unit == "rad":
            return f" by {math.degrees(self.amount.value):+.0f}°"
        kind = "" if self.unit == "strain" else " of its conductance"
        return f" by {100 * self.amount.value:+.2g} %{kind}"

    @property
    def _but(self) -> str:
        return f"; this may as well be {self.confused}" if self.confused else ""

    @property
    def facts(self) -> dict[str, Any]:
        """For programs; lengths in m, angles in rad."""
        each = ("axis", "offset", "width", "amount", "across")
        numbers = {name: getattr(self, name) for name in each}
        own = {name: one and one.facts for name, one in numbers.items()}
        return {"kind": self.kind, "unit": self.unit, **own, "confused": self.confused}


def _fold(state: StrainState, law: StrainLaw) -> Deformation:
    numbers, sd = _numbers(state)
    level, spread, unit = _along(state, law)
    width = math.exp(numbers[LOG_WIDTH])
    if unit == "strain" and law.height is not None:
        # the angle is the curvature, strain over height, over the profile
        part = math.sqrt(2 * math.pi) * width / law.height
        level, spread, unit = level * part, spread * part, "rad"
    box, away = _BOX * width, _NINETY * sd[LOG_WIDTH]
    angle, offset = math.remainder(numbers[ANGLE], 2 * math.pi), numbers[OFFSET]
    if not 0 <= angle < math.pi:
        angle, offset = angle % math.pi, -offset if (angle // math.pi) % 2 else offset
    wide = width > _WIDE * state.sheet.breadth
    return Deformation(
        kind="fold",
        amount=EstimatedNumber.of(level, spread),
        unit=unit,
        axis=EstimatedNumber.of(angle, sd[ANGLE]),
        offset=EstimatedNumber.of(offset, sd[OFFSET]),
        width=EstimatedNumber(box, box * math.exp(-away), box * math.exp(away)),
        confused="a sheet wrapped round a cylinder of that axis" if wide else None,
    )


def _stretch(state: StrainState, law: StrainLaw) -> Deformation:
    numbers, sd = _numbers(state)
    level, xx, xy = numbers
    deviator = math.hypot(xx, xy)
    if deviator < _CLEAR * max(sd[1], sd[2]):
        return Deformation(
            kind="common",
            amount=EstimatedNumber.of(math.expm1(level), math.exp(level) * sd[0]),
            unit="relative",
            confused="warmth, gain or supply, or a stretch that is the same in all directions",
        )
    # the sheet conducts less along the larger strain, if its deviator's gauge is positive
    sign = -1.0 if (law.gauge_across or 1.0) > 0 else 1.0
    axis = math.atan2(sign * xy, sign * xx) / 2 % math.pi
    turn = float(np.hypot(xx * sd[2], xy * sd[1])) / deviator**2 / 2
    size = float(np.hypot(xx * sd[1], xy * sd[2])) / deviator
    if law.gauge and law.gauge_across:
        # resistance goes with a power of the length, as far as dimensions make it
        mean, half = -level / law.gauge, deviator / abs(law.gauge_across)
        spread = math.hypot(sd[0] / law.gauge, size / law.gauge_across)
        amounts, unit = (math.expm1(mean + half), math.expm1(mean - half)), "strain"
        spread = math.hypot(spread, _CURVED * state.strain.size * max(map(abs, amounts)))
    else:
        spread = math.hypot(sd[0], size)
        amounts = (math.expm1(level + sign * deviator), math.expm1(level - sign * deviator))
        unit = "relative"
    return Deformation(
        kind="stretch",
        amount=EstimatedNumber.of(amounts[0], spread),
        unit="strain" if unit == "strain" else "relative",
        axis=EstimatedNumber.of(axis, turn),
        across=EstimatedNumber.of(amounts[1], spread),
        confused="a sheet wrapped round a cylinder across it",
    )


def _numbers(state: StrainState) -> tuple[list[float], list[float]]:
    """The numbers of the strain, and their deviations."""
    numbers = state.strain.numbers
    times = _SURER if state.at.kind == "fold" else _EVEN
    deviations = times * np.sqrt(np.diag(state.covariance))[: len(numbers)]
    return numbers.tolist(), deviations.tolist()


def _along(state: StrainState, law: StrainLaw) -> tuple[float, float, Unit]:
    """Strain across a fold in its middle, or by what part the sheet conducts otherwise there; its
    deviation; which of the two."""
    numbers = state.strain.numbers
    both = _SURER**2 * state.covariance[3:5, 3:5]
    if law.gauge is None:
        pull = np.array([1.0, 1.0])  # across the fold the sheet has both
        total = float(pull @ numbers[3:])
        return math.expm1(total), math.exp(total) * math.sqrt(pull @ both @ pull), "relative"
    gauges = -np.array([law.gauge, law.gauge_across or 0.0]) / 2
    counts = gauges != 0
    weights = np.linalg.solve(both[np.ix_(counts, counts)], gauges[counts])
    information = float(weights @ gauges[counts])
    return float(weights @ numbers[3:][counts]) / information, information**-0.5, "strain"
