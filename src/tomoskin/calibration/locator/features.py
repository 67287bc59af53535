"""Difference data → features: heavy tails squashed, silent rows left out, holes filled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from tomoskin.core import DataError, FloatArray, IntArray

_MOST_MISSING = 0.5
"""A row that is missing in more than this part of the presses is not used."""

_SHRINK = 0.1
"""Part of the covariance that is taken as diagonal when holes are filled."""


@dataclass(frozen=True, eq=False)
class Features:
    """arsinh(dv / scale) of the rows that say something.

    A row's scale is the geometric mean of its own median size and that of all rows: weak rows are
    lifted, but not to the level of strong ones. The inverse hyperbolic sine is linear below the
    scale and logarithmic above, so that a heavy tail weighs little (Johnson 1949, the S_U family).

    Attributes
    ----------
    rows
        (k,) rows of the pattern that are used.
    scale
        (k,) V or instrument units.
    mean, covariance
        (k,), (k, k) of the features over the presses, by which holes are filled.
    """

    rows: IntArray
    scale: FloatArray
    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, dv: FloatArray) -> Self:
        """Features for presses (n, n_meas), NaN where a value is missing.

        Raises
        ------
        DataError
            When no row changes from press to press.
        """
        rows = np.flatnonzero(_changing(dv))
        if not len(rows):
            raise DataError(
                f"expected data that change from press to press, got {len(dv)} alike presses"
            )
        used = dv[:, rows]
        scale = _scales(np.abs(used))
        squashed = np.arcsinh(used / scale)
        mean = np.asarray(np.nanmean(squashed, axis=0))
        residual = np.nan_to_num(squashed - mean)
        covariance = residual.T @ residual / len(dv)
        diagonal = np.diag(np.diag(covariance))
        return cls(rows, scale, mean, (1 - _SHRINK) * covariance + _SHRINK * diagonal)

    def __call__(self, dv: FloatArray) -> FloatArray:
        """(n, k) features of frames (n, n_meas); a missing value becomes the likeliest one.

        Raises DataError for a frame in which every used value is missing.
        """
        squashed = np.arcsinh(dv[:, self.rows] / self.scale)
        holes = ~np.isfinite(squashed)
        if holes.all(axis=1).any():
            row = int(np.argmax(holes.all(axis=1)))
            raise DataError("holds no finite value that is used", where=f"frame {row}")
        for frame in np.flatnonzero(holes.any(axis=1)):
            self._fill(squashed[frame], holes[frame])
        return np.asarray(squashed)

    def _fill(self, values: FloatArray, hole: NDArray[np.bool_]) -> None:
        """Put the conditional mean of a Gaussian, given the other values, into the holes."""
        known = ~hole
        gain = cho_solve(
            cho_factor(self.covariance[np.ix_(known, known)]), values[known] - self.mean[known]
        )
        values[hole] = self.mean[hole] + self.covariance[np.ix_(hole, known)] @ gain


def _scales(sizes: FloatArray) -> FloatArray:
    """(k,) from ``sizes`` (n, k); a row that is mostly 0 has its mean for a median."""
    own = np.nanmedian(sizes, axis=0)
    own = np.where(own > 0, own, np.nanmean(sizes, axis=0))
    return np.asarray(np.sqrt(own * np.median(own)))


def _changing(dv: FloatArray) -> NDArray[np.bool_]:
    finite = np.isfinite(dv)
    seen = finite.mean(axis=0) > 1 - _MOST_MISSING
    high = np.where(finite, dv, -np.inf).max(axis=0)
    low = np.where(finite, dv, np.inf).min(axis=0)
    return np.asarray(seen & (high > low))
