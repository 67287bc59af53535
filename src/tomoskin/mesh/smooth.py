"""Delaunay triangles inside a rim, and the smoothing that makes them regular."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import Delaunay

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh.boundary import Boundary
from tomoskin.mesh.polygon import inside
from tomoskin.mesh.rim import keeps_clear
from tomoskin.mesh.sizing import SizeField
from tomoskin.mesh.topology import simplex_measure

ROUNDS = 8
"""Rounds of smoothing."""

MENDS = (2, 4)
"""Rounds before which points with too few or too many neighbours are mended."""


def triangles(rim: Boundary, inner: FloatArray) -> IntArray:
    """(n, 3) Delaunay triangles, counter-clockwise, of the rim's nodes and then ``inner``."""
    points = np.concatenate([rim.points, inner])
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    scaled = (points - middle) / np.ptp(points, axis=0).max()
    cells = Delaunay(scaled).simplices.astype(np.int64)
    a, b, c = (scaled[cells[:, i]] for i in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    cells[twice < 0] = cells[twice < 0][:, [0, 2, 1]]
    count = len(rim.points)
    keep = np.abs(twice) > 1e-13
    doubtful = np.flatnonzero(keep & (cells < count).all(axis=1))
    keep[doubtful] = inside(rim.points, points[cells[doubtful]].mean(axis=1))
    return np.asarray(cells[keep])


def smoothed(rim: Boundary, inner: FloatArray, field: SizeField) -> FloatArray:
    """Move ``inner`` (n, 2) to the weighted mean of the circumcentres around each point.

    The weights are area/size², after L. Chen and M. Holst, "Efficient mesh optimization
    schemes based on optimal Delaunay triangulations", CMAME 200 (2011) 967-984.
    """
    for number in range(ROUNDS):
        cells = triangles(rim, inner)
        if number in MENDS:
            inner = _mended(rim, inner, cells, field)
            cells = triangles(rim, inner)
        moved = _means(np.concatenate([rim.points, inner]), cells, field)[len(rim.points) :]
        inner = np.where(keeps_clear(rim, moved)[:, None], moved, inner)
    return inner


def _mended(rim: Boundary, inner: FloatArray, cells: IntArray, field: SizeField) -> FloatArray:
    """Without points of four neighbours or fewer; with one more beside those of eight or more."""
    points, first = np.concatenate([rim.points, inner]), len(rim.points)
    degree = np.bincount(cells.ravel(), minlength=len(points))
    few, many = degree <= 4, degree >= 8
    few[:first] = many[:first] = False
    sides = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    both = few[sides].all(axis=1)
    few[sides[both].max(axis=1)] = False  # of two neighbours only one goes
    middle = points[cells].mean(axis=1)
    size = simplex_measure(points, cells) / field(middle) ** 2
    corner, owner = cells.ravel(), np.repeat(np.arange(len(cells)), 3)
    order = np.lexsort((size[owner], corner))
    last = np.flatnonzero(np.append(np.diff(corner[order]) != 0, True))
    largest = owner[order[last]]  # for each point, the triangle that is largest for its place
    added = middle[np.unique(largest[many])]
    return np.concatenate([inner[~few[first:]], added[keeps_clear(rim, added)]])


def _means(points: FloatArray, cells: IntArray, field: SizeField) -> FloatArray:
    """(n_points, 2) weighted mean of the circumcentres of the triangles around each point."""
    a, b, c = (points[cells[:, i]] for i in range(3))
    u, v = b - a, c - a
    twice = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    uu, vv = (u**2).sum(axis=1), (v**2).sum(axis=1)
    offset = np.column_stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu])
    centroid = (a + b + c) / 3
    centre = (a + offset / (2 * twice[:, None]) + centroid) / 2
    weight = twice / field(centroid) ** 2
    moment = np.column_stack([weight[:, None] * centre, weight])
    around = coo_array(
        (np.ones(cells.size), (cells.ravel(), np.repeat(np.arange(len(cells)), 3))),
        shape=(len(points), len(cells)),
    ).tocsr()
    total = np.asarray(around @ moment)
    return np.asarray(total[:, :2] / total[:, 2:])
