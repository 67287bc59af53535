"""Elements on simplices, and the assembly of the complete electrode model as two sparse products.

The elements are those of Lagrange, of order 1 and 2, in the mesh's own metric. One table of
gradients serves the assembly, the Jacobian and the power: scaled so that a sum of products over
quadrature points is the integral over the cell.

Unknowns are the nodal potentials, then the potentials of all electrodes but the last, which is
the ground. The matrix is symmetric with a fixed structure; only its values follow the
conductivity and the contact impedance:

    values = stiffness @ σ + contact @ (1/z)

with the weak form of Somersalo, Cheney & Isaacson 1992, eq. (4.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, combinations_with_replacement
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.forward.engine import Compressed
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
        sizes, ends = mesh.facet_sizes(np.concatenate(facets)), np.cumsum([*map(len, facets)])[:-1]
        if order == 2:
            edges = _Edges.of(mesh)
            n_nodes += len(edges.pairs)
            cells, facets = edges.added(cells), tuple(edges.added(f) for f in facets)
        return cls(
            n_nodes=n_nodes,
            cells=cells,
            gradients=_gradients(mesh, order),
            facets=facets,
            facet_sizes=tuple(np.split(sizes, ends)),
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


@dataclass(frozen=True, eq=False)
class SystemAssembly:
    """Sparsity structure of the system and the maps that fill it.

    Attributes
    ----------
    element
        Shape functions.
    indices, indptr
        Compressed-column structure of the symmetric matrix.
    position
        (n_cells, k, k) which value each entry of a cell's matrix adds to.
    contact
        (n_values, n_electrodes): values per unit of 1/z.
    """

    element: Element
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    position: IntArray
    contact: csr_array

    @classmethod
    def of(cls, element: Element) -> Self:
        """Structure and maps for the elements of a mesh."""
        cells, n_electrodes = element.cells, len(element.facets)
        rows, cols, values, owner = _contact_entries(element)
        numbers = _numbered(cells, (rows, cols), element.n_nodes + n_electrodes - 1)
        k = cells.shape[1]
        position = numbers[np.tile(cells, k).ravel(), np.repeat(cells, k)]
        maps = coo_array((values, (numbers[cols, rows], owner)), shape=(numbers.nnz, n_electrodes))
        return cls(
            element=element,
            indices=numbers.indices,
            indptr=numbers.indptr,
            position=np.asarray(position).reshape(len(cells), k, k),
            contact=csr_array(maps),
        )

    @property
    def n_points(self) -> int:
        """The number of nodes with an unknown potential."""
        return self.element.n_nodes

    @property
    def n_electrodes(self) -> int:
        """The number of electrodes on the mesh."""
        return len(self.element.facets)

    @property
    def n_unknowns(self) -> int:
        """The number of equations of the system."""
        return self.n_points + self.n_electrodes - 1

    @cached_property
    def stiffness(self) -> csr_array:
        """(n_values, n_cells): values per unit of a scalar conductivity."""
        return self._stiffness_map(self.element.forms())

    @cached_property
    def tensor_stiffness(self) -> csr_array:
        """(n_values, d(d + 1)/2 · n_cells): values per unit of each component of a tensor.

        Those on and above its diagonal, row by row, all cells of one after all of another.
        """
        return self._stiffness_map(self.element.tensor_forms())

    def matrix(self, conductivity: NDArray[Any], contacts: NDArray[Any]) -> Compressed:
        """System matrix for σ (n_cells,) or (n_cells, d, d), and the values of the contacts."""
        if conductivity.ndim == 1:
            values = self.stiffness @ conductivity
        else:
            above = combinations_with_replacement(range(conductivity.shape[1]), 2)
            rows = np.concatenate([conductivity[:, a, b] for a, b in above])
            values = self.tensor_stiffness @ rows
        values = np.add(values, contacts, out=values if values.dtype == contacts.dtype else None)
        return Compressed(values, self.indices, self.indptr)

    def _stiffness_map(self, local: FloatArray) -> csr_array:
        """``local`` (n_cells, k, k, c) → (n_values, c·n_cells)."""
        n_cells, _, _, c = local.shape
        rows = np.broadcast_to(self.position[..., None], local.shape)
        cols = np.arange(c * n_cells, dtype=np.int32).reshape(c, n_cells).T[:, None, None]
        entries = (local.ravel(), (rows.ravel(), np.broadcast_to(cols, local.shape).ravel()))
        return csr_array(coo_array(entries, shape=(len(self.indices), c * n_cells)))


def _numbered(cells: IntArray, others: tuple[IntArray, IntArray], n: int) -> csr_array:
    """(n, n): the entries of a symmetric matrix, numbered row by row.

    Those that two nodes of a cell share, the ``others`` and the diagonal; in linear time, since
    scipy sorts them by counting.
    """
    first, second = np.triu_indices(cells.shape[1], 1)
    low, high, every = cells[:, first].ravel(), cells[:, second].ravel(), np.arange(n)
    rows, cols = (
        np.concatenate(part).astype(np.int32)
        for part in ((low, high, others[0], every), (high, low, others[1], every))
    )
    once = csr_array(coo_array((np.ones(len(rows), np.bool_), (rows, cols)), shape=(n, n)))
    once.sort_indices()
    numbers = np.arange(once.nnz, dtype=np.int32)
    return csr_array((numbers, once.indices, once.indptr), shape=(n, n))


def electrode_forms(element: Element) -> list[tuple[IntArray, FloatArray]]:
    """Per electrode: its unknowns (n,), itself last, and the matrix of ∫(u − U)² over it.

    The electrode's own unknown is n_nodes + its number, the ground electrode's included.
    """
    return [_electrode_form(element, number) for number in range(len(element.facets))]


def _electrode_form(element: Element, number: int) -> tuple[IntArray, FloatArray]:
    facets, sizes = element.facets[number], element.facet_sizes[number]
    nodes, local = np.unique(facets, return_inverse=True)
    local = local.reshape(facets.shape)
    n = len(nodes)
    form = np.zeros((n + 1, n + 1))
    np.add.at(
        form, (local[:, :, None], local[:, None, :]), sizes[:, None, None] * element.facet_mass
    )
    load = np.bincount(local.ravel(), (sizes[:, None] * element.facet_load).ravel(), minlength=n)
    form[:n, n] = form[n, :n] = -load
    form[n, n] = sizes.sum()
    return np.append(nodes, element.n_nodes + number), form


def _contact_entries(element: Element) -> tuple[IntArray, IntArray, FloatArray, IntArray]:
    """Entries of all electrodes' forms; the ground electrode's potential is no unknown."""
    rows, cols, values, owner = [], [], [], []
    for number, (unknown, form) in enumerate(electrode_forms(element)):
        rows.append(np.repeat(unknown, len(unknown)))
        cols.append(np.tile(unknown, len(unknown)))
        values.append(form.ravel())
        owner.append(np.full(form.size, number))
    entries = [np.concatenate(part) for part in (rows, cols, values, owner)]
    end = element.n_nodes + len(element.facets) - 1
    kept = (entries[0] < end) & (entries[1] < end) & (entries[2] != 0)
    row, col, value, number = (part[kept] for part in entries)
    return row, col, value, number


def gradient_operator(element: Element) -> csr_array:
    """(d·q·n_cells, n_nodes): nodal potentials → scaled gradients, cells last.

    The product of two such fields, summed over all but the cells, is the integral of ∇u · ∇v
    over each cell.
    """
    n, q, k, d = element.gradients.shape
    values = element.gradients.transpose(3, 1, 0, 2).ravel()
    cols = np.tile(element.cells.astype(np.int32).ravel(), d * q)
    starts = np.arange(d * q * n + 1, dtype=np.int32) * np.int32(k)
    return csr_array((values, cols, starts), shape=(d * q * n, element.n_nodes))
