"""Which cell each pixel of a raster lies in."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, GeometryError, IntArray, PixelMap

MOST_PIXELS = 1 << 26
_EDGE = 1e-12
"""A barycentric coordinate this far below zero is rounding: the pixel lies on the edge."""


def pixel_map(
    points: FloatArray,
    cells: IntArray,
    mesh_id: str,
    *,
    step: float,
    height: float | None = None,
) -> PixelMap:
    """Square pixels of side ``step`` m over the extent in x and y, each with its cell.

    A pixel belongs to the cell that its centre lies in, on an edge to the one of lower number.
    Triangles lie in the plane; of tetrahedra the slice z = ``height`` m is taken.

    Raises
    ------
    GeometryError
        For a curved sheet, a height that is missing, not wanted or outside, or a step that is
        not above 0 or makes more than ``MOST_PIXELS`` pixels.
    """
    height = _checked_height(points, cells, height)
    x, y = _raster(points[np.unique(cells)][:, :2], step)
    corner = points[cells]
    touched = np.arange(len(cells))
    if height is not None:
        span = corner[:, :, 2]
        touched = np.flatnonzero((span.min(axis=1) <= height) & (span.max(axis=1) >= height))
        corner = corner[touched]
    cell, column, row = _candidates(corner[:, :, :2], x, y, step)
    position = np.column_stack([x[column], y[row]])
    if height is not None:
        position = np.column_stack([position, np.full(len(position), height)])
    inside = _inside(corner, cell, position)
    owner = np.full((len(y), len(x)), len(cells))
    np.minimum.at(owner, (row[inside], column[inside]), touched[cell[inside]])
    owner[owner == len(cells)] = -1
    return PixelMap(owner, x, y, mesh_id)


def step_for(points: FloatArray, cells: IntArray, count: int) -> float:
    """Side of a pixel, m, when ``count`` of them span the longer extent. Raises GeometryError."""
    if count < 1:
        raise GeometryError(f"expected at least 1 pixel, got {count}")
    return float(np.ptp(points[np.unique(cells)][:, :2], axis=0).max()) / count


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
    left = np.searchsorted(x, low[:, 0] - slack)
    right = np.searchsorted(x, high[:, 0] + slack, side="right")
    top = np.searchsorted(-y, -high[:, 1] - slack)
    bottom = np.searchsorted(-y, -low[:, 1] + slack, side="right")
    wide, tall = right - left, bottom - top
    cell = np.repeat(np.arange(len(corner)), wide * tall)
    first = np.repeat(np.cumsum(wide * tall) - wide * tall, wide * tall)
    down, across = np.divmod(np.arange(len(cell)) - first, np.maximum(wide, 1)[cell])
    return cell, left[cell] + across, top[cell] + down


def _inside(corner: FloatArray, cell: IntArray, position: FloatArray) -> NDArray[np.bool_]:
    """(n,) bool: whether ``position`` (n, d) lies in its ``cell``, by barycentric coordinates."""
    edges = (corner[:, 1:] - corner[:, :1]).swapaxes(1, 2)
    to_barycentric = np.linalg.inv(edges)
    share = np.einsum("nij,nj->ni", to_barycentric[cell], position - corner[cell, 0])
    return np.asarray((share >= -_EDGE).all(axis=1) & (share.sum(axis=1) <= 1 + _EDGE))
