"""How much of each cell lies within a distance of a place."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh import Mesh

_PER_EDGE = 4


class Balls:
    """Discs on a sheet, or balls in a volume, as shares of the cells of ``mesh``.

    Each cell stands for points of equal weight (10 in a triangle, 20 in a tetrahedron).
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        share = _lattice(mesh.dimension)
        self._points_per_cell = len(share)
        self._points = np.einsum("qk,ckd->cqd", share, mesh.points[mesh.cells])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._points.reshape(-1, self._points.shape[2]))

    def each(self, places: FloatArray, radius: float) -> Iterator[tuple[IntArray, FloatArray]]:
        """Cells (k,) and their share (k,) within ``radius`` m of each place, (n, d)."""
        for found in self._tree.query_ball_point(places, radius):
            cells, count = np.unique(
                np.asarray(found, dtype=np.int64) // self._points_per_cell, return_counts=True
            )
            yield cells, count / self._points_per_cell

    def share(self, place: FloatArray, radius: float) -> FloatArray:
        """(n_cells,) share of each cell within ``radius`` m of ``place`` (d,)."""
        within = np.einsum("cqd,cqd->cq", *(2 * [self._points - place])) <= radius**2
        return np.asarray(within.mean(axis=1))


@lru_cache
def _lattice(dimension: int) -> FloatArray:
    """(q, dimension + 1) barycentric coordinates, evenly spread and off the edges."""
    steps = [s for s in product(range(_PER_EDGE), repeat=dimension) if sum(s) < _PER_EDGE]
    table = np.array([[*s, _PER_EDGE - 1 - sum(s)] for s in steps], dtype=np.float64)
    return np.asarray((table + 1.0 / (dimension + 1)) / _PER_EDGE)
