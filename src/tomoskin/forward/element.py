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
from tomoskin.mesh import Mesh


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
        mass, load = _facet_integrals(mesh.dimension, order)
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
            facet_sizes=tuple(mesh.facet_sizes(e) for e in mesh.electrodes),
            facet_mass=mass,
            facet_load=load,
        )


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


Polynomial = dict[tuple[int, ...], float]


def _facet_integrals(dimension: int, order: int) -> tuple[FloatArray, FloatArray]:
    shape = _polynomials(dimension, order)
    mass = [[_integral(_product(a, b)) for b in shape] for a in shape]
    return np.array(mass), np.array([_integral(a) for a in shape])


def _polynomials(corners: int, order: int) -> list[Polynomial]:
    """Shape functions of a facet as polynomials of its barycentric coordinates."""

    def monomial(*factors: int) -> tuple[int, ...]:
        return tuple(factors.count(i) for i in range(corners))

    if order == 1:
        return [{monomial(i): 1.0} for i in range(corners)]
    vertices: list[Polynomial] = [{monomial(i, i): 2.0, monomial(i): -1.0} for i in range(corners)]
    return vertices + [{monomial(i, j): 4.0} for i, j in combinations(range(corners), 2)]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    out: Polynomial = {}
    for p, u in a.items():
        for q, v in b.items():
            power = tuple(i + j for i, j in zip(p, q, strict=True))
            out[power] = out.get(power, 0.0) + u * v
    return out


def _integral(polynomial: Polynomial) -> float:
    """Over a simplex of size 1: Σ c · d! Π aᵢ! / (d + Σ aᵢ)!."""
    total = 0.0
    for power, factor in polynomial.items():
        d = len(power) - 1
        above = math.factorial(d) * math.prod(math.factorial(a) for a in power)
        total += factor * above / math.factorial(d + sum(power))
    return total
