"""The local update of many touches at once, by numpy: see :mod:`tomoskin.model.forward.update`.

Touches of about as many cells lie side by side in one array. The nodes inside a patch are
eliminated by a Cholesky factor of its whole matrix, inside first: the end of the factor is that of
what the rim sees. Large patches are cut into quarters, whose rims are what is left to eliminate:
nested dissection (George 1973). A patch alone holds a constant, so a multiple of the identity is
added on the rim, and taken away again.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, reach
from tomoskin.model.forward.engine import BaseState, singular
from tomoskin.model.forward.solution import Solution
from tomoskin.model.forward.update import base_state

_ABREAST, _CELLS = 64, 3000
"""Touches that lie side by side, and their cells together, at the most: they stay near the
processor."""

_CUT = 200
"""Cells above which a patch is cut into quarters, and a larger one by four again."""

MOST_BYTES = 1 << 30
"""Of the inverse of a state's matrix: where it is larger, touches come in parts."""

Batch = tuple[NDArray[np.integer], NDArray[np.integer], FloatArray]
"""Touches one behind the other: ``starts`` (n + 1,), and the ``cells`` (c,) and ``height`` (c,) of
each; what is there of log σ changes by the height times a depth."""


class TouchBatch:
    """Changes of a state by many touches, each a shape that is tried in several depths.

    It holds the inverse of the state's matrix while it lives: 6 MB for 1,500 cells.

    Parameters
    ----------
    state
        With a real scalar conductivity.
    """

    def __init__(self, state: Solution) -> None:
        self._state, self._base = state, base_state(state)

    def change(self, touches: Batch, depths: FloatArray) -> FloatArray:
        """(n, k, width, width) Ω by which each touch in each depth changes the resistance
        between electrodes, against the last one.

        Raises
        ------
        ModelError
            When a patch is singular to working precision.
        """
        if 8 * len(self._base.held) ** 2 > MOST_BYTES:
            change = self._in_parts(touches, depths)
        else:
            change = self._whole.change(touches, depths)
        if not np.isfinite(change).all():
            raise singular()
        return change

    @cached_property
    def _whole(self) -> PatchBatch | NativeBatch:
        """With columns of all nodes."""
        return self._reaching(np.arange(len(self._base.held)))

    def _reaching(self, nodes: IntArray) -> PatchBatch | NativeBatch:
        """For touches that reach these nodes at most."""
        n = len(self._base.held)
        engine = self._state.model.engine
        if engine.core is not None:
            patches = engine.patches(self._base)
            patches.keep(nodes, self._state.factor.columns(nodes)[:n])
            return NativeBatch(patches)
        slot = np.zeros(n, np.int64)
        slot[nodes] = np.arange(len(nodes))
        columns = self._state.factor.columns(nodes)[:n].T
        centroids = self._state.model.mesh.centroids
        return PatchBatch(self._base, np.ascontiguousarray(columns), slot, centroids)

    def _in_parts(self, touches: Batch, depths: FloatArray) -> FloatArray:
        """:meth:`change` where the whole inverse is too large."""
        starts, cells, _ = touches
        nodes, n = np.unique(self._base.cells[cells]), len(self._base.held)
        if len(starts) <= 2 or 8 * len(nodes) * n <= MOST_BYTES:
            return self._reaching(nodes).change(touches, depths)
        halves = np.array_split(np.arange(len(starts) - 1), 2)
        return np.concatenate([self._in_parts(_chosen(h, touches), depths) for h in halves])


@dataclass(frozen=True, eq=False)
class NativeBatch:
    """The same by the ``patches`` of the native engine, which hold the columns."""

    patches: Any

    def change(self, touches: Batch, depths: FloatArray) -> FloatArray:
        """(n, k, width, width) Ω; see :meth:`TouchBatch.change`."""
        starts, cells = (np.ascontiguousarray(part, np.int64) for part in touches[:2])
        try:
            less, missing = self.patches.scaled(starts, cells, touches[2], depths)
        except ValueError as error:
            raise singular() from error
        assert not len(missing), "columns of all nodes that touches reach are kept"
        return np.asarray(-less)


