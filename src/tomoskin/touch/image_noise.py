"""What measurement noise alone does to an image, and to the centroid of a region in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh import Mesh

_BAND = 0.2
"""Cells within this fraction of a region's lowest value count as its edge."""


@dataclass(frozen=True, eq=False)
class ImageNoise:
    """Measurement noise as it stands in the images of one mesh.

    ``spread`` (n_cells, k): spread · spreadᵀ is the image's covariance; ``sd`` (n_cells,) the
    square root of its diagonal; ``mesh_id`` names the mesh. Single precision is plenty for a
    deviation, and half to read.
    """

    spread: NDArray[np.float32]
    sd: FloatArray
    mesh_id: str

    @classmethod
    def of(cls, spread: FloatArray, mesh_id: str) -> Self:
        """Floor of that ``spread``: of an operator, its matrix times each row's deviation."""
        sd = np.sqrt(np.einsum("cm,cm->c", spread, spread))
        return cls(spread.astype(np.float32, order="C"), sd, mesh_id)  # rows are taken one by one

    def sd_of(self, cells: IntArray, lever: FloatArray) -> FloatArray:
        """Standard deviation, (k,), of Σ lever · image over ``cells`` (n,), ``lever`` (n, k)."""
        moved = lever.T.astype(np.float32) @ self.spread.take(cells, axis=0)
        return np.asarray(np.sqrt(np.einsum("km,km->k", moved, moved)), dtype=np.float64)


def centroid(mesh: Mesh, cells: IntArray, strength: FloatArray) -> FloatArray:
    """(2,) m, weighted by ``strength`` (n_cells of the mesh,) times area."""
    mass = strength[cells] * mesh.volumes[cells]
    return np.asarray(mass @ mesh.centroids[cells] / mass.sum())


def centroid_sd(
    mesh: Mesh, cells: IntArray, image: FloatArray, margin: float, floor: ImageNoise
) -> FloatArray:
    """(2,) m, to first order in the noise, for a region above a fraction of the extreme.

    A change of the image moves the centroid in two ways: by the weight of each cell, and by
    cells that cross the threshold as they or the extreme change. The second is an integral over
    the edge, taken here over a band of values around the region's lowest (coarea formula); it
    counts for most of the deviation. ``margin`` m: how far beyond the region the edge may lie.
    """
    strength = np.abs(image)
    top = int(strength.argmax())
    limit = float(image[cells[strength[cells].argmin()]])
    mass = image[cells] * mesh.volumes[cells]
    total = mass.sum()
    offset = mesh.centroids[cells]
    centre = mass @ offset / total
    offset -= centre
    reach = float(np.sqrt((offset**2).sum(axis=1).max())) + margin
    edge, edge_offset = _edge(mesh, image, limit, centre, reach)
    share = mesh.volumes[edge] * image[edge] / (2 * _BAND * limit)
    at_edge = edge_offset * share[:, None]
    of_top = -at_edge.sum(axis=0) * limit / image[top]
    lever = np.concatenate([offset * mesh.volumes[cells, None], at_edge, of_top[None]])
    return floor.sd_of(np.concatenate([cells, edge, [top]]), lever / total)


def _edge(
    mesh: Mesh, image: FloatArray, limit: float, centre: FloatArray, reach: float
) -> tuple[IntArray, FloatArray]:
    """Cells whose value is about ``limit`` within ``reach`` of the centre; their offsets."""
    ends = sorted((limit * (1 - _BAND), limit * (1 + _BAND)))
    cells = np.flatnonzero((image > ends[0]) & (image < ends[1]))
    offset = mesh.centroids[cells] - centre
    near = (offset**2).sum(axis=1) < reach**2
    return cells[near], offset[near]
