"""Lagrange elements of order 1 and 2 on simplices, in the mesh's own metric.

Everything that the assembly, the Jacobian and the power need is one table of gradients, scaled so
that a sum of products over quadrature points is the integral over the cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.mesh import Mesh

_FACET_MASS = {
    (2, 1): np.array([[2, 1], [1, 2]]) / 6,
    (2, 2): np.array([[4, -1, 2], [-1, 4, 2], [2, 2, 16]]) / 30,
    (3, 1): np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2]]) / 12,
    (3, 2): np.array(
        [
            [6, -1, -1, 0, 0, -4],
            [-1, 6, -1, 0, -4, 0],
            [-1, -1, 6, -4, 0, 0],
            [0, 0, -4, 32, 16, 16],
            [0, -4, 0, 16, 32, 16],
            [-4, 0, 0, 16, 16, 32],
        ]
    )
    / 180,
}
"""∫ φᵢφⱼ over a facet of size 1, by the mesh's dimension and the order: corners, then edges in the
order of their corners."""


@dataclass(frozen=True, eq=False)
class Element:
    """Shape functions of a mesh.

    Attributes
    ----------
    n_nodes
        Number of nodal unknowns: the mesh's points come first, then (order 2) its edges.
    cells
        (n_cells, k) nodes of each cell.
    gradients
        (n_cells, q, k, d) gradient of each shape function at each quadrature point, times the
        square root of weight and volume, so that Σ_q gᵢ · gⱼ = ∫ ∇φᵢ · ∇φⱼ.
    facets
        Per electrode, (n_facets, m) nodes.
    facet_sizes
        Per electrode, (n_facets,) length or area.
    facet_mass, facet_load
        (m, m) and (m,): ∫ φᵢφⱼ and ∫ φᵢ over a facet of size 1.
    """

    n_nodes: int
    cells: IntArray
    gradients: FloatArray
    facets: tuple[IntArray, ...]
    facet_sizes: tuple[FloatArray, ...]
    facet_mass: FloatArray
    facet_load: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, order: int = 1) -> Self:
        """Elements of ``order`` 1 (linear) or 2 (quadratic) on ``mesh``."""
        if order not in (1, 2):
            raise ModelError(f"expected elements of order 1 or 2, got {order}")
        mass = _FACET_MASS[mesh.dimension, order]
        n_nodes, cells, facets = len(mesh.points), mesh.cells, mesh.electrodes
        if order == 2:
            edges = _Edges.of(mesh)
            n_nodes += len(edges.pairs)
            cells, facets = edges.added(cells), tuple(edges.added(f) for f in facets)
        return cls(
            n_nodes=n_nodes,
            cells=cells,
            gradients=_gradients(mesh, order),
            facets=facets,
            facet_sizes=_facet_sizes(mesh),
            facet_mass=mass,
            facet_load=mass.sum(axis=1),  # the shape functions add up to one
        )

    def forms(self) -> FloatArray:
        """(n_cells, k, k, 1): what each pair of nodes conducts, per unit of conductivity."""
        g = self.gradients
        return np.asarray(np.einsum("nqid,nqjd->nij", g, g)[..., None])

    def tensor_forms(self) -> FloatArray:
        """(n_cells, k, k, d(d + 1)/2): the same, per unit of each component of a tensor.

        Those on and above its diagonal, row by row.
        """
        g = self.gradients
        both = np.einsum("nqia,nqjb->nijab", g, g)
        both = both + np.triu(both.swapaxes(3, 4), 1)
        return np.asarray(both[..., *np.triu_indices(g.shape[3])])


def _facet_sizes(mesh: Mesh) -> tuple[FloatArray, ...]:
    """Per electrode, (n_facets,) length or area."""
    ends = np.cumsum([len(electrode) for electrode in mesh.electrodes])[:-1]
    return tuple(np.split(mesh.facet_sizes(np.concatenate(mesh.electrodes)), ends))


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges of a mesh, numbered: ``pairs`` (n_edges, 2) sorted, behind ``n_points`` points."""

    n_points: int
    pairs: IntArray
    keys: IntArray

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        corners = list(combinations(range(mesh.cells.shape[1]), 2))
        ends = np.sort(np.concatenate([mesh.cells[:, c] for c in corners]), axis=1)
        n = len(mesh.points)
        keys = np.unique(ends[:, 0] * n + ends[:, 1])
        return cls(n, np.column_stack([keys // n, keys % n]), keys)

    def added(self, simplices: IntArray) -> IntArray:
        """Nodes of quadratic simplices: corners, then edges in the order of their corners."""
        numbers = [simplices]
        for pair in combinations(range(simplices.shape[1]), 2):
            low, high = np.sort(simplices[:, pair], axis=1).T
            edge = np.searchsorted(self.keys, low * self.n_points + high)
            numbers.append(self.n_points + edge[:, None])
        return np.hstack(numbers)


def barycentric_gradients(corner: FloatArray) -> FloatArray:
    """(n, k, n_coordinates) gradient of each corner's linear function, 1/m; ``corner`` (n, k, …) m.

    On a curved sheet, or on facets, they lie in the plane of the simplex.
    """
    edges = corner[:, 1:] - corner[:, :1]
    gram = edges @ edges.transpose(0, 2, 1)
    inner = np.linalg.solve(gram, edges)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def _gradients(mesh: Mesh, order: int) -> FloatArray:
    linear = barycentric_gradients(mesh.corners)
    if order == 1:
        return (linear * np.sqrt(mesh.volumes)[:, None, None])[:, None]
    points = _quadrature(mesh.dimension)
    shape = _quadratic_derivatives(points)
    scale = np.sqrt(mesh.volumes / len(points))
    return np.asarray(np.einsum("qks,nsd->nqkd", shape, linear) * scale[:, None, None, None])


def _quadrature(dimension: int) -> FloatArray:
    """(q, d + 1) barycentric points of equal weight, exact to degree 2 (Hammer & Stroud 1956)."""
    k = dimension + 1
    b = {2: 1.0 / 6.0, 3: (5.0 - math.sqrt(5.0)) / 20.0}[dimension]
    return np.full((k, k), b) + np.eye(k) * (1.0 - k * b)


def _quadratic_derivatives(points: FloatArray) -> FloatArray:
    """(q, n_shape, d + 1): derivative of each quadratic shape function by each barycentric."""
    k = points.shape[1]
    pairs = list(combinations(range(k), 2))
    shape = np.zeros((len(points), k + len(pairs), k))
    for i in range(k):
        shape[:, i, i] = 4.0 * points[:, i] - 1.0
    for number, (i, j) in enumerate(pairs, start=k):
        shape[:, number, i] = 4.0 * points[:, j]
        shape[:, number, j] = 4.0 * points[:, i]
    return shape