@dataclass(frozen=True, eq=False)
class PatchBatch:
    """The same by numpy, with columns of the inverse in hand.

    Attributes
    ----------
    base
        The state.
    columns, slot
        (m, n_nodes) of the inverse of the base system, and (n_nodes,) which row each node has.
    centroids
        (n_cells, d) of the cells, in any coordinates.
    """

    base: BaseState
    columns: FloatArray
    slot: IntArray
    centroids: FloatArray

    def change(self, touches: Batch, depths: FloatArray) -> FloatArray:
        """(n, k, width, width) Ω; see :meth:`TouchBatch.change`."""
        starts = touches[0]
        width = self.base.fields.shape[1]
        out = np.empty((len(starts) - 1, len(depths), width, width))

        def work(some: IntArray) -> None:
            out[some] = -self._batch(_chosen(some, touches), depths)

        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            for _ in pool.map(work, _batches(np.diff(starts))):
                reach()
        return out

    def _batch(self, touches: Batch, depths: FloatArray) -> FloatArray:
        """(b, k, width, width) Ω that a few touches take away."""
        starts, cells, height = touches
        base, count = self.base, len(starts) - 1
        owner = np.repeat(np.arange(count), np.diff(starts))
        nodes = base.cells[cells]
        factor = np.exp(np.multiply.outer(np.concatenate([[0.0], depths]), height))
        matrices = (factor * base.conductivity[cells])[:, :, None, None] * base.local[cells]
        cuts = _cuts(len(cells) / count)
        for _ in range(cuts):
            owner = _quartered(owner, self.centroids[cells])
        valence = self._counted(owner, nodes, count * 4**cuts)
        for _ in range(cuts):
            nodes, matrices = self._condensed(owner, nodes, matrices, valence)
            owner = np.arange(len(valence)) // 4
            valence = valence.reshape(len(valence) // 4, 4, -1).sum(axis=1)
        nodes, matrices = self._condensed(owner, nodes, matrices, valence)
        return self._lessened(matrices, nodes)

    def _counted(self, owner: IntArray, nodes: IntArray, count: int) -> IntArray:
        """(count, n_nodes) cells at each node, of each owner."""
        n = len(self.base.held)
        flat = (owner[:, None] * n + nodes).ravel()
        return np.bincount(flat, minlength=count * n).reshape(count, n)

    def _condensed(
        self, owner: IntArray, nodes: IntArray, matrices: FloatArray, valence: IntArray
    ) -> tuple[IntArray, FloatArray]:
        """What the rims of groups see: their nodes (g, r) and matrices (1 + k, g, r, r).

        Of parts (e,) whose ``nodes`` (e, v) have ``matrices`` (1 + k, e, v, v), each of an
        ``owner``; ``valence`` (g, n_nodes): the cells of a group at each node. Rows of groups with
        a smaller rim are filled up with its first node, and zeros.
        """
        groups, n = valence.shape
        present = np.zeros((groups, n), bool)
        present[owner[:, None], nodes] = True
        inside = present & (valence == self._valence)
        rim = present & ~inside
        own = inside.sum(axis=1)
        n_inside, n_rim = int(own.max()), int(rim.sum(axis=1).max())
        number = np.where(inside, inside.cumsum(axis=1), n_inside + rim.cumsum(axis=1)) - 1
        place, size = number[owner[:, None], nodes], n_inside + n_rim
        flat = ((owner[:, None] * size + place)[:, :, None] * size + place[:, None, :]).ravel()
        joined = np.empty((len(matrices), groups, size, size))
        for part, whole in zip(matrices, joined, strict=True):
            whole[:] = np.bincount(flat, part.ravel(), whole.size).reshape(whole.shape)
        missing = np.nonzero(np.arange(n_inside) >= own[:, None])
        joined[:, missing[0], missing[1], missing[1]] = 1.0
        return _padded_nodes(rim, n_rim), _schur(joined, n_inside)

    def _lessened(self, rims: FloatArray, nodes: IntArray) -> FloatArray:
        """(b, k, width, width) Ω of matrices (1 + k, b, r, r) that ``nodes`` (b, r) of rims see."""
        change = (rims[1:] - rims[0])[:, :, 1:, 1:].swapaxes(0, 1)
        between = self.columns[self.slot[nodes][:, :, None], nodes[:, None, :]]
        between = between[:, 1:] - between[:, :1]
        between = between[:, :, 1:] - between[:, :, :1]
        fields = self.base.fields[nodes[:, 1:]] - self.base.fields[nodes[:, :1]]
        system = change @ between[:, None]
        diagonal = np.arange(system.shape[-1])
        system[..., diagonal, diagonal] += 1.0
        current = np.linalg.solve(system, change @ fields[:, None])
        return np.asarray(fields.swapaxes(1, 2)[:, None] @ current)

    @cached_property
    def _valence(self) -> IntArray:
        """(n_nodes,) cells at each node that may be eliminated; −1 at those that may not."""
        base = self.base
        count = np.bincount(base.cells.ravel(), minlength=len(base.held))
        return np.where(base.held, -1, count)


def _batches(n_cells: IntArray) -> Iterator[IntArray]:
    """Numbers of touches of about as many cells (n,), as many as fit side by side."""
    order = np.argsort(n_cells, kind="stable")
    first = 0
    while first < len(order):
        largest = n_cells[order[min(first + _ABREAST, len(order)) - 1]]
        count = max(1, min(_ABREAST, _CELLS // max(int(largest), 1)))
        yield order[first : first + count]
        first += count


def _chosen(some: IntArray, touches: Batch) -> Batch:
    """``some`` of the touches."""
    starts, cells, height = touches
    lengths = np.diff(starts)[some]
    ends = np.cumsum(lengths)
    entries = np.arange(ends[-1]) + np.repeat(starts[some] - ends + lengths, lengths)
    return np.concatenate([[0], ends]), cells[entries], height[entries]


def _cuts(n_cells: float) -> int:
    """How often a patch of so many cells is cut into quarters."""
    return int(n_cells > _CUT) + int(n_cells > 4 * _CUT)


def _quartered(owner: IntArray, centroids: FloatArray) -> IntArray:
    """(c,) numbers of quarters: cells of each owner (c,) by the side of its middle they lie on."""
    count = np.maximum(np.bincount(owner), 1)
    quarter = np.zeros(len(owner), np.int64)
    for axis in (0, 1):
        middle = np.bincount(owner, centroids[:, axis]) / count
        quarter = 2 * quarter + (centroids[:, axis] > middle[owner])
    return 4 * owner + quarter


def _padded_nodes(rim: NDArray[np.bool_], n_rim: int) -> IntArray:
    """(g, n_rim) nodes of each rim; its first one again where it has fewer."""
    group, node = np.nonzero(rim)
    count = rim.sum(axis=1)
    nodes = np.repeat(rim.argmax(axis=1)[:, None], n_rim, axis=1)
    nodes[group, np.arange(len(node)) - np.repeat(np.cumsum(count) - count, count)] = node
    return nodes


def _schur(matrices: FloatArray, n_inside: int) -> FloatArray:
    """(…, r, r) what is left of ``matrices`` (…, n, n) without their first ``n_inside`` rows."""
    if not n_inside:
        return matrices
    inside = np.arange(n_inside)  # an empty group has zeros at its first node
    held = matrices[..., inside, inside]
    matrices[..., inside, inside] = np.where(held == 0.0, 1.0, held)
    rim = np.arange(n_inside, matrices.shape[-1])
    more = float(matrices[..., rim, rim].max(initial=0.0))
    matrices[..., rim, rim] += more
    try:
        factor = np.linalg.cholesky(matrices)[..., n_inside:, n_inside:]
    except np.linalg.LinAlgError as error:
        raise singular() from error
    condensed = factor @ factor.swapaxes(-1, -2)
    rim -= n_inside
    condensed[..., rim, rim] -= more
    return np.asarray(condensed)
