"""Image → detections: regions that stand out of the noise of the image."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tomoskin.core import DataError, Detection, FloatArray, Image, IntArray
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import TouchSettings
from tomoskin.sensing.track import HELD

REACH = 2.0
"""It is cut off at this many standard deviations."""

_NO_WIDTH = 1e-9
"""A filter of width zero, m: reaches no other cell."""


class Blur:
    """Area-weighted Gaussian average of values per cell, prepared once per mesh.

    Parameters
    ----------
    mesh
        A flat mesh of triangles.
    width
        Standard deviation, m.
    """

    def __init__(self, mesh: Mesh, width: float) -> None:
        width, tree = max(width, _NO_WIDTH), cKDTree(mesh.centroids)
        near = tree.sparse_distance_matrix(tree, REACH * width, output_type="coo_matrix")
        weights = np.exp(-0.5 * (near.data / width) ** 2) * mesh.volumes[near.col]
        weights /= np.bincount(near.row, weights)[near.row]
        # in single precision: all of it is read for each frame
        at = (near.row, near.col)
        self._spread = csr_array(coo_array((weights.astype(np.float32), at), shape=near.shape))

    def __call__(self, values: FloatArray) -> FloatArray:
        """(n_cells,) averages of ``values`` (n_cells,), in single precision: they are only
        thresholded."""
        return np.asarray(self._spread @ values.astype(np.float32))


def neighbour_table(mesh: Mesh) -> IntArray:
    """(n_cells, k) cells that share a facet with each cell; −1 where there are fewer."""
    first, second = mesh.neighbours.T
    cell, other = np.concatenate([first, second]), np.concatenate([second, first])
    order = np.argsort(cell, kind="stable")
    cell, other = cell[order], other[order]
    count = np.bincount(cell, minlength=len(mesh.cells))
    column = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    table = np.full((len(mesh.cells), mesh.cells.shape[1]), -1)
    table[cell, column] = other
    return table


def connected(kept: IntArray, positive: NDArray[np.bool_], neighbours: IntArray) -> IntArray:
    """(n_kept,) label of each of the ``kept`` cells; equal where they are connected.

    Two neighbours are connected when both are kept and have the same sign (``positive``, per
    cell of the mesh).
    """
    n = len(kept)
    number = np.full(len(neighbours) + 1, n)
    number[kept] = np.arange(n)
    cell, other = np.repeat(kept, neighbours.shape[1]), neighbours[kept].ravel()
    joined = (number[other] < n) & (positive[other] == positive[cell])
    pairs = number[cell[joined]], number[other[joined]]
    graph = coo_array((np.ones(len(pairs[0])), pairs), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1])


_BAND = 0.2
"""Cells within this fraction of a region's lowest value count as its edge."""

_BIAS = 0.2
"""Deviation, in radii of a region, of its centre from the touch without any noise: an image
blurs otherwise near the rim. Chosen on the twin's seeds 101 to 103."""


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


