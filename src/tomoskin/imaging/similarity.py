"""Structural similarity of masks, with windows of any width."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray

C1, C2 = 1e-4, 9e-4
"""Constants of the structural similarity, for pictures between 0 and 1."""


@dataclass(frozen=True, eq=False)
class SimilarityWindows:
    """Windows of the structural similarity (Wang et al. 2004), Gaussian and cut at two widths.

    Attributes
    ----------
    weights
        (n, n): what the pixels of a row count in the window around each pixel; they sum to one.
    """

    weights: FloatArray

    @classmethod
    def of(cls, pixels: int, width: float) -> SimilarityWindows:
        """Of a picture ``pixels`` wide; ``width`` is a standard deviation, in pixels."""
        away = np.subtract.outer(np.arange(pixels), np.arange(pixels)) / width
        weights = np.where(np.abs(away) <= 2.0, np.exp(-0.5 * away**2), 0.0)
        return cls(np.asarray(weights / weights.sum(axis=1, keepdims=True)))

    def mean(self, picture: NDArray[np.floating]) -> FloatArray:
        """(n, n) mean in each window, of (n, n)."""
        return np.asarray(self.weights @ picture @ self.weights.T)

    def similarity(self, one: NDArray[np.bool_], other: NDArray[np.bool_]) -> FloatArray:
        """(n, n) similarity of two masks (n, n), window by window; 1 where they are the same."""
        a, b = one.astype(np.float64), other.astype(np.float64)
        ma, mb, both = self.mean(a), self.mean(b), self.mean(a * b)
        # of a mask the square is the mask
        variances = ma - ma**2 + mb - mb**2
        light = (2.0 * ma * mb + C1) / (ma**2 + mb**2 + C1)
        return np.asarray(light * (2.0 * (both - ma * mb) + C2) / (variances + C2))
