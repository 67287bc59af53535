"""A sheet that lies on a triangulated surface, as a scanner or a CAD program gives it, and how that
is laid flat: as little stretched as can be."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, GeometryError, IntArray, located
from tomoskin.model.mesh import triangles
from tomoskin.model.mesh.mesh import MeshFile
from tomoskin.model.mesh.overlap import check_overlaps
from tomoskin.model.mesh.polygon import Polygon
from tomoskin.model.mesh.surface import Surface, rows_of

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
    sides = np.concatenate([cells[:, turn] for turn in triangles.SIDES])
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
    pairs = triangles.paired_facets(cells)[0]
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
    for a, b in triangles.SIDES:
        for c, d in triangles.SIDES:
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
    start, end = (np.concatenate([cells[:, turn[k]] for turn in triangles.SIDES]) for k in (0, 1))
    w = weight.T.reshape(-1)
    rows = np.concatenate([start, end, start, end])
    columns = np.concatenate([start, end, end, start])
    return csr_array(coo_array((np.concatenate([w, w, -w, -w]), (rows, columns)), shape=(n, n)))


def _cotangents(shape: FloatArray) -> FloatArray:
    """(n_cells, 3): of the angle opposite to each side."""
    out = np.empty(shape.shape[:2])
    for side, (a, b) in enumerate(triangles.SIDES):
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
    own = np.stack([shape[:, b] - shape[:, a] for a, b in triangles.SIDES], axis=1)

    def turned(flat: FloatArray) -> FloatArray:
        lies = np.stack([flat[cells[:, b]] - flat[cells[:, a]] for a, b in triangles.SIDES], axis=1)
        both = np.einsum("ns,nsi,nsj->nij", weight, own, lies)
        c, s = both[:, 0, 0] + both[:, 1, 1], both[:, 0, 1] - both[:, 1, 0]
        size = np.maximum(np.hypot(c, s), np.finfo(float).tiny)
        turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], axis=1)
        pull = weight[:, :, None] * (own @ (turn / size[:, None, None]))
        load = np.zeros((n, 2))
        for side, (a, b) in enumerate(triangles.SIDES):
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


_NEAREST = 16
"""Triangles that are looked at for each point."""

_ON = 0.5
"""A point that is further off the surface than this many typical edges is not meant on it."""


@dataclass(frozen=True, eq=False)
class Draped(Surface):
    """The surface of a triangle mesh in one piece with one rim, and its flat coordinates.

    Attributes
    ----------
    points
        (n, 3) m.
    cells
        (n_cells, 3), turning counter-clockwise as seen from the front.
    flat
        (n, 2) m: the sheet's coordinates, from :func:`flattened`.
    """

    points: FloatArray
    cells: IntArray
    flat: FloatArray

    @classmethod
    def of(cls, points: ArrayLike, cells: ArrayLike) -> Self:
        """Lay the surface of ``points`` (n, 3) m and ``cells`` (n_cells, 3) flat.

        The front is where the first cell turns counter-clockwise. The flat coordinates are
        turned so that they look most like the surface seen from its front, z (or y, from above)
        upwards.

        Raises
        ------
        GeometryError
            Naming the cells: for a surface in pieces, with an edge in more than two triangles,
            degenerate, overlapping, one-sided, running through itself, closed, or with more than
            one rim.
        """
        x, table = np.asarray(points, dtype=np.float64), np.asarray(cells, dtype=np.int64)
        triangles.check_cells(x, table)
        if x.shape[1] != 3 or table.shape[1] != 3:
            raise GeometryError(
                f"expected triangles in space, got cells {table.shape} of points {x.shape}"
            )
        check_overlaps(x, table)
        table = same_turn(table)
        triangles.check_crossings(x, table)
        return cls(x, table, _upright(x, table, flattened(x, table)))

    @classmethod
    def read(cls, path: str | Path, *, scale: float = 1.0) -> Self:
        """Read a .stl, .obj, .ply or .dae file; its coordinates times ``scale`` are m.

        Raises
        ------
        GeometryError
            As :meth:`of`, and when the file cannot be read or seems to be in millimetres.
        """
        file = MeshFile.read(path, scale=scale)
        used, compact = np.unique(file.cells, return_inverse=True)
        with located(file.source, GeometryError):
            return cls.of(file.places[used], compact.reshape(file.cells.shape))

    @cached_property
    def outline(self) -> Polygon:
        """The rim in the sheet's coordinates."""
        return Polygon(self.flat[rim_of(self.cells)])

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        cell, share = self._within(rows_of(uv))
        return np.asarray(np.einsum("nk,nkd->nd", share, self.points[self.cells[cell]]))

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """(n, 3, 2), the same all over a triangle."""
        return np.asarray(self._slopes[self._within(rows_of(uv))[0]])

    def place(self, xyz: ArrayLike, names: Sequence[str] = ()) -> FloatArray:
        """(n, 2) m: flat coordinates of the surface's points nearest to ``xyz`` (n, 3) m.

        Raises
        ------
        GeometryError
            Naming the first position that does not lie on the surface; ``names`` has one for each.
        """
        wanted = np.atleast_2d(np.asarray(xyz, dtype=np.float64))
        if wanted.shape[1] != 3:
            raise GeometryError(f"expected positions of shape (n, 3), got shape {wanted.shape}")
        flat, gap = self._nearest(wanted)
        reach = _ON * float(np.median(self._edges))
        if (gap > reach).any():
            first = int(np.argmax(gap > reach))
            raise GeometryError(
                f"is {1e3 * gap[first]:.4g} mm away from the surface",
                where=names[first] if names else f"position {first}",
                hint="give positions in the coordinates and the unit of the surface's file",
            )
        return flat

    def _nearest(self, xyz: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat position and distance of the nearest point among those of the nearest triangles."""
        k = min(_NEAREST, len(self.cells))
        near = cKDTree(self.points[self.cells].mean(axis=1)).query(xyz, k=k)[1].reshape(-1, k)
        corner = self.points[self.cells[near]]
        share = triangles.closest(corner, xyz[:, None])
        gap = np.linalg.norm(np.einsum("nqk,nqkd->nqd", share, corner) - xyz[:, None], axis=2)
        best = gap.argmin(axis=1)
        rows = np.arange(len(xyz))
        chosen = self.flat[self.cells[near[rows, best]]]
        return np.einsum("nk,nkd->nd", share[rows, best], chosen), gap[rows, best]

    def _within(self, uv: FloatArray) -> tuple[IntArray, FloatArray]:
        """(n,) triangle that holds each point, or is nearest to holding it; (n, 3) shares."""
        k = min(_NEAREST, len(self.cells))
        near = self._tree.query(uv, k=k)[1].reshape(-1, k)
        share = triangles.barycentric(self.flat[self.cells[near]], uv[:, None])
        best = share.min(axis=2).argmax(axis=1)
        rows = np.arange(len(uv))
        return near[rows, best], share[rows, best]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.flat[self.cells].mean(axis=1))

    @cached_property
    def _slopes(self) -> FloatArray:
        flat, corner = self.flat[self.cells], self.points[self.cells]
        steps = flat[:, 1:] - flat[:, :1]
        rise = corner[:, 1:] - corner[:, :1]
        return np.asarray(np.linalg.solve(steps, rise).transpose(0, 2, 1))

    @cached_property
    def _edges(self) -> FloatArray:
        corner = self.points[self.cells]
        return np.asarray(np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2))


def _upright(points: FloatArray, cells: IntArray, flat: FloatArray) -> FloatArray:
    """``flat`` about its middle, turned so that it looks like the surface from its front."""
    corner = points[cells]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]).sum(axis=0)
    up = np.array([0.0, 1.0, 0.0]) if np.abs(normal).argmax() == 2 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    frontal = (points - points.mean(axis=0)) @ np.column_stack([right, np.cross(normal, right)])
    frontal[:, 1] /= np.linalg.norm(normal)
    middle = flat - flat.mean(axis=0)
    both = middle.T @ frontal
    angle = np.arctan2(both[0, 1] - both[1, 0], both[0, 0] + both[1, 1])
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(middle @ np.array([[c, s], [-s, c]]))
