"""A curved sheet of triangles laid flat: as little stretched as can be."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import splu

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.triangles import SIDES, paired_facets

_ROUNDS = 100
_SETTLED = 1e-6
"""Of the extent: a round that moves no point further is the last."""


def flattened(points: FloatArray, cells: IntArray) -> FloatArray:
    """(n, 2) m: plane coordinates of a sheet (n, 3) whose ``cells`` all turn the same way.

    First onto a disc, which never folds (Tutte, Proc. London Math. Soc. 13 (1963) 743); then as
    rigid as possible (Liu et al., Computer Graphics Forum 27 (2008) 1495), as far as it does not
    fold. What unrolls without stretch comes out with its own lengths.

    Raises
    ------
    GeometryError
        When the sheet has no rim, or more than one.
    """
    rim = rim_of(cells)
    flat = _on_disc(points, cells, rim)
    next_round = _rigid(_plane_shapes(points, cells), cells, len(points))
    extent = float(np.ptp(points, axis=0).max())
    for _ in range(_ROUNDS):
        moved = next_round(flat)
        if (_doubled_area(moved[cells]) <= 0).any():
            break
        step = float(np.abs(moved - flat).max())
        flat = moved
        if step < _SETTLED * extent:
            break
    return flat


def rim_of(cells: IntArray) -> IntArray:
    """(n,) points along the one rim, in the sense in which the cells turn.

    Raises
    ------
    GeometryError
        When there is no rim, more than one, or a hole that makes it no disc.
    """
    sides = np.concatenate([cells[:, turn] for turn in SIDES])
    n = int(cells.max()) + 1
    forth = sides[:, 0] * n + sides[:, 1]
    back = sides[:, 1] * n + sides[:, 0]
    free = sides[~np.isin(forth, back)]
    if not len(free):
        raise GeometryError(
            "the surface is closed: it has no rim for electrodes", hint="cut it open along a line"
        )
    ahead = dict(zip(free[:, 0].tolist(), free[:, 1].tolist(), strict=True))
    if len(ahead) < len(free):
        raise GeometryError("the rim touches itself in a point", hint="widen it there")
    walk = [int(free[0, 0])]
    while (onward := ahead[walk[-1]]) != walk[0]:
        walk.append(onward)
    if len(walk) < len(free):
        raise GeometryError(
            "the surface has more than one rim", hint="close its holes, or cut a tube open"
        )
    edges = (len(sides) + len(free)) // 2
    if len(np.unique(cells)) - edges + len(cells) != 1:
        raise GeometryError("the surface has a handle and cannot be laid flat")
    return np.array(walk)


def same_turn(cells: IntArray) -> IntArray:
    """The cells, all turning as the first does. Raises GeometryError for a one-sided surface."""
    pairs = paired_facets(cells)[0]
    turns = np.where(_turn_alike(cells, pairs), 1.0, -1.0)
    n = len(cells)
    half = coo_array((turns, (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    joined = csr_array(half + half.T)
    order, before = breadth_first_order(joined, 0, directed=False)
    sign = np.ones(n)
    for cell in order[1:].tolist():
        came = before[cell]
        sign[cell] = sign[came] * joined[cell, came]
    if (sign[pairs[:, 0]] * sign[pairs[:, 1]] != turns).any():
        raise GeometryError(
            "the surface has one side only, as a Möbius strip has",
            hint="a Möbius strip has no front",
        )
    out = cells.copy()
    out[sign < 0] = out[sign < 0][:, ::-1]
    return out


def _turn_alike(cells: IntArray, pairs: IntArray) -> FloatArray:
    """(n_pairs,) whether two neighbours run along their common edge in opposite senses."""
    one, other = cells[pairs[:, 0]], cells[pairs[:, 1]]
    opposed = np.zeros(len(pairs), dtype=bool)
    for a, b in SIDES:
        for c, d in SIDES:
            opposed |= (one[:, a] == other[:, d]) & (one[:, b] == other[:, c])
    return opposed


def _on_disc(points: FloatArray, cells: IntArray, rim: IntArray) -> FloatArray:
    """Rim on a circle of the sheet's area, every other point amid its neighbours."""
    corner = points[cells]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    radius = math.sqrt(np.linalg.norm(normal, axis=1).sum() / (2 * math.pi))
    steps = np.linalg.norm(points[np.roll(rim, -1)] - points[rim], axis=1)
    angle = 2 * math.pi * (np.cumsum(steps) - steps) / steps.sum()
    flat = np.zeros((len(points), 2))
    flat[rim] = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    inner = np.setdiff1d(np.arange(len(points)), rim)
    if len(inner):
        pull = _laplacian(cells, np.ones((len(cells), 3)), len(points))[inner]
        flat[inner] = splu(csc_array(pull[:, inner])).solve(-(pull[:, rim] @ flat[rim]))
    return flat


