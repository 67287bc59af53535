"""Finding touches in an image, as the source does (section 4.4.2, figure 4.6).

Threshold Γ1 of the extreme, Gaussian filter, threshold Γ2 of Γ1, connected regions; then the
weighted centroid of each region, or its local maxima.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray, Reading
from tomoskin.mesh import Mesh
from tomoskin.skin import TouchSettings
from tomoskin.touch.floor import NoiseFloor

_REACH = 3.0
"""The Gaussian filter is cut off at this many standard deviations."""


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
        self._filter = _gaussian_filter(mesh, settings.smoothing)
        self._neighbours = mesh.neighbours.T.copy()

    def __call__(self, values: FloatArray, floor: NoiseFloor | None = None) -> list[Reading]:
        """Regions of an image ``values`` (n_cells,), strongest first.

        With a ``floor``, a region counts only where the image exceeds ``snr`` times its noise.
        """
        image = _of_sign(values, self.settings.sign)
        strength = np.abs(image)
        limit = self.settings.gamma1 * strength.max()
        if not limit > 0:
            return []
        filtered = self._filter @ np.where(strength >= limit, image, 0.0)
        kept = np.flatnonzero(np.abs(filtered) >= self.settings.gamma2 * limit)
        if floor is not None:
            significant = strength >= self.settings.snr * floor.sd
            if not significant[kept].any():
                return []
        regions = self._connected(kept, filtered > 0)
        if floor is not None:
            regions = [cells for cells in regions if significant[cells].any()]
        found = [self._reading(cells, image, floor) for cells in regions]
        found.sort(key=lambda reading: -abs(reading.peak))
        return found[: self.settings.max_touches]

    def _connected(self, kept: IntArray, positive: NDArray[np.bool_]) -> list[IntArray]:
        """Connected sets of the ``kept`` cells, joined over shared edges of the same sign."""
        if not len(kept):
            return []
        place = np.full(len(positive), -1)
        place[kept] = np.arange(len(kept))
        first, second = self._neighbours
        joined = (place[first] >= 0) & (place[second] >= 0) & (positive[first] == positive[second])
        ends = (place[first[joined]], place[second[joined]])
        graph = coo_array((np.ones(len(ends[0])), ends), shape=(len(kept), len(kept)))
        n, label = connected_components(graph, directed=False)
        order = np.argsort(label, kind="stable")
        return np.split(kept[order], np.searchsorted(label[order], np.arange(1, n)))

    def _reading(self, cells: IntArray, image: FloatArray, floor: NoiseFloor | None) -> Reading:
        volumes, weights = self.mesh.volumes[cells], image[cells]
        mass = np.abs(weights) * volumes
        centre = mass @ self.mesh.centroids[cells] / mass.sum()
        offset = self.mesh.centroids[cells] - centre
        sd = np.full(2, np.nan)
        if floor is not None:
            sd = floor.centroid_sd(cells, mass, offset * volumes[:, None])
        return Reading(
            x=float(centre[0]),
            y=float(centre[1]),
            sd_x=float(sd[0]),
            sd_y=float(sd[1]),
            area=float(volumes.sum()),
            peak=float(weights[np.argmax(np.abs(weights))]),
            cells=cells,
        )


def _of_sign(values: FloatArray, sign: str) -> FloatArray:
    if sign == "decrease":
        return np.minimum(values, 0.0)
    if sign == "increase":
        return np.maximum(values, 0.0)
    return values


def _gaussian_filter(mesh: Mesh, width: float) -> csr_array:
    """(n_cells, n_cells) area-weighted Gaussian average; rows sum to one."""
    tree = cKDTree(mesh.centroids)
    near = tree.sparse_distance_matrix(tree, _REACH * width, output_type="coo_matrix")
    weights = np.exp(-0.5 * (near.data / width) ** 2) * mesh.volumes[near.col]
    matrix = csr_array(coo_array((weights, (near.row, near.col)), shape=near.shape))
    scale = 1.0 / matrix.sum(axis=1)
    return csr_array(matrix.multiply(scale[:, None]))
