"""Assembly of the complete electrode model as two sparse products.

Unknowns are the nodal potentials, then the potentials of all electrodes but the last, which is
the ground. The matrix is symmetric with a fixed structure; only its values follow the
conductivity and the contact impedance:

    values = stiffness @ σ + contact @ (1/z)

with the weak form of Somersalo, Cheney & Isaacson 1992, eq. (4.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward.element import Element
from tomoskin.model.forward.engine import Compressed


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

    def contacts(self, contact_impedance: NDArray[Any]) -> NDArray[Any]:
        """(n_values,): what the contacts add to the system matrix, for z (n_electrodes,)."""
        return np.asarray(self.contact @ (1.0 / contact_impedance))

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


Entries = tuple[IntArray, IntArray, FloatArray, IntArray]


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


def _contact_entries(element: Element) -> Entries:
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
