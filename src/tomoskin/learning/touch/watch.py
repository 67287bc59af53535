"""Frames one after another, without the rows that have jumped since the calibration, and by what
was learnt without those that are missing for good."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future
from dataclasses import replace
from threading import Thread

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.touch.calibration_health import CalibrationHealth
from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.presses import frames

OFFLINE, LIVE = (3, 0), (8, 100)
"""Patience where frames wait for the answer, and where they do not."""

_MOST_MISSING = 0.8
"""Part of the rows without which nothing is learnt."""


def without(locator: Locator, rows: IntArray) -> Locator:
    """Locator that has learnt from the same presses without some ``rows`` of the pattern.

    It locates frames that lack these rows, without values that are filled in. Raises DataError
    where no other row says anything.
    """
    dv = locator.presses.dv.copy()
    dv[:, rows] = np.nan
    presses = replace(locator.presses, dv=dv)
    return locator.learn(presses, locator.region, locator.pattern, locator.skin_id)


class LostRows:
    """Chooses what answers a frame: the locator, or what it is without the rows that are missing.

    Values that are filled in make a calibration worse and its ellipses too small, so it learns
    again once the same rows have been missing for some frames. That takes up to seconds, in a
    thread of its own. Its answers begin at a frame, not at a moment, so that a replay says the
    same.

    Parameters
    ----------
    locator
        With all rows.
    patience
        Frames that lack the same rows before it learns, and from then on until it must be ready.
    """

    def __init__(self, locator: Locator, patience: tuple[int, int]) -> None:
        self._locator, self._patience = locator, patience
        self._missing = b""
        self._count = 0
        self._learnt: Future[Locator] | None = None

    def __call__(self, frame: FloatArray) -> Locator:
        """What answers the next ``frame`` (n_meas,), NaN where a value is missing."""
        rows = self._locator.features.rows
        missing = ~np.isfinite(frame[rows])
        if not missing.any() or missing.mean() > _MOST_MISSING:
            return self._locator
        key = missing.tobytes()
        if key != self._missing:
            if self._learnt is not None and not self._learnt.done():
                return self._locator  # one at a time
            self._missing, self._count, self._learnt = key, 0, None
        self._count += 1
        begin, wait = self._patience
        if self._count == begin:
            self._learnt = self._learn(rows[missing])
        if self._learnt is None or self._count < begin + wait:
            return self._locator
        return self._learnt.result()

    def _learn(self, rows: IntArray) -> Future[Locator]:
        future: Future[Locator] = Future()

        def learn() -> None:
            try:
                future.set_result(without(self._locator, rows))
            except DataError:  # nothing is left to learn from
                future.set_result(self._locator)
            except BaseException as error:
                future.set_exception(error)

        Thread(target=learn, daemon=True, name="learning without rows").start()
        return future


_PRESSES = 40
"""Presses that are looked back on."""

_NEWEST = (8, 20, _PRESSES)
"""So many of the newest are looked at by themselves: a large jump shows soon."""

_APART = 0.1
"""How far the touch must have moved to count as another press, in radii of the region."""

_LEAST = 0.3
"""Change of a row, over the most presses, below which it has not jumped; over fewer, it is larger
by the square root. Chosen on the twin's textile disc, six rows doubled or none, seeds 1 to 6, as
are the next two."""

_BESIDE, _SURELY = 5.5, 1.2
"""Nor has a row jumped that has changed by less than so many deviations of the rows' changes: then
it is the sheet, or the press. But one has that has changed by the second: many rows that jump at
once make the positions wrong, and so the others' deviation large."""

_CHANCE = 10.0
"""Nor one that has changed by less than so many times its usual scatter in the calibration, over
the root of the presses."""

_STRANGE = 1.0
"""Deviation of the rows' changes from which nothing is concluded: it is the press or the skin."""

_FITS = 20
"""Presses that tell how well the calibration fits."""

_MOST = 0.5
"""Where more than this part of the rows has changed, it is the press that is strange."""

_NORMAL = 1.48
"""Deviation of a Gaussian over its median distance from the middle."""


class Watch:
    """Answers of a locator, frame by frame in the order of time.

    Each frame's place tells what every row should have said. A row that has said more, or less,
    than that for the last presses, other than the rows do as a rule, is left out, as a missing
    value is, until it agrees again. Neither labels nor frames to come are used.

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
        more, _ = self._surprise(locator.presses.dv, locator.stacking.left_out)
        self._usual = np.median(np.abs(more), axis=0) + np.finfo(float).tiny
        self._more: deque[FloatArray] = deque(maxlen=_PRESSES)
        self._weight: deque[FloatArray] = deque(maxlen=_PRESSES)
        self._last: FloatArray | None = None
        self._fits: deque[list[float]] = deque(maxlen=_FITS)
        self._jumped = np.zeros(len(locator.features.rows), dtype=np.bool_)

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
        answer = self._answer(frame)
        if not settled:
            return answer[:2]
        place = self._locator.region.scaled(answer[0])
        if self._last is not None and np.linalg.norm(place[0] - self._last) < _APART:
            self._more.pop()
            self._weight.pop()
        else:
            self._last = place[0]
            self._fits.append([])
        self._fits[-1].append(float(answer[2][0]))
        more, weight = self._surprise(frame[None], place)
        self._more.append(more[0])
        self._weight.append(weight[0])
        jumped = self._changed()
        if jumped.mean() > _MOST or (jumped == self._jumped).all():
            return answer[:2]
        self._jumped = jumped
        return self._answer(frame)[:2]

    def _changed(self) -> NDArray[np.bool_]:
        """(k,) whether each row has changed, by any of the looks back."""
        more, weight = np.array(self._more), np.array(self._weight)
        changed = np.zeros(more.shape[1], dtype=np.bool_)
        for n in _NEWEST:
            if len(more) < n:
                break
            by = _medians(more[-n:], weight[-n:])
            by -= np.median(by)
            apart = _NORMAL * float(np.median(np.abs(by)))
            if apart > _STRANGE:
                return self._jumped
            least = _LEAST * float(np.sqrt(_PRESSES / n))
            limit = max(least, min(_BESIDE * apart, _SURELY))
            changed |= np.abs(by) > np.maximum(limit, _CHANCE / np.sqrt(n) * self._usual)
        return changed

    def _answer(self, frame: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._reduced(frame).posterior(self._kept(frame))

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

    def _surprise(self, dv: FloatArray, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, k) by how much each feature is more than the maps say of presses at ``positions``
        (n, 2), in the direction in which they say that it changes; and how much that tells. What
        all rows have in common is the press's force."""
        expected = self._locator.estimates.likelihood.maps.features_at(positions)
        more = np.sign(expected) * (self._locator.features(dv) - expected)
        return (
            more - np.median(more, axis=1, keepdims=True),
            np.abs(expected) / np.sqrt(1 + expected**2),
        )


def _medians(values: FloatArray, weights: FloatArray) -> FloatArray:
    """(k,) weighted medians of columns (n, k)."""
    order = values.argsort(axis=0)
    total = np.take_along_axis(weights, order, axis=0).cumsum(axis=0)
    middle = (total < total[-1] / 2).sum(axis=0)
    return np.asarray(np.take_along_axis(values, order, axis=0)[middle, np.arange(values.shape[1])])
