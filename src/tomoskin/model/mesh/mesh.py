"""The mesh, immutable: cells with electrode facets, their measures and neighbours; the pixels of a
raster over it; and what a file of one holds."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tomoskin.core import FloatArray, GeometryError, IntArray, PixelMap, located, numeric
from tomoskin.model.mesh import files
from tomoskin.model.mesh.overlap import check_overlaps
from tomoskin.model.mesh.triangles import (
    boundary_facets,
    check_mesh,
    checked_metric,
    owners,
    paired_facets,
    simplex_measure,
)

MOST_PIXELS = 1 << 26
_EDGE = 1e-12
"""A barycentric coordinate this far below zero is rounding: the pixel lies on the edge."""


def _checked_height(points: FloatArray, cells: IntArray, height: float | None) -> float | None:
    flat = cells.shape[1] == 3
    if flat and points.shape[1] == 3:
        raise GeometryError(
            "a curved sheet has no pixels in the plane", hint="draw its cells, or flatten it first"
        )
    if flat and height is not None:
        raise GeometryError(f"expected no height for a sheet in the plane, got {height:g} m")
    if flat:
        return None
    low, high = points[:, 2].min(), points[:, 2].max()
    if height is None:
        raise GeometryError(
            "expected the height of a slice through the volume, got none", hint="pass z, in m"
        )
    if not low <= height <= high:
        raise GeometryError(f"expected a height from {low:g} to {high:g} m, got {height:g} m")
    return height


def _raster(points: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Centres of the columns from left to right and of the rows from top to bottom."""
    low, high = points.min(axis=0), points.max(axis=0)
    if not (math.isfinite(step) and step > 0):
        raise GeometryError(f"expected a pixel size above 0 m, got {step:g} m")
    exact = (high - low) / step
    if exact[0] * exact[1] > MOST_PIXELS:
        raise GeometryError(f"pixels of {step:g} m would be more than {MOST_PIXELS} pixels in all")
    n = np.maximum(1, np.ceil(exact - 1e-9)).astype(int)
    start = (low + high) / 2 - step * (n - 1) / 2
    x, y = (start[axis] + step * np.arange(n[axis]) for axis in (0, 1))
    return x, y[::-1].copy()


def _candidates(
    corner: FloatArray, x: FloatArray, y: FloatArray, step: float
) -> tuple[IntArray, IntArray, IntArray]:
    """Cell, column and row of every pixel in the box around each cell."""
    low, high = corner.min(axis=1), corner.max(axis=1)
    slack = 1e-9 * step
    first_column = np.searchsorted(x, low[:, 0] - slack)
    right = np.searchsorted(x, high[:, 0] + slack, side="right")
    top = np.searchsorted(-y, -high[:, 1] - slack)
    bottom = np.searchsorted(-y, -low[:, 1] + slack, side="right")
    wide, tall = right - first_column, bottom - top
    cell = np.repeat(np.arange(len(corner)), wide * tall)
    first = np.repeat(np.cumsum(wide * tall) - wide * tall, wide * tall)
    down, across = np.divmod(np.arange(len(cell)) - first, np.maximum(wide, 1)[cell])
    return cell, first_column[cell] + across, top[cell] + down


