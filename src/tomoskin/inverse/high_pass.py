"""The Gaussian high-pass prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from tomoskin.core import FloatArray
from tomoskin.inverse.penalty import Factored, Penalty, dense_penalty, dense_solver
from tomoskin.mesh import Mesh


@dataclass(frozen=True)
class GaussianHighPass:
    """Q = FᵀF with F = I − G, a Gaussian high-pass filter (Adler & Guardo 1996).

    G averages with weights area · exp(−4 ln 2 · (distance / width)²), rows summing to one;
    ``width`` is a fraction of the mesh's largest extent.
    """

    width: float = 0.1

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``.

        With D the sums of the rows of the symmetric weights area · exp(…) · area and L = D minus
        these, F = D⁻¹L and Q = LD⁻²L. L is a graph Laplacian, so that Q need not be formed: it
        takes one factorisation of L and two solutions.
        """
        del jacobian
        weights = self._weights(mesh)
        degree = weights.sum(axis=1)
        laplacian = np.diag(degree) - weights

        def dense() -> FloatArray:
            high_pass = laplacian / degree[:, None]
            return np.asarray(high_pass.T @ high_pass)

        free = np.full((len(degree), 1), 1.0 / np.sqrt(len(degree)))
        solve = dense_solver(laplacian, free)
        if solve is None:
            return dense_penalty(dense())

        def solve_twice(columns: FloatArray) -> FloatArray:
            """Between the two, the constant is chosen so that the second has a solution."""
            square = degree[:, None] ** 2
            inner = solve(columns)
            inner -= (square * inner).sum(axis=0) / square.sum()
            return solve(square * inner)

        return Factored(dense, free, solve_twice)

    def _weights(self, mesh: Mesh) -> FloatArray:
        extent = float(np.ptp(mesh.points, axis=0).max())
        weights = cdist(mesh.centroids, mesh.centroids, "sqeuclidean")
        weights *= -4.0 * np.log(2.0) / (self.width * extent) ** 2
        np.exp(weights, out=weights)
        area = mesh.volumes / mesh.volumes.mean()
        weights *= area
        weights *= area[:, None]
        return np.asarray(weights)
