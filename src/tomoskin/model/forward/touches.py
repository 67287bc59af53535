"""Touches as they are given, cells and what they change to; and in stacks, for the engine of scipy.

A patch of a few dozen nodes costs more in calls than in arithmetic. So touches of about one size
are taken together, by the formula of ``update.py`` with no node eliminated. Each is filled up by
its first node, against which all the others are taken: what is filled up is zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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


_ENTRIES = 1 << 20
"""Of the matrices of one stack, together."""


@dataclass(frozen=True, eq=False)
class Stack:
    """Touches of about one size.

    Attributes
    ----------
    numbers
        (b,) of the touches.
    nodes
        (b, n) of each patch, filled up by its first.
    keys
        (c, k, k) where each entry of the cells' matrices goes in (b, n, n), flat.
    entries
        (c,) cells of all these touches, among those of all touches.
    """

    numbers: IntArray
    nodes: IntArray
    keys: IntArray
    entries: IntArray


def stacks(cells: IntArray, touches: Touches) -> Iterator[Stack]:
    """Stacks of the touches that have any cells, by the mesh's ``cells`` (m, k)."""
    sizes = np.diff(touches.starts)
    rest = np.flatnonzero(sizes > 0)
    rest = rest[np.argsort(sizes[rest], kind="stable")]
    while len(rest):
        most = int(sizes[rest[0]]) + 8
        count = max(1, min(int(np.searchsorted(sizes[rest], most)), _ENTRIES // most**2))
        yield _stack(cells, touches, rest[:count])
        rest = rest[count:]


def _stack(cells: IntArray, touches: Touches, numbers: IntArray) -> Stack:
    """The touches of these numbers as one stack."""
    begin, end = touches.starts[numbers], touches.starts[numbers + 1]
    owner = np.repeat(np.arange(len(numbers)), end - begin)
    entries = np.arange(len(owner)) + np.repeat(
        begin - np.cumsum(end - begin) + end - begin, end - begin
    )
    corners = cells[touches.cells[entries]]
    n_nodes = int(cells.max()) + 1
    unique, place = np.unique(owner[:, None] * n_nodes + corners, return_inverse=True)
    first = np.searchsorted(unique, np.arange(len(numbers) + 1) * n_nodes)
    count = np.diff(first)
    most = int(count.max())
    within = np.arange(most)
    nodes = unique[first[:-1, None] + np.where(within < count[:, None], within, 0)] % n_nodes
    place = place.reshape(corners.shape) - first[owner][:, None]
    keys = (owner[:, None, None] * most + place[:, :, None]) * most + place[:, None, :]
    return Stack(numbers, nodes, keys, entries)


def stack_change(
    base: BaseState, between: NDArray[Any], stack: Stack, touches: Touches
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(b, e, e) Uᵀ (I + A C)⁻¹ A U of each, and what rounding may cost it.

    ``between`` (b, n, n): the inverse of the base system, between the nodes of each patch.
    """
    nodes, index = stack.nodes, touches.cells[stack.entries]
    moved = touches.conductivity[stack.entries] - base.conductivity[index]
    change = _summed(base.local[index] * moved[:, None, None], stack.keys, between.shape)
    between = between[:, 1:] - between[:, :1]
    between = between[:, :, 1:] - between[:, :, :1]
    fields = base.fields[nodes[:, 1:]] - base.fields[nodes[:, :1]]
    leak, change = change[:, 1:].sum(axis=2, keepdims=True), change[:, 1:, 1:]
    system = change @ between
    diagonal = np.arange(system.shape[1])
    system[:, diagonal, diagonal] += 1.0
    current = np.linalg.solve(system, change @ fields)
    changed = fields - between @ current
    residual = change @ changed - current + leak * changed
    return fields.swapaxes(1, 2) @ current, changed.swapaxes(1, 2) @ residual


def _summed(entries: NDArray[Any], keys: IntArray, shape: tuple[int, ...]) -> NDArray[Any]:
    """Of that ``shape``: the sum of the cells' matrices (c, k, k), by the ``keys`` (c, k, k)."""
    size, keys = int(np.prod(shape)), keys.ravel()
    total = np.bincount(keys, entries.real.ravel(), size).astype(entries.dtype)
    if np.iscomplexobj(entries):
        total += 1j * np.bincount(keys, entries.imag.ravel(), size)
    return total.reshape(shape)