class Segmenter:
    """Prepared once per mesh; finds the regions of one image at a time.

    Parameters
    ----------
    mesh
        A flat mesh of triangles; images are per cell of it.
    settings
        Γ1, Γ2, the filter's standard deviation (m), the sign that counts, the signal-to-noise
        ratio below which nothing is a touch, the largest number of touches.
    """

    def __init__(self, mesh: Mesh, settings: TouchSettings) -> None:
        self.mesh = mesh
        self.settings = settings
        self._filter = Blur(mesh, settings.smoothing)
        self._neighbours = neighbour_table(mesh)

    def __call__(self, image: Image, floor: ImageNoise | None = None) -> list[Detection]:
        """Regions of ``image``, strongest first.

        With a ``floor``, a region counts where the image exceeds ``snr`` times its noise. Down to
        :data:`HELD` of that it is called weak, as is what others outshine: enough for a touch
        to go on, if not to begin.

        Raises
        ------
        DataError
            When image or floor are of another mesh.
        """
        self._accept("image", image.mesh_id)
        if floor is not None:
            self._accept("noise floor", floor.mesh_id)
        values = _of_sign(image.values, self.settings.sign)
        strength = np.abs(values)
        limit = self.settings.gamma1 * strength.max()
        if not limit > 0:
            return []
        filtered = self._filter(np.where(strength >= limit, values, 0.0))
        kept = np.flatnonzero(np.abs(filtered) >= self.settings.gamma2 * limit)
        significant = _significant(kept, strength, floor, HELD * self.settings.snr)
        if not significant.any():
            return []
        label = connected(kept, filtered > 0, self._neighbours)
        regions = [kept[label == number] for number in np.unique(label[significant])]
        if self.settings.position == "peak":
            detections = [
                r for cells in regions for r in self._extremes(cells, values, filtered, floor)
            ]
        else:
            detections = [self._centroid(cells, values, floor) for cells in regions]
        detections.sort(key=lambda detection: -abs(detection.peak))
        detections = detections[: self.settings.max_touches]
        if floor is None or self.settings.position == "peak":
            return detections
        return [*detections, *self._weaker(regions, values, floor)][: self.settings.max_touches]

    def _weaker(
        self, regions: list[IntArray], image: FloatArray, floor: ImageNoise
    ) -> list[Detection]:
        """Maxima of the filtered image outside all regions, down to HELD · Γ1 of the extreme.

        A touch that another one outshines is not lost by that: these may carry it on.
        """
        height = np.append(np.abs(self._filter(image)), -1.0)
        free = height >= HELD * self.settings.gamma1 * height.max()
        free[:-1] &= height[:-1] >= HELD * self.settings.snr * floor.sd
        for cells in regions:
            free[cells] = False
            free[self._neighbours[cells]] = False
        tops = np.flatnonzero(free)
        tops = tops[height[tops] > height[self._neighbours[tops]].max(axis=1)]
        return [
            replace(self._centroid(self._around(top, height), image, floor), weak=True)
            for top in tops[np.argsort(-height[tops])]
        ]

    def _around(self, top: int, height: FloatArray) -> IntArray:
        """Cells near a maximum that are nearly as high."""
        away = self.mesh.centroids - self.mesh.centroids[top]
        near = np.flatnonzero((away**2).sum(axis=1) <= (REACH * self.settings.smoothing) ** 2)
        return np.asarray(near[height[near] >= self.settings.gamma2 * height[top]])

    def _accept(self, what: str, mesh_id: str) -> None:
        if mesh_id != self.mesh.identity:
            raise DataError(
                f"expected the {what} of mesh {self.mesh.identity}, got one of mesh {mesh_id}",
                hint="make the segmenter from the mesh that the image was made on",
            )

    def _centroid(self, cells: IntArray, image: FloatArray, floor: ImageNoise | None) -> Detection:
        weights = image[cells]
        centre = centroid(self.mesh, cells, np.abs(image))
        sd = np.full(2, np.nan)
        if floor is not None:
            margin = REACH * self.settings.smoothing
            sd = centroid_sd(self.mesh, cells, image, margin, floor)
        region = self._region(cells, image, floor)
        return replace(
            region,
            x=float(centre[0]),
            y=float(centre[1]),
            sd_x=float(sd[0]),
            sd_y=float(sd[1]),
            peak=float(weights[np.argmax(np.abs(weights))]),
            bias=_BIAS * math.sqrt(region.area / math.pi),
        )

    def _region(self, cells: IntArray, image: FloatArray, floor: ImageNoise | None) -> Detection:
        """A detection of ``cells`` whose position is not known yet."""
        none, snr = math.nan, _snr(cells, image, floor)
        area, weak = float(self.mesh.volumes[cells].sum()), snr < self.settings.snr
        return Detection(none, none, none, none, area, none, cells, snr=snr, weak=weak)

    def _extremes(
        self, cells: IntArray, image: FloatArray, filtered: FloatArray, floor: ImageNoise | None
    ) -> list[Detection]:
        """One detection at each cell where the filtered image exceeds all its neighbours'.

        A level region has no such cell; its first highest one counts.
        """
        height = np.append(np.abs(filtered), -1.0)  # the last is for "no neighbour"
        above = height[cells] > height[self._neighbours[cells]].max(axis=1)
        above[np.argmax(height[cells])] = True
        region, at = self._region(cells, image, floor), self.mesh.centroids
        return [
            replace(region, x=float(at[top, 0]), y=float(at[top, 1]), peak=float(image[top]))
            for top in cells[above]
        ]


def _of_sign(values: FloatArray, sign: str) -> FloatArray:
    if sign == "decrease":
        return np.minimum(values, 0.0)
    if sign == "increase":
        return np.maximum(values, 0.0)
    return values


def _significant(
    kept: IntArray, strength: FloatArray, floor: ImageNoise | None, snr: float
) -> NDArray[np.bool_]:
    if floor is None:
        return np.ones(len(kept), dtype=bool)
    return np.asarray(strength[kept] >= snr * floor.sd[kept])


def _snr(cells: IntArray, image: FloatArray, floor: ImageNoise | None) -> float:
    """How many times its noise the image of ``cells`` is at most; NaN without a floor."""
    if floor is None:
        return float("nan")
    with np.errstate(divide="ignore"):
        return float((np.abs(image[cells]) / floor.sd[cells]).max())
