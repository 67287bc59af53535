"""What can be learnt of a touch as one number: a force from weights, a depth from known travels; as
people name them, in units, and checked; and the touches that it is learnt from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import MEASURANDS, DataError, Detection, FloatArray, IntArray

_PROBABLE = {"N": "g", "g": "kg"}
_HEAVY, _LIGHT = 15.0, 0.02
"""Newtons above which "N", and below which "g", was probably meant otherwise: a hand presses with
0.1 to 15 N, and what is lighter than 2 g hardly shows."""


@dataclass(frozen=True)
class Measurand:
    """A quantity of a touch, across the sheet.

    Attributes
    ----------
    name, plural
        One of :data:`~tomoskin.core.MEASURANDS`; of many.
    units
        Size in SI of each unit in which labels are given.
    shown
        The one of these in which people are told of it.
    least, most
        Where all labels are less, or one is more, their unit is another one, SI.
    usual
        What a touch has, in words.
    labels
        What labels are, in words.
    bends
        Powers of F/(F + F₀) by which a touch may go with the amount F. A force levels off, since
        the layer is squeezed solid in the end; a depth has had that already.
    halves
        F₀ over the median of the labels.
    """

    name: str
    plural: str
    units: Mapping[str, float]
    shown: str
    least: float
    most: float
    usual: str
    labels: str
    bends: tuple[float, ...] = (1.0,)
    halves: tuple[float, ...] = field(default=tuple(np.geomspace(0.02, 50.0, 41)))

    def text(self, value: float, digits: int = 3) -> str:
        """The amount ``value``, SI, for people."""
        rounded = float(f"{value / self.units[self.shown]:.{digits}g}")
        return f"{rounded:g} {self.shown}"

    def span(self, values: FloatArray) -> str:
        """From the smallest to the largest of ``values``, SI."""
        least, most = (self.text(value) for value in (values.min(), values.max()))
        return most if least == most else f"{least.removesuffix(f' {self.shown}')} to {most}"

    @cached_property
    def key(self) -> str:
        """Its labels in an interchange file, and its column in a table of touches."""
        return f"{self.name}_{MEASURANDS[self.name].lower()}"

    @cached_property
    def where(self) -> str:
        """Where its labels are, for messages."""
        return f"{self.name} labels"


_FORCE = Measurand(
    name="force",
    plural="forces",
    units=MappingProxyType({"N": 1.0, "g": 9.80665e-3, "kg": 9.80665}),
    shown="N",
    least=1e-3,
    most=100.0,
    usual="a touch has 0.1 to 50 N, and 1 N is the weight of 102 g",
    labels="weights",
)
"""Newtons: a sheet that bears more than a hundred is not what this is for."""

_DEPTH = Measurand(
    name="depth",
    plural="depths",
    units=MappingProxyType({"mm": 1e-3, "um": 1e-6, "cm": 1e-2, "in": 0.0254, "m": 1.0}),
    shown="mm",
    least=1e-5,
    most=0.1,
    usual="a sheet gives way by 0.05 to 50 mm",
    labels="depths",
    bends=tuple(np.linspace(0.6, 1.8, 13)),
    halves=(10.0,),
)
"""Metres by which the sheet gives way under the tip."""

MEASURED = {one.name: one for one in (_FORCE, _DEPTH)}
"""By their names."""


@dataclass(frozen=True)
class AmountLabel:
    """What a person says of a press: ``value`` in ``unit``, one of those ``of`` the measurand."""

    value: float
    unit: str
    of: Measurand = _FORCE

    def checked(self, layer: float | None = None) -> Self:
        """Itself. Raises DataError where nothing can be learnt from it, as from a depth beyond the
        ``layer`` m that is pressed."""
        of, within = self.of, ""
        most = of.most
        if of is _DEPTH and layer is not None:
            most, within = layer, ", the layer under the sheet"
        if self.unit in of.units and 0 < self.si <= most:
            return self
        raise DataError(
            f"expected a {of.labels[:-1]} above 0 and up to {of.text(most)}{within}, got "
            f"{self.value:.6g} {self.unit}",
            hint="1 N is the weight of 102 g: check the unit" if of is _FORCE else "",
        )

    @property
    def si(self) -> float:
        """The amount in the SI unit of its kind."""
        return self.value * self.of.units[self.unit]

    @property
    def text(self) -> str:
        """For people, with the usual unit where another one was given."""
        own = f"{self.value:.6g} {self.unit}"
        return own if self.unit == self.of.shown else f"{own} ({self.of.text(self.si)})"

    @property
    def meant(self) -> AmountLabel | None:
        """The weight that was probably meant, where this one is unusual; else None."""
        if self.value <= 0 or self.of is not _FORCE or self.unit not in _PROBABLE:
            return None
        unusual = self.si > _HEAVY if self.unit == "N" else self.si < _LIGHT
        return AmountLabel(self.value, _PROBABLE[self.unit]) if unusual else None


FEWEST_LABELS = 5
"""Touches with a known amount without which nothing is learnt."""

_ALIKE, _FEW_RANKS = 0.05, 8
_RISES = 0.2
"""Rank correlation of labels and change below which the labels say nothing of it."""


@dataclass(frozen=True, eq=False)
class LabelledPresses:
    """Touches in the order of time, some of them with a known amount of something.

    Attributes
    ----------
    xy
        (n, 2) m.
    area
        (n,) m².
    peak
        (n,) S by which the conductivity has changed in the middle.
    snr
        (n,) deviations by which each stands out; NaN where that is not known.
    amount
        (n,) SI; NaN where it is not known.
    press
        (n,) number of the press that each belongs to: one contact from onset to release.
    time
        (n,) s.
    measurand
        Of what, one of :data:`~tomoskin.core.MEASURANDS`.
    """

    xy: FloatArray
    area: FloatArray
    peak: FloatArray
    snr: FloatArray
    amount: FloatArray
    press: IntArray
    time: FloatArray
    measurand: str = "force"

    def __post_init__(self) -> None:
        """Check all columns; raises as :meth:`of` does."""
        if self.measurand not in MEASURED:
            names = " or ".join(MEASURED)
            raise DataError(f'expected labels of {names}, got "{self.measurand}"')
        of, n, labels = self.of_what, len(self.xy), (self.amount, self.press, self.time)
        if any(column.shape != (n,) for column in labels):
            raise DataError(
                f"expected a {of.name}, a press and a time for each of {n} touches, got shapes "
                f"{', '.join(str(column.shape) for column in labels)}",
                where=of.where,
            )
        about = (self.xy, self.area, self.peak)
        shapes = [column.shape for column in (*about, self.snr)]
        if shapes != [(n, 2), (n,), (n,), (n,)]:
            raise DataError(f"expected xy, area, peak and snr of each touch, got shapes {shapes}")
        if not all(np.isfinite(column).all() for column in about):
            raise DataError("expected finite xy, area and peak of every touch, got others")
        _check_order(of, *labels)
        _check_amounts(of, self.amount[np.isfinite(self.amount)])

    @classmethod
    def of(
        cls,
        detections: Sequence[Detection],
        amount: ArrayLike,
        press: ArrayLike,
        time: ArrayLike,
        measurand: str = "force",
    ) -> Self:
        """Of touches with their labels: ``amount`` (n,) SI, ``press`` (n,), ``time`` (n,) s.

        Raises
        ------
        DataError
            For labels that do not belong together or to a press, times that go back within one,
            fewer than five amounts, amounts in another unit, or labels that contradict.
        """
        values, times = (np.asarray(column, dtype=np.float64) for column in (amount, time))
        number = np.asarray(press).astype(int)
        return cls(*columns_of(detections), values, number, times, measurand)

    def __len__(self) -> int:
        """The number of touches with a label."""
        return len(self.amount)

    def check_within(self, layer: float) -> None:
        """Raise DataError where a depth exceeds the ``layer`` m that is pressed."""
        if self.measurand == "depth" and np.nanmax(self.amount) > layer:
            of = self.of_what
            raise DataError(
                f"expected depths within the layer under the sheet, {of.text(layer)}, got "
                f"{of.span(self.amount[self.labelled])}",
                where=of.where,
                hint="count depths from where the tip touches the sheet, check --unit, or correct "
                "layer in [surface] of the skin file",
            )

    @property
    def of_what(self) -> Measurand:
        """What its labels are amounts of."""
        return MEASURED[self.measurand]

    @property
    def labelled(self) -> IntArray:
        """Touches whose amount is known."""
        return np.flatnonzero(np.isfinite(self.amount))


def columns_of(
    detections: Sequence[Detection],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Positions (n, 2), areas, peaks and snr (n,)."""
    rows = np.array([(d.x, d.y, d.area, d.peak, d.snr) for d in detections]).reshape(-1, 5)
    return rows[:, :2], rows[:, 2], rows[:, 3], rows[:, 4]


