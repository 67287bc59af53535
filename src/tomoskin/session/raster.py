"""An image per cell → an image on a grid of square pixels, for tools that know no meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh import Mesh

_NEAR = 24
"""Cells by distance of their centre that are tried for a pixel."""


@dataclass(frozen=True, eq=False)
class Raster:
    """Which cell lies under each pixel of a flat mesh.

    ``cells`` (rows, columns), −1 outside the sheet, the first row at the lowest y;
    ``corner`` (x, y) of the lowest left pixel's outer corner and ``size`` of a pixel, m.
    """

    cells: IntArray
    corner: tuple[float, float]
    size: float

    @classmethod
    def of(cls, mesh: Mesh, columns: int = 48) -> Self:
        """Grid over the mesh, ``columns`` pixels along its longer side."""
        points = mesh.points[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        size = float((high - low).max()) / columns
        n_columns, n_rows = np.maximum(np.ceil((high - low) / size - 1e-9), 1).astype(int)
        x = low[0] + size * (np.arange(n_columns) + 0.5)
        y = low[1] + size * (np.arange(n_rows) + 0.5)
        centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        cells = _cell_under(centres, points[mesh.cells]).reshape(n_rows, n_columns)
        return cls(cells, (float(low[0]), float(low[1])), size)

    def __call__(self, values: FloatArray) -> FloatArray:
        """(rows, columns) of ``values`` (n_cells,); NaN outside the sheet."""
        return np.asarray(np.append(values, np.nan)[self.cells])


def _cell_under(places: FloatArray, corners: FloatArray) -> IntArray:
    """(n,) triangle of ``corners`` (m, 3, 2) that holds each place (n, 2), or −1."""
    found = np.full(len(places), -1, dtype=np.int64)
    near = min(_NEAR, len(corners))
    _, candidates = cKDTree(corners.mean(axis=1)).query(places, near)
    for column in candidates.reshape(len(places), near).T:
        inside = _is_inside(places, corners[column]) & (found < 0)
        found[inside] = column[inside]
    return found


def _is_inside(places: FloatArray, triangles: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether each place lies in its triangle (n, 3, 2), rim included."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    turns = np.stack([_turn(p, q, places) for p, q in ((a, b), (b, c), (c, a))])
    return np.asarray((turns >= 0).all(axis=0) | (turns <= 0).all(axis=0))


def _turn(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    along, across = q - p, r - p
    return np.asarray(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
