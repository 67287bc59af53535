"""Frames one after another, without the rows that have jumped since the calibration."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.calibration.locator.health import CalibrationHealth
from tomoskin.calibration.locator.locator import Locator
from tomoskin.calibration.locator.lost_rows import OFFLINE, LostRows
from tomoskin.calibration.locator.presses import frames
from tomoskin.core import FloatArray, IntArray

_PRESSES = 20
"""Presses that are looked back on; those before the first were as usual."""

_APART = 0.1
"""How far the touch must have moved to count as another press, in radii of the region."""

_OFF, _GUARD = 4.0, 1.2
"""A row has jumped that is off by so many times its usual, and by so many times the most that
the calibration's own presses were off in as many in a row."""

_BESIDE = 2.0
"""Nor is a row off that is off by less than so many times what the rows are as a rule, both in
parts of the above: then it is the sheet, or the press. Chosen on the twin's textile disc, one of
six rows doubled or none, seeds 3 to 6."""

_FARTHEST = 10.0
"""How many times its usual a row may be off for one press: more counts no more."""

_MOST = 0.5
"""Where more than this part of the rows is off, it is the press that is strange."""


class Watch:
    """Answers of a locator, frame by frame in the order of time.

    Each frame's place tells what every row should have said. A row that has been off for the last
    presses as it never was in the calibration is left out, as a missing value is, until it agrees
    again. Neither labels nor frames to come are used. The rows' own spread is that of the left-out
    presses (median absolute deviation).

    Frames that lack rows for good, as of a lost electrode, are answered by a locator that has
    learnt without them; see :class:`LostRows`.

    Parameters
    ----------
    locator
        What answers.
    patience
        Of :class:`LostRows`.
    """

    def __init__(self, locator: Locator, patience: tuple[int, int] = OFFLINE) -> None:
        self._locator, self._reduced = locator, LostRows(locator, patience)
        estimates = locator.stacking.left_out
        off = np.abs(self._surprise(locator.presses.dv, estimates))
        self._usual = np.median(off, axis=0) + np.finfo(float).tiny
        self._limit = np.maximum(_OFF, _GUARD * _worst(self._clipped(off)))
        usual = [np.ones(off.shape[1])] * _PRESSES
        self._off: deque[FloatArray] = deque(usual, maxlen=_PRESSES)
        self._last: FloatArray | None = None
        self._fits: deque[list[float]] = deque(maxlen=_PRESSES)
        self._jumped = np.zeros(off.shape[1], dtype=np.bool_)

    @property
    def jumped(self) -> IntArray:
        """Rows of the pattern that are left out now."""
        return np.asarray(self._locator.features.rows[self._jumped])

    @property
    def health(self) -> CalibrationHealth:
        """How the last presses fit the calibration."""
        pattern = self._locator.pattern
        return CalibrationHealth(
            len(self._fits),
            self._fit(),
            tuple(pattern.row_text(row) if pattern else f"row {row}" for row in self.jumped),
        )

    def __call__(self, dv: ArrayLike, *, settled: bool = True) -> tuple[FloatArray, FloatArray]:
        """Places (n, 2) m and covariances (n, 2, 2) m² of the next frames (n, n_meas).

        ``settled``: whether the touch stands as the presses of the calibration did. While it comes
        and goes nothing is concluded from it. Raises DataError as :meth:`Locator.predict` does.
        """
        answers = [
            self._next(frame, settled=settled)
            for frame in frames(dv, self._locator.presses.dv.shape[1])
        ]
        positions, covariances = zip(*answers, strict=True)
        return np.concatenate(positions), np.concatenate(covariances)

    def _next(self, frame: FloatArray, *, settled: bool) -> tuple[FloatArray, FloatArray]:
        answer = self._told(frame)
        if not settled:
            return answer[:2]
        place = self._locator.region.scaled(answer[0])
        off = self._clipped(np.abs(self._surprise(frame[None], place)))[0]
        if self._last is not None and np.linalg.norm(place[0] - self._last) < _APART:
            self._off.pop()
        else:
            self._last = place[0]
            self._fits.append([])
        self._fits[-1].append(float(answer[2][0]))
        self._off.append(off)
        far = np.mean(self._off, axis=0) / self._limit
        jumped = far > max(1.0, _BESIDE * float(np.median(far)))
        if jumped.mean() > _MOST or (jumped == self._jumped).all():
            return answer[:2]
        self._jumped = jumped
        return self._told(frame)[:2]

    def _told(self, frame: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._reduced(frame).told(self._kept(frame))

    def _fit(self) -> float:
        """How strange the last presses are: medians of each, and over them."""
        each = [np.median(press) for press in self._fits]
        return float(np.median(each)) if each else np.nan

    def _kept(self, frame: FloatArray) -> FloatArray:
        """The frame without the rows that have jumped, unless nothing is left then."""
        kept = frame.copy()
        kept[self.jumped] = np.nan
        used = np.isfinite(kept[self._locator.features.rows])
        return kept if used.any() else frame

    def _surprise(self, dv: FloatArray, positions: FloatArray) -> FloatArray:
        """(n, k) features less what the maps say of presses at ``positions`` (n, 2)."""
        maps = self._locator.estimates.likelihood.maps
        return self._locator.features(dv) - maps.features_at(positions)

    def _clipped(self, off: FloatArray) -> FloatArray:
        return np.minimum(off / self._usual, _FARTHEST)


def _worst(off: NDArray[np.float64]) -> FloatArray:
    """(k,) the largest mean of as many presses in a row as a watch looks back on."""
    length = min(_PRESSES, len(off))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(off, length, axis=0).mean(-1).max(0))