def _check_order(of: Measurand, amount: FloatArray, press: IntArray, time: FloatArray) -> None:
    if not np.isfinite(time).all() or np.isinf(amount).any():
        raise DataError(
            f"expected finite times and {of.plural}, got values that are not finite", where=of.where
        )
    order = np.lexsort((np.arange(len(press)), press))
    back = (np.diff(time[order]) < 0) & (np.diff(press[order]) == 0)
    if back.any():
        raise DataError(
            f"the time decreases within press {press[order][int(np.argmax(back))]}",
            where=of.where,
            hint="give the touches of each press in the order of their times",
        )


def _check_amounts(of: Measurand, amount: FloatArray) -> None:
    if len(amount) < FEWEST_LABELS:
        raise DataError(
            f"expected at least {FEWEST_LABELS} touches with a known {of.name}, got {len(amount)}",
            where=of.where,
            hint=f"label more touches: ten presses with some {of.labels} are a start, twenty are "
            "good",
        )
    if (amount <= 0).any():
        raise DataError(
            f"expected {of.plural} above 0, got {of.text(amount.min())}",
            where=of.where,
            hint="leave out the label where nothing presses",
        )
    if not of.least <= amount.max() <= of.most:
        raise DataError(
            f"expected {of.plural} up to {of.text(of.most)}, got {of.span(amount)}: {of.usual}, so "
            "the unit is probably another",
            where=of.where,
            hint=f"name it: --unit {' or --unit '.join(of.units)}",
        )


def check_rising(of: Measurand, change: FloatArray, amount: FloatArray) -> None:
    """Raise DataError where larger amounts do not go with a larger ``change`` (n,)."""
    if np.ptp(np.log(amount)) < _ALIKE or len(amount) < _FEW_RANKS:
        return
    deeper, larger = (np.argsort(np.argsort(values)).astype(float) for values in (change, amount))
    together = float(np.corrcoef(deeper, larger)[0, 1])
    if together < _RISES:
        raise DataError(
            f"the {of.labels} contradict the data: larger {of.plural} do not cause larger changes "
            f"(rank correlation {together:+.2f}, expected well above {_RISES})",
            where=of.where,
            hint="check that labels and presses are in the same order, and use one tip for all "
            "presses",
        )
