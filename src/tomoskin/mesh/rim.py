"""Where points stand against the rim's edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray
from tomoskin.mesh.boundary import Boundary


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
    """(n,) True where a point is outside every rim edge's diametral circle.

    The nearest few circle centres suffice: edges are graded, so a circle that reaches over
    several nearer ones would hold their nodes too, which :func:`discretise` rules out.
    """
    middle, radius = rim.midpoints, rim.lengths / 2
    gap, edge = cKDTree(middle).query(xy, k=min(6, len(middle)))
    return np.asarray((gap > radius[edge] * 1.02).all(axis=1))
