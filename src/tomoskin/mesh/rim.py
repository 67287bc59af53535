"""Where points stand against the rim's edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray
from tomoskin.mesh.boundary import Boundary
from tomoskin.mesh.polygon import inside

_MARGIN = 1.02
"""Circles are taken so much larger than they are."""


def rim_distance(rim: Boundary, xy: FloatArray) -> FloatArray:
    """(n,) distance to the rim edges that touch the three nearest nodes, m."""
    if not len(xy):
        return np.zeros(0)
    count = len(rim.points)
    _, node = cKDTree(rim.points).query(xy, k=3)
    edge = np.concatenate([node, (node - 1) % count], axis=1)
    step = np.roll(rim.points, -1, axis=0) - rim.points
    offset = xy[:, None] - rim.points[edge]
    along = (offset * step[edge]).sum(axis=2) / (step[edge] ** 2).sum(axis=2)
    foot = offset - np.clip(along, 0, 1)[:, :, None] * step[edge]
    return np.asarray(np.linalg.norm(foot, axis=2).min(axis=1))


def keeps_clear(rim: Boundary, xy: FloatArray) -> NDArray[np.bool_]:
    """(n,) True where a point is inside the rim and outside every edge's diametral circle."""
    if not len(xy):
        return np.zeros(0, dtype=bool)
    result = inside(rim.points, xy)
    held = cKDTree(xy).query_ball_point(rim.midpoints, rim.lengths / 2 * _MARGIN)
    result[np.concatenate(held).astype(np.int64)] = False
    return result
