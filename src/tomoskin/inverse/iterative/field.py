"""Smooth random images in few numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist

from tomoskin.core import FloatArray, IntArray
from tomoskin.inverse.priors.smooth import matern_correlation
from tomoskin.mesh import Mesh

LEFT_OUT = 0.02
"""Part of the field's variance that the modes may lack, at the worst point."""

_ROOM = 128
"""Modes for which there is room at first."""


@dataclass(frozen=True, eq=False)
class RandomField:
    """A Matérn field of unit variance on a mesh: image = basis @ independent normal numbers.

    The basis is the pivoted Cholesky factor of the covariance (Harbrecht, Peters & Schneider
    2012): it has a column for each of the few places that leave no more than a part of
    the variance unexplained anywhere.

    Attributes
    ----------
    basis
        (n_cells, k).
    places
        (k, d) m, in the order in which they were taken.
    factor
        (k, k) lower triangular: the basis at those places.
    correlation, scale
        The covariance of two places: ``correlation(scale · distance)``.
    mean
        (k,) what is taken off the basis everywhere.
    """

    basis: FloatArray
    places: FloatArray
    factor: FloatArray
    correlation: Callable[[FloatArray], FloatArray]
    scale: float
    mean: FloatArray

    @classmethod
    def on(
        cls, mesh: Mesh, length: float, smoothness: float = 2.5, left_out: float = LEFT_OUT
    ) -> Self:
        """Field that is correlated over ``length`` m.

        Raises
        ------
        ModelError
            For a length that is not positive, or a smoothness that is not 0.5, 1.5 or 2.5.
        """
        correlation, scale = matern_correlation(length, smoothness)

        def column(cell: int) -> FloatArray:
            gap = cdist(mesh.centroids, mesh.centroids[cell][None])[:, 0]
            return correlation(scale * gap)

        basis, pivots = _pivoted(column, len(mesh.cells), left_out)
        places, none = mesh.centroids[pivots], np.zeros(len(pivots))
        return cls(basis, places, basis[pivots], correlation, scale, none)

    def centred(self, mesh: Mesh) -> Self:
        """The field less its mean over ``mesh``, for images that stand on a background."""
        mean = mesh.volumes @ self.basis / mesh.volumes.sum()
        return replace(self, basis=self.basis - mean, mean=self.mean + mean)

    @property
    def size(self) -> int:
        """Number of modes."""
        return int(self.basis.shape[1])

    def at(self, points: FloatArray) -> FloatArray:
        """(n, k) basis at ``points`` (n, d) m: the same image between the cells' centres."""
        covariance = self.correlation(self.scale * cdist(points, self.places))
        return np.asarray(solve_triangular(self.factor, covariance.T, lower=True).T - self.mean)


def _pivoted(
    column: Callable[[int], FloatArray], n: int, left_out: float
) -> tuple[FloatArray, IntArray]:
    """Pivoted Cholesky factor (n, k) of a matrix with unit diagonal, given by its columns."""
    rest = np.ones(n)
    basis = np.zeros((n, _ROOM))
    pivots: list[int] = []
    while len(pivots) < n and rest.max() > left_out:
        pivot, k = int(rest.argmax()), len(pivots)
        if k == basis.shape[1]:
            basis = np.hstack([basis, np.zeros_like(basis)])
        explained = basis[:, :k] @ basis[pivot, :k]
        basis[:, k] = (column(pivot) - explained) / np.sqrt(rest[pivot])
        basis[pivots, k] = 0.0
        pivots.append(pivot)
        rest -= basis[:, k] ** 2
        rest[pivots] = 0.0
    return np.ascontiguousarray(basis[:, : len(pivots)]), np.array(pivots)
