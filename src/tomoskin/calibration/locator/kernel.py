"""Likeness of responses at two places, and a small basis that holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import eigh

from tomoskin.core import FloatArray

LENGTHS = (0.16, 0.22, 0.32, 0.45, 0.65)
"""Length scales of a response that are tried, in radii of the region."""

_CONSTANT = 0.3
"""Variance of what a map has everywhere, in parts of what varies over the skin."""

_TOLERANCE = 1e-2
"""Part of the prior variance that a basis may leave out."""

_MOST = 300
"""Functions in a basis."""

_ROUNDING = 1e-9


def squared_distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n, m) squared distances between the rows of ``a`` (n, d) and ``b`` (m, d)."""
    square = (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1)
    return np.asarray(np.maximum(square - 2 * (a @ b.T), 0.0))


@dataclass(frozen=True)
class Likeness:
    """Prior covariance of a response at two places; ``length`` in the unit of the places."""

    length: float

    def __call__(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """(n, m) for the places ``a`` (n, 2) and ``b`` (m, 2)."""
        near = np.exp(-0.5 * squared_distances(a, b) / self.length**2)
        return np.asarray(near + _CONSTANT)

    @property
    def variance(self) -> float:
        """Of a response at one place."""
        return 1.0 + _CONSTANT


@dataclass(frozen=True, eq=False)
class Basis:
    """Functions φ with φ(a)·φ(b) = likeness(a, b), up to a hundredth of the variance.

    They stand on presses chosen by pivoted Cholesky (Harbrecht, Peters & Schneider 2012), so
    that their number follows the length scale and not the number of presses.
    """

    likeness: Likeness
    centres: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, likeness: Likeness, places: FloatArray) -> Self:
        """Basis for responses at ``places`` (n, 2)."""
        centres = places[_pivots(likeness, places)]
        values, vectors = eigh(likeness(centres, centres))
        keep = values > _ROUNDING * values[-1]
        return cls(likeness, centres, vectors[:, keep] / np.sqrt(values[keep]))

    def __call__(self, places: FloatArray) -> FloatArray:
        """(n, m) values of the functions at ``places`` (n, 2)."""
        return np.asarray(self.likeness(places, self.centres) @ self.root)


def _pivots(likeness: Likeness, places: FloatArray) -> list[int]:
    """Rows whose likeness to all others explains the rest."""
    left = np.full(len(places), likeness.variance)
    factor = np.zeros((len(places), min(_MOST, len(places))))
    chosen: list[int] = []
    while len(chosen) < factor.shape[1]:
        pivot = int(left.argmax())
        if left[pivot] < _TOLERANCE * likeness.variance:
            break
        k = len(chosen)
        column = likeness(places, places[pivot : pivot + 1])[:, 0]
        column -= factor[:, :k] @ factor[pivot, :k]
        factor[:, k] = column / np.sqrt(left[pivot])
        left = np.maximum(left - factor[:, k] ** 2, 0.0)
        left[pivot] = 0.0
        chosen.append(pivot)
    return chosen
