"""Assembly of the complete electrode model as two sparse products.

Unknowns are the nodal potentials, then the potentials of all electrodes but the last, which is
the ground. The matrix is symmetric with a fixed structure; only its values follow the
conductivity and the contact impedance:

    values = stiffness @ σ + contact @ (1/z)

with the weak form of Somersalo, Cheney & Isaacson 1992, eq. (4.2), for P1 elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh import Mesh, simplex_measure


@dataclass(frozen=True, eq=False)
class Assembly:
    """Sparsity structure of the system and the maps that fill it.

    Attributes
    ----------
    n_points, n_electrodes
        Sizes; the system has n_points + n_electrodes − 1 unknowns.
    indices, indptr
        Compressed-column structure of the symmetric matrix.
    stiffness
        (n_values, n_cells): values per unit of conductivity.
    contact
        (n_values, n_electrodes): values per unit of 1/z.
    """

    n_points: int
    n_electrodes: int
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    stiffness: csr_array
    contact: csr_array

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """Structure and maps for ``mesh``."""
        n = len(mesh.points) + len(mesh.electrodes) - 1
        cell_rows, cell_cols, cell_values, cell_owner = _stiffness_entries(mesh)
        rows, cols, values, owner = _contact_entries(mesh)
        key = np.concatenate([cell_cols * n + cell_rows, cols * n + rows])
        unique, place = np.unique(key, return_inverse=True)
        split = len(cell_rows)
        indptr = np.searchsorted(unique, np.arange(n + 1) * n)
        return cls(
            n_points=len(mesh.points),
            n_electrodes=len(mesh.electrodes),
            indices=(unique % n).astype(np.int32),
            indptr=indptr.astype(np.int32),
            stiffness=_map(cell_values, place[:split], cell_owner, len(unique), len(mesh.cells)),
            contact=_map(values, place[split:], owner, len(unique), len(mesh.electrodes)),
        )

    @property
    def n_unknowns(self) -> int:
        """Size of the system."""
        return self.n_points + self.n_electrodes - 1

    def matrix(self, conductivity: NDArray[Any], contact_impedance: NDArray[Any]) -> csc_array:
        """System matrix, (n_unknowns, n_unknowns), for σ (n_cells,) and z (n_electrodes,)."""
        values = self.stiffness @ conductivity + self.contact @ (1.0 / contact_impedance)
        shape = (self.n_unknowns, self.n_unknowns)
        return csc_array((values, self.indices, self.indptr), shape=shape)


def gradients(mesh: Mesh) -> FloatArray:
    """(n_cells, k, d) gradient of each corner's hat function, 1/m, in the mesh's own metric."""
    corner = mesh.points[mesh.cells]
    edges = corner[:, 1:] - corner[:, :1]
    gram = edges @ edges.transpose(0, 2, 1)
    inner = np.linalg.solve(gram, edges)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


Entries = tuple[IntArray, IntArray, FloatArray, IntArray]


def _stiffness_entries(mesh: Mesh) -> Entries:
    grad = gradients(mesh)
    k = mesh.cells.shape[1]
    local = grad @ grad.transpose(0, 2, 1) * mesh.volumes[:, None, None]
    rows = np.repeat(mesh.cells, k, axis=1).ravel()
    cols = np.tile(mesh.cells, (1, k)).ravel()
    return rows, cols, local.ravel(), np.repeat(np.arange(len(mesh.cells)), k * k)


def _contact_entries(mesh: Mesh) -> Entries:
    """∫(u − U)² over each electrode; the ground electrode's U is no unknown."""
    parts = [_electrode_entries(mesh, number) for number in range(len(mesh.electrodes))]
    rows, cols, values, owner = (np.concatenate(p) for p in zip(*parts, strict=True))
    unknown = (rows < _end(mesh)) & (cols < _end(mesh))
    return rows[unknown], cols[unknown], values[unknown], owner[unknown]


def _electrode_entries(mesh: Mesh, number: int) -> Entries:
    facets = mesh.electrodes[number]
    m = facets.shape[1]
    size = simplex_measure(mesh.points, facets)
    unknown = np.column_stack([facets, np.full(len(facets), len(mesh.points) + number)])
    # exact integrals of products of the facet's hat functions, and of each with the constant U
    local = np.empty((m + 1, m + 1))
    local[:m, :m] = (1.0 + np.eye(m)) / (m * (m + 1))
    local[:m, m] = local[m, :m] = -1.0 / m
    local[m, m] = 1.0
    values = size[:, None, None] * local
    rows = np.repeat(unknown, m + 1, axis=1).ravel()
    cols = np.tile(unknown, (1, m + 1)).ravel()
    return rows, cols, values.ravel(), np.full(len(rows), number)


def _end(mesh: Mesh) -> int:
    return len(mesh.points) + len(mesh.electrodes) - 1


def _map(
    values: FloatArray, place: IntArray, owner: IntArray, n_values: int, n_owners: int
) -> csr_array:
    return csr_array(coo_array((values, (place, owner)), shape=(n_values, n_owners)))


def gradient_operator(mesh: Mesh) -> csr_array:
    """(d·n_cells, n_points): nodal potentials → gradient times √volume, axis-major.

    The scaling makes a product of two such fields the integral over the cell.
    """
    grad = gradients(mesh) * np.sqrt(mesh.volumes)[:, None, None]
    n, k, d = grad.shape
    rows = np.arange(d)[:, None, None] * n + np.arange(n)[None, :, None]
    cols = np.broadcast_to(mesh.cells[None], (d, n, k))
    rows = np.broadcast_to(rows, (d, n, k))
    entries = (grad.transpose(2, 0, 1).ravel(), (rows.ravel(), cols.ravel()))
    return csr_array(coo_array(entries, shape=(d * n, len(mesh.points))))
