"""Priors of smooth images: differences of neighbours, a high-pass filter, a covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import inv
from scipy.sparse import coo_array, csr_array
from scipy.spatial.distance import cdist

from tomoskin.core import FloatArray, IntArray, ModelError, check_positive
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior import penalty as penalties
from tomoskin.model.section import Quantity, key

LEAST_COUPLING = 1e-6
"""A coupling below this costs digits; zero, which cuts, does not."""

DEFAULT_LENGTH = 0.1
"""Correlation length, as a fraction of the mesh's largest extent, where none is given."""

_BLOCK = 256
"""Rows of the covariance that are in memory at a time."""

_ROOM = 128
"""Columns of a Cholesky factor for which there is room at first."""

CORRELATIONS: dict[float, Callable[[FloatArray], FloatArray]] = {
    0.5: lambda s: np.exp(-s),
    1.5: lambda s: (1.0 + s) * np.exp(-s),
    2.5: lambda s: (1.0 + s + s * s / 3.0) * np.exp(-s),
}
"""Matérn correlation by smoothness ν, of s = √(2ν) · distance / length."""


@dataclass(frozen=True)
class Laplace:
    """Q = twice the graph Laplacian of cells that share a facet, as in EIDORS."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> penalties.Penalty:
        """The matrix Q for the cells of ``mesh``."""
        del jacobian
        return penalties.sparse_penalty(graph_laplacian(mesh, np.full(len(mesh.neighbours), 2.0)))


@dataclass(frozen=True, eq=False)
class Structural:
    """Laplace with weaker couplings between regions: an image may jump along their edges.

    As EIDORS and others take anatomy or a design into account (Kaipio et al. 1999): smooth
    within a region, nearly free between two. The labels say where a region is, not what it holds.

    Attributes
    ----------
    labels
        (n_cells,) whole numbers: cells with the same number are one region.
    coupling
        Weight of a difference across an edge, from 0, which cuts, to 1, which is Laplace;
        not between 0 and 1e-6.
    """

    labels: ArrayLike
    coupling: float = 0.01

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> penalties.Penalty:
        """Return Q on ``mesh``. Raises ModelError for labels or a coupling that do not fit."""
        del jacobian
        labels = np.asarray(self.labels)
        if labels.shape != (len(mesh.cells),) or labels.dtype.kind not in "biu":
            raise ModelError(
                f"expected one whole number for each of {len(mesh.cells)} cells, "
                f"got {labels.dtype} of shape {labels.shape}",
                where="labels of the structural prior",
            )
        if not (self.coupling == 0 or LEAST_COUPLING <= self.coupling <= 1):
            raise ModelError(
                f"expected 0, or from {LEAST_COUPLING:g} to 1, got {self.coupling}",
                where="coupling of the structural prior",
            )
        first, second = labels[mesh.neighbours].T
        return penalties.sparse_penalty(
            graph_laplacian(mesh, np.where(first == second, 2.0, 2.0 * self.coupling))
        )


def graph_laplacian(mesh: Mesh, coupling: FloatArray) -> csr_array:
    """(n_cells, n_cells): Σ coupling (xᵢ − xⱼ)² over neighbours, ``coupling`` (n_pairs,).

    Off its diagonal it is −coupling, and its rows sum to zero.
    """
    first, second = mesh.neighbours.T
    n = len(mesh.cells)
    ends = np.concatenate([first, second])
    degree = np.bincount(ends, np.tile(coupling, 2), n)
    rows = np.concatenate([ends, np.arange(n)])
    cols = np.concatenate([second, first, np.arange(n)])
    values = np.concatenate([np.tile(-coupling, 2), degree])
    matrix = csr_array(coo_array((values, (rows, cols)), shape=(n, n)))
    matrix.eliminate_zeros()  # a coupling of zero is no connection
    return matrix


@dataclass(frozen=True)
class GaussianHighPass:
    """Q = FᵀF with F = I − G, a Gaussian high-pass filter (Adler & Guardo 1996).

    G averages with weights area · exp(−4 ln 2 · (distance / width)²), rows summing to one;
    ``width`` is a fraction of the mesh's largest extent.
    """

    width: float = 0.1

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> penalties.Penalty:
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
        solve = penalties.dense_solver(laplacian, free)
        if solve is None:
            return penalties.dense_penalty(dense())

        def solve_twice(columns: FloatArray) -> FloatArray:
            """Between the two, the constant is chosen so that the second has a solution."""
            square = degree[:, None] ** 2
            inner = solve(columns)
            inner -= (square * inner).sum(axis=0) / square.sum()
            return solve(square * inner)

        return penalties.Factored(dense, free, solve_twice)

    def _weights(self, mesh: Mesh) -> FloatArray:
        extent = float(np.ptp(mesh.points, axis=0).max())
        weights = cdist(mesh.centroids, mesh.centroids, "sqeuclidean")
        weights *= -4.0 * np.log(2.0) / (self.width * extent) ** 2
        np.exp(weights, out=weights)
        area = mesh.volumes / mesh.volumes.mean()
        weights *= area
        weights *= area[:, None]
        return np.asarray(weights)


@dataclass(frozen=True)
class Matern:
    """Q⁻¹ = C, the Matérn covariance of the cells' centres (Rasmussen & Williams 2006, 4.16, 4.17).

    An image is held to be a random field of unit deviation, correlated over a length. In the
    space of the measurements C is used as it is, never inverted. Distances are taken in space,
    on a curved sheet too.

    Attributes
    ----------
    correlation_length
        The length, m; without it a tenth of the mesh's largest extent.
    smoothness
        ν: 0.5, exponential, with sharp changes; 1.5, once, and 2.5, twice differentiable.
    """

    correlation_length: float | None = key(
        Quantity("length", "mm", 0.1, 5000),
        "The distance over which changes are similar. Default: a tenth of the sheet's extent.",
        default=None,
    )
    smoothness: float = 1.5

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> penalties.Penalty:
        """Return Q on ``mesh``. Raises ModelError for an impossible length or smoothness."""
        del jacobian
        length = self.correlation_length
        if length is None:
            length = DEFAULT_LENGTH * float(np.ptp(mesh.points, axis=0).max())
        correlation, scale = matern_correlation(length, self.smoothness)
        return _Covariance(scale * mesh.centroids, correlation)


def matern_correlation(
    length: float, smoothness: float
) -> tuple[Callable[[FloatArray], FloatArray], float]:
    """The correlation, a function of ``scale · distance``, and that scale, 1/m.

    Raises
    ------
    ModelError
        For a ``length`` m that is not positive, or a smoothness that is not 0.5, 1.5 or 2.5.
    """
    check_positive(length, "a correlation length", unit=" m")
    if smoothness not in CORRELATIONS:
        names = ", ".join(map(str, CORRELATIONS))
        raise ModelError(f"expected a smoothness among {names}, got {smoothness}")
    return CORRELATIONS[smoothness], float(np.sqrt(2.0 * smoothness) / length)


def pivoted_cholesky(
    column: Callable[[int], FloatArray], variance: FloatArray, left_out: float, most: int
) -> tuple[FloatArray, IntArray]:
    """Factor (n, k ≤ ``most``) of the covariance that is given by its columns and ``variance``.

    As Harbrecht, Peters & Schneider (2012): the places (k,), each where most is unexplained, until
    no more than the variance ``left_out`` is anywhere.
    """
    rest, n = variance.copy(), len(variance)
    factor = np.zeros((n, _ROOM))
    pivots: list[int] = []
    while len(pivots) < min(most, n) and rest.max() > left_out:
        pivot, k = int(rest.argmax()), len(pivots)
        if k == factor.shape[1]:
            factor = np.hstack([factor, np.zeros_like(factor)])
        explained = factor[:, :k] @ factor[pivot, :k]
        factor[:, k] = (column(pivot) - explained) / np.sqrt(rest[pivot])
        factor[pivots, k] = 0.0
        pivots.append(pivot)
        rest -= factor[:, k] ** 2
        rest[pivots] = 0.0
    return np.ascontiguousarray(factor[:, : len(pivots)]), np.array(pivots)


@dataclass(frozen=True, eq=False)
class _Covariance:
    """A covariance that is a function of distance between ``positions`` (n_cells, d)."""

    positions: FloatArray
    correlation: Callable[[FloatArray], FloatArray]

    @property
    def free(self) -> FloatArray:
        """The null space of the prior, which is empty."""
        return np.empty((len(self.positions), 0))

    @property
    def matrix(self) -> FloatArray:
        """The matrix Q = C⁻¹ of the penalty, dense."""
        return np.asarray(inv(self.correlation(cdist(self.positions, self.positions))))

    def carry(self, jacobian: NDArray[Any]) -> penalties.Carried:
        """CJᴴ and JCJᴴ, a block of rows at a time: C itself would be the largest array of all."""
        columns = jacobian.conj().T
        spread = np.empty(columns.shape, columns.dtype, order="F")
        for start in range(0, len(self.positions), _BLOCK):
            rows = slice(start, start + _BLOCK)
            spread[rows] = self.correlation(cdist(self.positions[rows], self.positions)) @ columns
        return spread, jacobian @ spread
