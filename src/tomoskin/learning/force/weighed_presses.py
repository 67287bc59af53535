"""Weights as people name them, in newtons; touches that something of known weight made, checked:
what is wrong with labels, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, Detection, FloatArray, IntArray

NEWTONS: Mapping[str, float] = MappingProxyType({"N": 1.0, "g": 9.80665e-3, "kg": 9.80665})
"""Newtons in one of each unit."""

_HEAVY, _LIGHT = 15.0, 0.02
"""Newtons above which "N", and below which "g", was probably meant otherwise: a hand presses with
0.1 to 15 N, and what is lighter than 2 g hardly shows."""

_MEANT = {"N": "g", "g": "kg"}


@dataclass(frozen=True)
class Weight:
    """What lies on the skin: ``value`` in ``unit``, one of :data:`NEWTONS`."""

    value: float
    unit: str

    def checked(self) -> Self:
        """Itself. Raises DataError where nothing can be learnt from such a weight."""
        if 0 < self.newtons <= MOST_NEWTONS:
            return self
        raise DataError(
            f"expected a weight above 0 and up to {MOST_NEWTONS:g} N, got {self.text}",
            hint="1 N is the weight of 102 g: check the unit",
        )

    @property
    def newtons(self) -> float:
        """The force of the weight, in newtons."""
        return self.value * NEWTONS[self.unit]

    @property
    def text(self) -> str:
        """For people, with the force where another unit was given."""
        own = f"{self.value:.6g} {self.unit}"
        return own if self.unit == "N" else f"{own} ({self.newtons:.3g} N)"

    @property
    def meant(self) -> Weight | None:
        """The weight that was probably meant, where this one is unusual; else None."""
        newtons = self.newtons
        unusual = newtons > _HEAVY if self.unit == "N" else newtons < _LIGHT
        if self.value <= 0 or not unusual or self.unit not in _MEANT:
            return None
        return Weight(self.value, _MEANT[self.unit])


_WHERE = "force labels"
FEWEST = 5
MOST_NEWTONS = 100.0
"""A finger presses with 0.1 to 50 N; a sheet that bears more is not what this is for."""

_GRAMS = 1e3 / 9.80665
_ALIKE, _FEW_RANKS = 0.05, 8
_RISES = 0.2
"""Rank correlation of force and change below which the weights say nothing of the force."""


@dataclass(frozen=True, eq=False)
class WeighedPresses:
    """Touches in the order of time, some of them under a known force.

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
    force
        (n,) N; NaN where nothing of known weight pressed.
    press
        (n,) number of the press that each belongs to: one contact from onset to release.
    time
        (n,) s.
    """

    xy: FloatArray
    area: FloatArray
    peak: FloatArray
    snr: FloatArray
    force: FloatArray
    press: IntArray
    time: FloatArray

    @classmethod
    def of(
        cls, detections: Sequence[Detection], force: ArrayLike, press: ArrayLike, time: ArrayLike
    ) -> Self:
        """Of touches with their labels: ``force`` (n,) N, ``press`` (n,), ``time`` (n,) s.

        Raises
        ------
        DataError
            For labels that do not belong together or to a press, times that go back within one,
            fewer than five forces, forces that are no newtons, or weights that contradict.
        """
        n = len(detections)
        rows = np.array([(d.x, d.y, d.area, d.peak, d.snr) for d in detections]).reshape(n, 5)
        area, peak, snr = rows[:, 2:].T
        newtons, times = (np.asarray(values, dtype=np.float64) for values in (force, time))
        number = np.asarray(press)
        return cls.checked(
            xy=rows[:, :2], area=area, peak=peak, snr=snr, force=newtons, press=number, time=times
        )

    @classmethod
    def checked(
        cls,
        *,
        xy: FloatArray,
        area: FloatArray,
        peak: FloatArray,
        snr: FloatArray,
        force: FloatArray,
        press: IntArray,
        time: FloatArray,
    ) -> Self:
        """The same of the columns; raises as :meth:`of` does."""
        n = len(xy)
        if not force.shape == press.shape == time.shape == (n,):
            raise DataError(
                f"expected a force, a press and a time for each of {n} touches, got shapes "
                f"{force.shape}, {press.shape}, {time.shape}",
                where=_WHERE,
            )
        about = (xy, area, peak)
        if xy.shape != (n, 2) or not area.shape == peak.shape == snr.shape == (n,):
            shapes = ", ".join(str(column.shape) for column in (*about, snr))
            raise DataError(f"expected xy, area, peak and snr of each touch, got shapes {shapes}")
        if not all(np.isfinite(column).all() for column in about):
            raise DataError("expected finite xy, area and peak of every touch, got others")
        _check_order(force, press, time)
        _check_newtons(force[np.isfinite(force)])
        return cls(xy, area, peak, snr, force, press.astype(int), time)

    def __len__(self) -> int:
        """The number of touches with a label."""
        return len(self.force)

    @property
    def labelled(self) -> IntArray:
        """Touches under a known force."""
        return np.flatnonzero(np.isfinite(self.force))


def _check_order(force: FloatArray, press: IntArray, time: FloatArray) -> None:
    if not np.isfinite(time).all() or np.isinf(force).any():
        raise DataError(
            "expected finite times and forces, got values that are not finite", where=_WHERE
        )
    order = np.lexsort((np.arange(len(press)), press))
    back = (np.diff(time[order]) < 0) & (np.diff(press[order]) == 0)
    if back.any():
        raise DataError(
            f"the time decreases within press {press[order][int(np.argmax(back))]}",
            where=_WHERE,
            hint="give the touches of each press in the order of their times",
        )


def _check_newtons(force: FloatArray) -> None:
    if len(force) < FEWEST:
        raise DataError(
            f"expected at least {FEWEST} touches under a known force, got {len(force)}",
            where=_WHERE,
            hint="label more touches: ten presses with some weights are a start, twenty are good",
        )
    wrong = force <= 0
    if wrong.any():
        raise DataError(
            f"expected forces above 0 N, got {force[int(np.argmax(wrong))]:g}",
            where=_WHERE,
            hint="leave out the label where no weight lies on the skin",
        )
    usual = float(np.median(force))
    if force.max() > MOST_NEWTONS:
        grams = f"{force.min():.3g} to {force.max():.3g}"
        raise DataError(
            f"expected newtons, got {grams}: a touch has 0.1 to 50 N, so these values are "
            f"probably grams (a press of {usual:.3g} g has {usual / _GRAMS:.2g} N)",
            where=_WHERE,
            hint="convert from grams with --unit g: 1 N is the weight of 102 g",
        )


def check_rising(depth: FloatArray, force: FloatArray) -> None:
    """Raise DataError where larger forces do not go with larger changes ``depth`` (n,)."""
    if np.ptp(np.log(force)) < _ALIKE or len(force) < _FEW_RANKS:
        return
    deeper, heavier = (np.argsort(np.argsort(values)).astype(float) for values in (depth, force))
    together = float(np.corrcoef(deeper, heavier)[0, 1])
    if together < _RISES:
        raise DataError(
            "the weights contradict the data: larger forces do not cause larger changes (rank "
            f"correlation {together:+.2f}, expected well above {_RISES})",
            where=_WHERE,
            hint="check that labels and presses are in the same order, and use one tip for all "
            "presses",
        )
