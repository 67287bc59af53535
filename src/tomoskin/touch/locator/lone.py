"""Response maps of rows that are taken one by one: what few presses can tell of a row's noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.touch.locator.kernel import Likeness

_RATIOS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0])
"""Noise over signal of a row, as tried."""

_FREEDOM = 4.0
"""Degrees of freedom of one row's error: a press may be told wrong by a few rows."""

_TOGETHER, _FARTHEST = 8, np.float32(1e4)
"""Rows whose densities are multiplied before one logarithm is taken, each of at most so much."""

_SINGLE = np.float32

_FLOOR = 1e-9


@dataclass(frozen=True, eq=False)
class LoneMaps:
    """A Gaussian process for each row, with a noise of its own (Rasmussen & Williams 2006, 5.8).

    The matrix-variate process knows more, but must learn two covariances of all rows: from some
    twenty presses it learns the noise of a single row less well than the row alone does.
    """

    likeness: Likeness
    places: FloatArray
    mean: FloatArray
    modes: tuple[FloatArray, FloatArray]
    rows: FloatArray
    noise: FloatArray
    size: FloatArray
    evidence: float

    @classmethod
    def of(cls, likeness: Likeness, places: FloatArray, features: FloatArray) -> Self:
        """Maps for ``features`` (n, k) of presses at ``places`` (n, 2)."""
        n, mean = len(places), features.mean(axis=0)
        weights, axes = np.linalg.eigh(likeness(places, places))
        weights = np.maximum(weights, 0.0)
        rows = axes.T @ (features - mean)
        spread = weights[:, None] + _RATIOS
        size = (1 / spread).T @ rows**2 / n + _FLOOR
        log = -0.5 * n * np.log(size) - 0.5 * np.log(spread).sum(axis=0)[:, None]
        best = log.argmax(axis=0), np.arange(features.shape[1])
        noise = _RATIOS[best[0]]
        evidence = float(log[best].sum())
        return cls(likeness, places, mean, (weights, axes), rows, noise, size[best], evidence)

    def at(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (g, k), of the features of a press at ``places`` (g, 2)."""
        weights, axes = self.modes
        near = self.likeness(places, self.places) @ axes
        spread = weights[:, None] + self.noise
        left = self.likeness.variance + self.noise - near**2 @ (1 / spread)
        return self.mean + near @ (self.rows / spread), self.size * np.maximum(left, _FLOOR)


@dataclass(frozen=True, eq=False)
class LoneLikelihood:
    """The maps read at the places of a grid: a Student density for each row, so that a row that
    is told wrong costs little.

    ``mean``, ``steep`` (k, g): the answer, and one over its deviation; ``volume`` (g,).
    """

    mean: NDArray[np.float32]
    steep: NDArray[np.float32]
    volume: FloatArray

    @classmethod
    def of(cls, maps: LoneMaps, grid: FloatArray) -> Self:
        """For the places ``grid`` (g, 2)."""
        mean, variance = maps.at(grid)
        short = -mean.shape[1] % _TOGETHER
        wide = ((0, 0), (0, short))
        steep = np.pad(1 / np.sqrt(_FREEDOM * variance), wide)
        return cls(
            np.pad(mean, wide).astype(_SINGLE).T.copy(),
            steep.astype(_SINGLE).T.copy(),
            0.5 * np.log(variance).sum(axis=1),
        )

    def __call__(self, features: FloatArray) -> FloatArray:
        """(n, g) log-likelihood of each place, up to a constant of the frame."""
        short = len(self.mean) - features.shape[1]
        wide = np.pad(features, ((0, 0), (0, short))).astype(_SINGLE)
        return np.stack([self._of_one(frame) for frame in wide])

    def _of_one(self, frame: NDArray[np.float32]) -> FloatArray:
        misfit = (frame[:, None] - self.mean) * self.steep
        misfit *= misfit
        misfit += 1
        np.minimum(misfit, _FARTHEST, out=misfit)
        product = misfit.reshape(_TOGETHER, -1, misfit.shape[1]).prod(axis=0)
        logs = np.log(product).sum(axis=0, dtype=np.float64)
        return np.asarray(-0.5 * (_FREEDOM + 1) * logs - self.volume)
