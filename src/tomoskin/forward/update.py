"""The local update: a touch changes few cells, and few nodes lie on them.

With the inverse of the base system between the touched nodes in hand, the voltages of the changed
sheet follow exactly from a small dense system (Woodbury 1950):

    R' = R − Uᵀ (I + A C)⁻¹ A U,

where A is the change of the system on the touched nodes, C = (K⁻¹) between them and U the basis
fields on them. A constant changes nothing, so all three are taken against the first touched node:
what the nodes have in common would cost digits, and does not enter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import IntArray, ModelError
from tomoskin.forward.accuracy import checked_voltages
from tomoskin.forward.conductivity import numbers
from tomoskin.forward.factor import singular
from tomoskin.forward.pairs import centred

if TYPE_CHECKING:
    from tomoskin.forward.state import State

MOST_BYTES = 1 << 30
"""Columns of the inverse are kept up to this size, then those of the oldest call go."""


class LocalUpdate:
    """Exact transfer resistance and voltages of a state with some cells changed.

    Columns of the inverse are computed as nodes are first touched, and kept: the first touch at
    a place costs a solve with as many right-hand sides as it has nodes, later ones do not.
    """

    def __init__(self, state: State) -> None:
        """Prepare for changes of ``state``; nothing is computed yet."""
        self._state = state
        assembly = state.model.assembly
        gradients = assembly.element.gradients
        self._local = np.einsum("nqid,nqjd->nij", gradients, gradients)
        self._cells = assembly.element.cells
        self._slot = np.full(assembly.n_points, -1)
        self._columns: NDArray[Any] = np.empty((0, assembly.n_points), state.basis.dtype)

    def warm_up(self, cells: ArrayLike | None = None) -> None:
        """Compute the columns for ``cells`` (all of them without an argument) beforehand."""
        chosen = self._cells if cells is None else self._cells[np.asarray(cells)]
        self._need(np.unique(chosen))

    def transfer_resistance(self, cells: ArrayLike, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω with ``cells`` (n,) changed to ``conductivity`` (n,).

        Raises
        ------
        ModelError
            For cells that do not exist or stand twice, a conductivity that is not positive, or
            a change that leaves the system singular to working precision.
        """
        return centred(self._changed(cells, conductivity)[0])

    def voltages(self, cells: ArrayLike, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_meas,) V with ``cells`` changed; see :meth:`transfer_resistance`."""
        return self._changed(cells, conductivity)[1]

    def _changed(
        self, cells: ArrayLike, conductivity: ArrayLike
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """Transfer resistance against the ground electrode, and voltages.

        The residual is that of the whole changed system: what A drives in the changed fields must
        be the currents that were found.
        """
        index, change = self._change(cells, conductivity)
        nodes, block = self._block(index, change)
        block, between, base = block[1:, 1:], self._between(nodes), self._state.basis
        between = between[1:] - between[:1]
        between = between[:, 1:] - between[:, :1]
        fields = base[nodes[1:]] - base[nodes[:1]]
        current = _currents(block, between, fields)
        changed = fields - between @ current
        residual = block @ changed - current
        model = self._state.model
        grounded = base[model.assembly.n_points :] - fields.T @ current
        return grounded, checked_voltages(model, grounded, changed.T @ residual)

    def _change(self, cells: ArrayLike, conductivity: ArrayLike) -> tuple[IntArray, NDArray[Any]]:
        state = self._state
        if state.conductivity.ndim > 1:
            raise ModelError("a local update needs a scalar conductivity")
        index, sigma = numbers(cells, "cells"), numbers(conductivity, "conductivity")
        if not index.size:
            index = index.astype(np.int64)
        n = len(self._cells)
        if index.dtype.kind not in "iu" or index.ndim != 1 or sigma.shape != index.shape:
            raise ModelError(
                f"expected cells (n,) and as many conductivities, got {index.shape} "
                f"{index.dtype} and {sigma.shape}"
            )
        if len(index) and not (index.min() >= 0 and index.max() < n):
            raise ModelError(f"expected cells from 0 to {n - 1}")
        if not (np.isfinite(sigma) & (sigma.real > 0)).all():
            bad = int(np.argmin(np.isfinite(sigma) & (sigma.real > 0)))
            raise ModelError(
                f"expected a positive finite conductivity, got {sigma[bad]}",
                where=f"cell {index[bad]}",
            )
        if len(np.unique(index)) < len(index):
            raise ModelError("expected each cell once")
        return index, sigma - state.conductivity[index]

    def _block(self, index: IntArray, change: NDArray[Any]) -> tuple[IntArray, NDArray[Any]]:
        """Touched nodes (p,), and the change of the system between them, (p, p)."""
        cells = self._cells[index]
        nodes, place = np.unique(cells, return_inverse=True)
        place = place.reshape(cells.shape)
        p = len(nodes)
        entries = self._local[index] * change[:, None, None]
        keys = (place[:, :, None] * p + place[:, None, :]).ravel()
        if np.iscomplexobj(entries):
            flat = entries.ravel()
            block = np.bincount(keys, flat.real, p * p) + 1j * np.bincount(keys, flat.imag, p * p)
        else:
            block = np.bincount(keys, entries.ravel(), p * p)
        return nodes, block.reshape(p, p)

    def _between(self, nodes: IntArray) -> NDArray[Any]:
        """(p, p): the base system's inverse between ``nodes``."""
        self._need(nodes)
        return np.asarray(self._columns[self._slot[nodes][:, None], nodes])

    def _need(self, nodes: IntArray) -> None:
        missing = nodes[self._slot[nodes] < 0]
        if not len(missing):
            return
        state, n = self._state, self._state.model.assembly.n_points
        if (len(self._columns) + len(missing)) * n * self._columns.itemsize > MOST_BYTES:
            self._slot[:] = -1
            self._columns = self._columns[:0]
            missing = nodes
        rhs = np.zeros((state.model.assembly.n_unknowns, len(missing)), self._columns.dtype)
        rhs[missing, np.arange(len(missing))] = 1.0
        solved = state.factor.solve(rhs)[:n].T
        self._slot[missing] = len(self._columns) + np.arange(len(missing))
        self._columns = np.vstack([self._columns, solved])


def _currents(change: NDArray[Any], between: NDArray[Any], fields: NDArray[Any]) -> NDArray[Any]:
    """(I + A C)⁻¹ A U, what the change drives out of each node."""
    system = change @ between
    system[np.diag_indices_from(system)] += 1.0
    try:
        return np.linalg.solve(system, change @ fields)
    except np.linalg.LinAlgError as error:
        raise singular() from error