def _inside(corner: FloatArray, cell: IntArray, position: FloatArray) -> NDArray[np.bool_]:
    """(n,) bool: whether ``position`` (n, d) lies in its ``cell``, by barycentric coordinates."""
    edges = (corner[:, 1:] - corner[:, :1]).swapaxes(1, 2)
    to_barycentric = np.linalg.inv(edges)
    share = np.einsum("nij,nj->ni", to_barycentric[cell], position - corner[cell, 0])
    return np.asarray((share >= -_EDGE).all(axis=1) & (share.sum(axis=1) <= 1 + _EDGE))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Simplices with electrodes on their boundary.

    Attributes
    ----------
    points
        (n_points, d) m; one more coordinate than the cells' dimension is a curved sheet.
    cells
        (n_cells, k) point indices: 3 a triangle, 4 a tetrahedron; orientation is free.
    electrodes
        One (n_facets, k − 1) array of point indices per electrode.
    metric
        (n_cells, 2, 2) of a flat sheet that is laid on a surface or stretched: a step dx in the
        points' plane is sqrt(dx·G·dx) m long on the sheet. None: as long as it looks.

    Raises
    ------
    GeometryError
        For tables that are no numbers, indices that do not exist, a degenerate cell, a facet in
        more than two cells, an electrode without a facet, an electrode's facet that is not on
        the boundary or belongs to another one too, a mesh in pieces, or a metric that is none.
    """

    points: FloatArray
    cells: IntArray
    electrodes: tuple[IntArray, ...]
    metric: FloatArray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        object.__setattr__(self, "points", _frozen(self.points, np.float64, "points"))
        object.__setattr__(self, "cells", _frozen(self.cells, np.int64, "cells"))
        facets = tuple(_frozen(e, np.int64, f"E{i}") for i, e in enumerate(self.electrodes, 1))
        object.__setattr__(self, "electrodes", facets)
        check_mesh(self.points, self.cells, self.electrodes)
        if self.metric is not None:
            object.__setattr__(self, "metric", checked_metric(self.metric, self.points, self.cells))

    def with_metric(self, metric: FloatArray) -> Mesh:
        """The same mesh measured otherwise, (n_cells, d, d): nothing else is checked again."""
        made = object.__new__(Mesh)
        for field in fields(self):
            object.__setattr__(made, field.name, getattr(self, field.name))
        object.__setattr__(made, "metric", checked_metric(metric, self.points, self.cells))
        return made

    @classmethod
    def read(
        cls, path: str | Path, electrodes: files.Electrodes = None, *, scale: float = 1.0
    ) -> Mesh:
        """Read a .msh, .vtu, .stl or .obj file.

        See :class:`MeshFile` for what is read and :data:`Electrodes` for the choice.

        Raises
        ------
        GeometryError
            When meshio is not installed, the file cannot be read or holds no usable cells, it
            seems to be in millimetres, cells overlap, or an electrode has no facet.
        """
        return MeshFile.read(path, scale=scale).mesh(electrodes)

    @property
    def dimension(self) -> int:
        """Dimension of the cells: 2 for triangles, 3 for tetrahedra."""
        return int(self.cells.shape[1]) - 1

    @cached_property
    def volumes(self) -> FloatArray:
        """(n_cells,) area of each triangle, m², or volume of each tetrahedron, m³."""
        flat = simplex_measure(self.points, self.cells)
        return flat if self.metric is None else flat * np.sqrt(np.linalg.det(self.metric))

    @cached_property
    def corners(self) -> FloatArray:
        """(n_cells, k, d) m: each cell's corners with its true lengths and angles.

        With a metric, in a frame of the cell's own, whose first axis is the direction of x.
        """
        corner = self.points[self.cells]
        if self.metric is None:
            return np.asarray(corner)
        return np.asarray((corner - corner[:, :1]) @ np.linalg.cholesky(self.metric))

    def facet_sizes(self, facets: IntArray) -> FloatArray:
        """(n,) length, m, or area, m², of facets (n, k − 1) on the boundary."""
        if self.metric is None:
            return simplex_measure(self.points, facets)
        along = self.points[facets[:, 1]] - self.points[facets[:, 0]]
        squared = np.einsum("ni,nij,nj->n", along, self.metric[owners(self.cells, facets)], along)
        return np.asarray(np.sqrt(squared))

    @cached_property
    def centroids(self) -> FloatArray:
        """Middles (n_cells, d) m of the cells."""
        return np.asarray(self.points[self.cells].mean(axis=1))

    @cached_property
    def neighbours(self) -> IntArray:
        """(n_pairs, 2) cells that share a facet, each pair once."""
        return paired_facets(self.cells)[0]

    @cached_property
    def boundary(self) -> IntArray:
        """(n_facets, k − 1) facets that belong to one cell only."""
        return boundary_facets(self.cells)

    @cached_property
    def identity(self) -> str:
        """Short hash of points, cells and electrodes: images and operators are matched by it."""
        digest = hashlib.sha256()
        stretched = () if self.metric is None else (self.metric,)
        for array in (self.points, self.cells, *self.electrodes, *stretched):
            digest.update(str(array.shape).encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()[:16]

    def pixels(
        self, count: int = 64, *, step: float | None = None, z: float | None = None
    ) -> PixelMap:
        """Raster of square pixels: ``count`` along the longer side, or of side ``step`` m.

        A pixel belongs to the cell that its centre lies in, on an edge to the one of lower number.
        Of tetrahedra it is the slice at height ``z`` m.

        Raises
        ------
        GeometryError
            For a curved sheet, a height that is missing, not wanted or outside, or a size that is
            not above 0 or makes more than ``MOST_PIXELS`` pixels.
        """
        cells = self.cells
        if step is None and count < 1:
            raise GeometryError(f"expected at least 1 pixel, got {count}")
        height, used = _checked_height(self.points, cells, z), self.points[np.unique(cells)][:, :2]
        side = float(np.ptp(used, axis=0).max()) / count if step is None else step
        x, y = _raster(used, side)
        corner, touched = self.points[cells], np.arange(len(cells))
        if height is not None:
            span = corner[:, :, 2]
            touched = np.flatnonzero((span.min(axis=1) <= height) & (span.max(axis=1) >= height))
            corner = corner[touched]
        cell, column, row = _candidates(corner[:, :, :2], x, y, side)
        position = np.column_stack([x[column], y[row]])
        if height is not None:
            position = np.column_stack([position, np.full(len(position), height)])
        inside = _inside(corner, cell, position)
        owner = np.full((len(y), len(x)), len(cells))
        np.minimum.at(owner, (row[inside], column[inside]), touched[cell[inside]])
        owner[owner == len(cells)] = -1
        return PixelMap(owner, x, y, self.identity)


@dataclass(frozen=True, eq=False)
class MeshFile:
    """What a mesh file holds.

    Triangles all in one plane z = const lose that coordinate. Points that belong to no cell are
    dropped when the mesh is made.

    Attributes
    ----------
    points
        (n, d) m.
    cells
        (n_cells, k) triangles or tetrahedra.
    groups
        Name → (n, k − 1) facets: gmsh's physical groups, cell sets, and numbers in cell data
        named "electrode".
    source
        The path, for messages.
    height
        m, the coordinate that a flat mesh has lost.
    """

    points: FloatArray
    cells: IntArray
    groups: dict[str, IntArray]
    source: str
    height: float = 0.0

    @classmethod
    def read(cls, path: str | Path, *, scale: float = 1.0) -> Self:
        """Read ``path``; its coordinates times ``scale`` are m. Raises GeometryError."""
        file = Path(path)
        raw = files.parsed(file)
        with located(str(file), GeometryError):
            cells = files.cells_of(raw)
            points, height = files.points_of(raw, cells, scale)
            groups = files.groups_of(raw, cells.shape[1] - 1)
        return cls(points, cells, groups, str(file), height)

    @property
    def places(self) -> FloatArray:
        """(n, 3) m: the points in space, where the file has them."""
        spare = np.full((len(self.points), 3 - self.points.shape[1]), self.height)
        return np.hstack((self.points, spare))

    def mesh(self, electrodes: files.Electrodes = None) -> Mesh:
        """Return the mesh with those electrodes. Raises GeometryError."""
        with located(self.source, GeometryError):
            facets = files.choose(self.points, self.cells, self.groups, electrodes)
            used, compact = np.unique(self.cells, return_inverse=True)
            number = np.full(len(self.points), -1)
            number[used] = np.arange(len(used))
            tables = [files.renumbered(number, f, f"E{i}") for i, f in enumerate(facets, 1)]
            mesh = Mesh(self.points[used], compact.reshape(self.cells.shape), tuple(tables))
            check_overlaps(mesh.points, mesh.cells)
            return mesh


def _frozen(value: object, dtype: DTypeLike, where: str) -> NDArray[Any]:
    raw = numeric(value, GeometryError, where=where, real=True)
    if raw.ndim != 2:
        raise GeometryError(f"expected a table with two axes, got shape {raw.shape}", where=where)
    with np.errstate(invalid="ignore"):
        array = raw.astype(dtype)
    if array.dtype.kind == "i" and not np.array_equal(array, raw):
        raise GeometryError("expected whole numbers, got fractions", where=where)
    array.flags.writeable = False
    return array