def _laplacian(cells: IntArray, weight: FloatArray, n: int) -> csr_array:
    """(n, n) Σ over the sides of all cells of weight · (uᵢ − uⱼ)²; weight (n_cells, 3) by side."""
    start, end = (np.concatenate([cells[:, turn[k]] for turn in SIDES]) for k in (0, 1))
    w = weight.T.reshape(-1)
    rows = np.concatenate([start, end, start, end])
    columns = np.concatenate([start, end, end, start])
    return csr_array(coo_array((np.concatenate([w, w, -w, -w]), (rows, columns)), shape=(n, n)))


def _cotangents(shape: FloatArray) -> FloatArray:
    """(n_cells, 3): of the angle opposite to each side."""
    out = np.empty(shape.shape[:2])
    for side, (a, b) in enumerate(SIDES):
        tip = shape[:, 3 - a - b]
        one, other = shape[:, a] - tip, shape[:, b] - tip
        cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        out[:, side] = (one * other).sum(axis=1) / np.abs(cross)
    return out


def _rigid(shape: FloatArray, cells: IntArray, n: int) -> Callable[[FloatArray], FloatArray]:
    """One round: turn every triangle as it lies, then join them by least squares."""
    weight = _cotangents(shape)
    matrix = csc_array(_laplacian(cells, weight, n)[1:][:, 1:])  # the first point stands still
    factor = splu(matrix)
    own = np.stack([shape[:, b] - shape[:, a] for a, b in SIDES], axis=1)

    def turned(flat: FloatArray) -> FloatArray:
        lies = np.stack([flat[cells[:, b]] - flat[cells[:, a]] for a, b in SIDES], axis=1)
        both = np.einsum("ns,nsi,nsj->nij", weight, own, lies)
        c, s = both[:, 0, 0] + both[:, 1, 1], both[:, 0, 1] - both[:, 1, 0]
        size = np.maximum(np.hypot(c, s), np.finfo(float).tiny)
        turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], axis=1)
        pull = weight[:, :, None] * (own @ (turn / size[:, None, None]))
        load = np.zeros((n, 2))
        for side, (a, b) in enumerate(SIDES):
            np.add.at(load, cells[:, b], pull[:, side])
            np.subtract.at(load, cells[:, a], pull[:, side])
        moved = np.vstack([np.zeros((1, 2)), factor.solve(load[1:])])
        return np.asarray(moved + (flat - moved).mean(axis=0))

    return turned


def _plane_shapes(points: FloatArray, cells: IntArray) -> FloatArray:
    """(n_cells, 3, 2): each triangle in a plane of its own, turning counter-clockwise."""
    corner = points[cells]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.linalg.norm(first, axis=1)
    x = (first * second).sum(axis=1) / length
    y = np.linalg.norm(np.cross(first, second), axis=1) / length
    shape = np.zeros((len(cells), 3, 2))
    shape[:, 1, 0], shape[:, 2, 0], shape[:, 2, 1] = length, x, y
    return shape


def _doubled_area(corner: FloatArray) -> FloatArray:
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
