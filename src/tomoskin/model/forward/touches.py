"""Touches as they are given, cells and what they change to; and what the engine of scipy makes of
one: the formula of ``update.py`` with no node eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from tomoskin.core import IntArray, ModelError
from tomoskin.model.forward.conductivity import numbers
from tomoskin.model.forward.engine import BaseState

Touch = tuple[ArrayLike, ArrayLike]
"""Cells (n,), and the conductivity (n,) of each."""


@dataclass(frozen=True, eq=False)
class Touches:
    """Touches one behind the other: number t has ``cells[starts[t]:starts[t + 1]]``."""

    starts: IntArray
    cells: IntArray
    conductivity: NDArray[Any]

    @classmethod
    def of(cls, touches: Sequence[Touch], dtype: DTypeLike) -> Self:
        """Join touches; conductivities get ``dtype`` unless one of them is complex.

        Raises
        ------
        ModelError
            For cells that are no whole numbers, or not as many conductivities.
        """
        pairs = [_arrays(*touch) for touch in touches]
        if len(pairs) == 1:
            cells, sigma = pairs[0]
            starts = np.array([0, len(cells)])
        else:
            starts = np.cumsum([0, *(len(cells) for cells, _ in pairs)])
            cells = np.concatenate([cells for cells, _ in pairs] or [starts[:0]])
            sigma = np.concatenate([sigma for _, sigma in pairs] or [np.empty(0)])
        kind = np.complex128 if sigma.dtype.kind == "c" else dtype
        return cls(starts, np.ascontiguousarray(cells, np.int64), np.ascontiguousarray(sigma, kind))

    def __len__(self) -> int:
        """The number of touches in the stack."""
        return len(self.starts) - 1

    def __getitem__(self, number: int) -> tuple[IntArray, NDArray[Any]]:
        """Cells and conductivities of one touch."""
        within = slice(self.starts[number], self.starts[number + 1])
        return self.cells[within], self.conductivity[within]

    def part(self, first: int, end: int) -> Touches:
        """Touches from ``first`` on, before ``end``."""
        starts = self.starts[first : end + 1]
        within = slice(starts[0], starts[-1])
        return Touches(starts - starts[0], self.cells[within], self.conductivity[within])

    def fault(self, n_cells: int) -> ModelError | None:
        """Return what is wrong with them, on a mesh of ``n_cells``; nothing where all is well."""
        for number in range(len(self)):
            cells, sigma = self[number]
            touch = f"touch {number}, " if len(self) > 1 else ""
            outside = (cells < 0) | (cells >= n_cells)
            if outside.any():
                bad = cells[np.argmax(outside)]
                return ModelError(
                    f"expected cells from 0 to {n_cells - 1}, got {bad}", where=f"{touch}cell {bad}"
                )
            good = np.isfinite(sigma) & (sigma.real > 0)
            if not good.all():
                bad = int(np.argmin(good))
                return ModelError(
                    f"expected a positive finite conductivity, got {sigma[bad]}",
                    where=f"{touch}cell {cells[bad]}",
                )
            order = np.sort(cells)
            twice = order[1:] == order[:-1]
            if twice.any():
                bad = order[np.argmax(twice)]
                return ModelError(
                    "expected each cell once, got it twice", where=f"{touch}cell {bad}"
                )
        return None


def _arrays(cells: ArrayLike, conductivity: ArrayLike) -> tuple[IntArray, NDArray[Any]]:
    index, sigma = numbers(cells, "cells"), numbers(conductivity, "conductivity")
    if not index.size:
        index = index.astype(np.int64)
    if index.dtype.kind not in "iu" or index.ndim != 1 or sigma.shape != index.shape:
        raise ModelError(
            f"expected cells (n,) and as many conductivities, got {index.shape} "
            f"{index.dtype} and {sigma.shape}"
        )
    return index, sigma


def patch_change(
    base: BaseState,
    between: NDArray[Any],
    nodes: IntArray,
    place: IntArray,
    touch: tuple[IntArray, NDArray[Any]],
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(e, e) Uᵀ (I + A C)⁻¹ A U of one touch, and what rounding may cost it.

    ``between`` (n, n): the inverse of the base system, between the ``nodes`` of the patch;
    ``place``: which of them each corner of its cells is.
    """
    (index, sigma), place = touch, place.reshape(-1, base.cells.shape[1])
    moved = base.local[index] * (sigma - base.conductivity[index])[:, None, None]
    change = np.zeros(between.shape, moved.dtype)
    np.add.at(change, (place[:, :, None], place[:, None, :]), moved)
    between = between[1:] - between[:1]
    between = between[:, 1:] - between[:, :1]
    fields = base.fields[nodes[1:]] - base.fields[nodes[:1]]
    leak, change = change[1:].sum(axis=1, keepdims=True), change[1:, 1:]
    system = change @ between
    system[np.diag_indices_from(system)] += 1.0
    current = np.linalg.solve(system, change @ fields)
    changed = fields - between @ current
    residual = change @ changed - current + leak * changed
    return fields.T @ current, changed.T @ residual
