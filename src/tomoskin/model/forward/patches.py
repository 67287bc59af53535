"""Touches by stacks of matrices, for the engine of scipy: the formula of a local update, its calls
shared.

A patch of a few dozen nodes costs more in calls than in arithmetic. So no node is eliminated, and
touches of about one size are taken together, each filled up by its first node, against which all
the others are taken: what is filled up is zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray
from tomoskin.model.forward.engine import BaseState
from tomoskin.model.forward.touches import Touches

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
    """These touches as a stack."""
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
