"""The few directions in which frames differ: rows in units of their noise, then the largest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import eigh

from tomoskin.calibration.classifier.examples import Examples
from tomoskin.core import DataError, FloatArray

_MOST = 20
"""Directions: eight electrodes have n(n − 3)/2 = 20 independent readings."""

_FRAMES_EACH = 4
"""Frames for each direction."""

_QUIETEST = 0.3
"""A row is never taken for quieter than this part of the median row."""


@dataclass(frozen=True, eq=False)
class Subspace:
    """``middle`` and ``scale`` (n_meas,) of the rows; ``axes`` (n_meas, d) orthonormal.

    ``rest`` is the variance of a row, in its own units, beside those directions.
    """

    middle: FloatArray
    scale: FloatArray
    axes: FloatArray
    rest: float

    @classmethod
    def of(cls, examples: Examples) -> Self:
        """Of frames of all sessions, each about its own mean: what a session adds drops out.

        Raises DataError when no row ever changes.
        """
        scale = _noise(examples)
        middles, parts = [], []
        for number in np.unique(examples.session):
            data = examples.dv[examples.session == number]
            middles.append(session_mean(data))
            parts.append(_filled((data - middles[-1]) / scale))
        whole = np.vstack(parts)
        d = int(np.clip(len(whole) // _FRAMES_EACH, 2, min(_MOST, *whole.shape)))
        axes = _largest(whole, d)
        beside = (whole**2).sum() - ((whole @ axes) ** 2).sum()
        free = max(len(whole) * (whole.shape[1] - d), 1)
        return cls(middles[-1], scale, axes, max(float(beside / free), 1e-12))

    def whitened(self, dv: FloatArray, middle: FloatArray | None = None) -> FloatArray:
        """(n, n_meas) about a middle, of the newest session by default, in units of noise."""
        return _filled((dv - (self.middle if middle is None else middle)) / self.scale)

    def beside(self, white: FloatArray, inside: FloatArray) -> FloatArray:
        """(n,) mean square of what the directions leave, 1 where it is as in the examples."""
        left = (white**2).sum(axis=1) - (inside**2).sum(axis=1)
        return np.asarray(left / (self.rest * max(white.shape[1] - self.axes.shape[1], 1)))


def _noise(examples: Examples) -> FloatArray:
    """(n_meas,) deviation of each row from what its labels explain."""
    total, count = np.zeros(examples.dv.shape[1]), 0
    for number in np.unique(examples.session):
        part = examples.part((examples.session == number) & examples.labelled)
        if len(part) < 2:
            continue
        data = _filled(part.dv - session_mean(part.dv))
        design = part.flags - part.flags.mean(axis=0)
        told = design @ np.linalg.lstsq(design, data, rcond=None)[0]
        total += ((data - told) ** 2).sum(axis=0)
        count += max(len(part) - np.linalg.matrix_rank(design) - 1, 1)
    deviation = np.sqrt(total / max(count, 1))
    alive = deviation[deviation > 0]
    if not len(alive):
        raise DataError("expected frames that differ from each other: no row ever changes")
    return np.asarray(np.maximum(deviation, _QUIETEST * np.median(alive)))


def session_mean(data: FloatArray) -> FloatArray:
    """(n_meas,) mean over the frames that have a value, 0 where none has."""
    known = np.isfinite(data)
    return np.asarray(np.where(known, data, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def _filled(data: FloatArray) -> FloatArray:
    return np.where(np.isfinite(data), data, 0.0)


def _largest(data: FloatArray, d: int) -> FloatArray:
    """(n_meas, d) directions of the largest variance, by the smaller Gram matrix."""
    n, rows = data.shape
    if rows <= n:
        return np.asarray(eigh(data.T @ data, subset_by_index=(rows - d, rows - 1))[1])
    size, left = eigh(data @ data.T, subset_by_index=(n - d, n - 1))
    kept = size > 1e-12 * size[-1]
    return np.asarray(data.T @ (left[:, kept] / np.sqrt(size[kept])))
