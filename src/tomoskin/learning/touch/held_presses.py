"""Frames of a course in time → presses: what stays at one spot is one press, seen several times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray

_SPOT = 0.002
"""m; labels that differ by less are of one press: within that a finger cannot be put down again."""

_BEFORE = 8
"""Untouched frames before a press that it is held against: as many as a mean of a press that
stands. What a sheet still shows of earlier presses is in them too; a live baseline follows it."""

_PRESSED = 0.5
"""Part of the usual change of a press; frames in which it is smaller show it come and go."""


@dataclass(frozen=True, eq=False)
class HeldPresses:
    """One row for each press: ``dv`` (n, n_meas) the mean of its frames, ``xy`` (n, 2) m, and the
    first of its ``frames`` (n,)."""

    dv: FloatArray
    xy: FloatArray
    frames: IntArray

    @classmethod
    def of(cls, dv: FloatArray, xy: FloatArray) -> HeldPresses:
        """Of frames ``dv`` (m, n_meas) in the order of time, with labels ``xy`` (m, 2) m, NaN where
        there is none. Neither a frame without a label nor one elsewhere is part of a press. It is
        held against the untouched frames right before it, else those before an earlier one."""
        spans = list(_spans(xy))
        labelled: NDArray[np.bool_] = np.asarray(np.isfinite(xy).all(axis=1))
        rest, means = np.zeros(dv.shape[1]), []
        for first, last in spans:
            rest = _rest(dv, labelled, first, _mean(dv[first:last]), rest)
            means.append(_mean(dv[first:last] - rest))
        places = [xy[first:last].mean(axis=0) for first, last in spans]
        return cls(
            np.reshape(means, (len(spans), dv.shape[1])),
            np.reshape(places, (len(spans), 2)),
            np.array([first for first, _ in spans], dtype=np.int64),
        )


def _spans(xy: FloatArray) -> Iterator[tuple[int, int]]:
    """First frame of each press, and one past its last."""
    first: int | None = None
    for frame, place in enumerate(xy):
        known = bool(np.isfinite(place).all())
        if first is not None and not (known and np.linalg.norm(place - xy[first]) < _SPOT):
            yield first, frame
            first = None
        if first is None and known:
            first = frame
    if first is not None:
        yield first, len(xy)


def _rest(
    dv: FloatArray, labelled: NDArray[np.bool_], first: int, press: FloatArray, rest: FloatArray
) -> FloatArray:
    """(n_meas,) what the frames without a label right before frame ``first`` show, where a
    ``press`` begins; the ``rest`` before an earlier press where there are none, or where they
    differ from it so much that a touch without a label is in them."""
    start = first
    while start > max(first - _BEFORE, 0) and not labelled[start - 1]:
        start -= 1
    if start == first:
        return rest
    now = _mean(dv[start:first])
    now = np.where(np.isfinite(now), now, rest)
    is_touched = np.nanmean((now - rest) ** 2) > _PRESSED**2 * np.nanmean((press - now) ** 2)
    return rest if is_touched else now


def _mean(dv: FloatArray) -> FloatArray:
    """(n_meas,) mean of the frames (m, n_meas) that show the whole press; NaN where no frame has a
    value."""
    has_values = np.isfinite(dv).any(axis=1, keepdims=True)
    size = np.sqrt(np.nanmean(np.where(has_values, dv, 0.0) ** 2, axis=1))
    pressed = np.flatnonzero(size >= _PRESSED * np.median(size))
    values = dv[pressed]
    count = np.isfinite(values).sum(axis=0)
    total = np.where(np.isfinite(values), values, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))
