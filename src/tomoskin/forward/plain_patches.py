"""The local update by numpy; see :mod:`tomoskin.forward.update`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.forward.patches import BaseState
from tomoskin.forward.touches import Touches


class PlainPatches:
    """See :class:`~tomoskin.forward.patches.Patches`."""

    def __init__(self, base: BaseState) -> None:
        """Prepare for touches of ``base``."""
        n = len(base.held)
        self._base = base
        self._valence = np.bincount(base.cells.ravel(), minlength=n) + base.cells.size * base.held
        self._slot = np.full(n, -1)
        self._columns: NDArray[Any] = np.empty((0, n), base.fields.dtype)

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """See the protocol."""
        self._slot[nodes] = len(self._columns) + np.arange(len(nodes))
        self._columns = np.vstack([self._columns, columns.T])

    def forget(self) -> None:
        """See the protocol."""
        self._slot[:] = -1
        self._columns = self._columns[:0]

    def change(
        self, starts: IntArray, cells: IntArray, conductivity: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], IntArray]:
        """See the protocol."""
        touches, base = Touches(starts, cells, conductivity), self._base
        if touches.fault(len(base.cells)) is not None:
            raise ValueError("a cell or conductivity that cannot be")
        shape = (len(touches), *base.grounded.shape)
        kind = np.result_type(base.fields, conductivity)
        grounded, lost = np.empty(shape, kind), np.zeros(shape, kind)
        grounded[:] = base.grounded
        missing: list[IntArray] = []
        for number in range(len(touches)):
            index, sigma = touches[number]
            rim, change = self._condensed(index, sigma)
            missing.append(rim[self._slot[rim] < 0])
            if len(rim) > 1 and not len(missing[-1]):
                less, lost[number] = self._woodbury(rim, change)
                grounded[number] -= less
        return grounded, lost, np.unique(np.concatenate([starts[:0], *missing]))

    def _condensed(self, index: IntArray, sigma: NDArray[Any]) -> tuple[IntArray, NDArray[Any]]:
        """Nodes of the patch's rim (m,), and the change of the system seen from there (m, m)."""
        base = self._base
        nodes, place, touched = np.unique(
            base.cells[index], return_inverse=True, return_counts=True
        )
        inside = touched == self._valence[nodes]
        place = place.reshape(-1, base.cells.shape[1])
        before, after = (
            _condensed(_block(base.local[index], place, unit, len(nodes)), inside)
            for unit in (base.conductivity[index], sigma)
        )
        return nodes[~inside], after - before

    def _woodbury(self, rim: IntArray, change: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Uᵀ (I + A C)⁻¹ A U, and what rounding may cost it."""
        between = self._columns[self._slot[rim][:, None], rim]
        between = between[1:] - between[:1]
        between = between[:, 1:] - between[:, :1]
        fields = self._base.fields[rim[1:]] - self._base.fields[rim[:1]]
        leak, change = change[1:].sum(axis=1, keepdims=True), change[1:, 1:]
        system = change @ between
        system[np.diag_indices_from(system)] += 1.0
        current = np.linalg.solve(system, change @ fields)
        changed = fields - between @ current
        residual = change @ changed - current + leak * changed
        return fields.T @ current, changed.T @ residual


def _block(local: FloatArray, place: IntArray, conductivity: NDArray[Any], n: int) -> NDArray[Any]:
    """(n, n): the sum of the cells' matrices."""
    entries = (local * conductivity[:, None, None]).ravel()
    keys = (place[:, :, None] * n + place[:, None, :]).ravel()
    block = np.bincount(keys, entries.real, n * n).astype(entries.dtype)
    if np.iscomplexobj(entries):
        block += 1j * np.bincount(keys, entries.imag, n * n)
    return block.reshape(n, n)


def _condensed(block: NDArray[Any], inside: NDArray[np.bool_]) -> NDArray[Any]:
    """``block`` without the nodes inside, which no current enters (Schur complement)."""
    outer, across, inner = (
        block[~inside][:, ~inside],
        block[inside][:, ~inside],
        block[inside][:, inside],
    )
    return np.asarray(outer - across.T @ np.linalg.solve(inner, across))
