"""A sheet that lies on a triangulated surface, as a scanner or a CAD program gives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.check import check_cells
from tomoskin.model.mesh.flatten import flattened, rim_of, same_turn
from tomoskin.model.mesh.mesh import MeshFile
from tomoskin.model.mesh.polygon import Polygon
from tomoskin.model.mesh.surface import Surface, rows_of
from tomoskin.model.mesh.triangles import barycentric, check_crossings, closest

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
            degenerate, one-sided, running through itself, closed, or with more than one rim.
        """
        x, table = np.asarray(points, dtype=np.float64), np.asarray(cells, dtype=np.int64)
        check_cells(x, table)
        if x.shape[1] != 3 or table.shape[1] != 3:
            raise GeometryError(
                f"expected triangles in space, got cells {table.shape} of points {x.shape}"
            )
        table = same_turn(table)
        check_crossings(x, table)
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
        try:
            return cls.of(file.places[used], compact.reshape(file.cells.shape))
        except GeometryError as error:
            raise error.within(file.source, GeometryError) from error

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
        share = closest(corner, xyz[:, None])
        gap = np.linalg.norm(np.einsum("nqk,nqkd->nqd", share, corner) - xyz[:, None], axis=2)
        best = gap.argmin(axis=1)
        rows = np.arange(len(xyz))
        chosen = self.flat[self.cells[near[rows, best]]]
        return np.einsum("nk,nkd->nd", share[rows, best], chosen), gap[rows, best]

    def _within(self, uv: FloatArray) -> tuple[IntArray, FloatArray]:
        """(n,) triangle that holds each point, or is nearest to holding it; (n, 3) shares."""
        k = min(_NEAREST, len(self.cells))
        near = self._tree.query(uv, k=k)[1].reshape(-1, k)
        share = barycentric(self.flat[self.cells[near]], uv[:, None])
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
