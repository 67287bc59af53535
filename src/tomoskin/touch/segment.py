"""Finding touches in an image, as the source does (section 4.4.2, figure 4.6).

Threshold Γ1 of the extreme, Gaussian filter, threshold Γ2 of Γ1, connected regions; then the
weighted centroid of each region, or its local maxima.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray, Reading
from tomoskin.mesh import Mesh
from tomoskin.skin import TouchSettings
from tomoskin.touch.centroid import centroid, centroid_sd
from tomoskin.touch.connect import connected, neighbour_table
from tomoskin.touch.floor import NoiseFloor

_REACH = 3.0
"""The Gaussian filter is cut off at this many standard deviations."""

_NO_WIDTH = 1e-9
"""A filter of width zero, m: reaches no other cell."""


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
        self._near, self._weights = _gaussian_table(mesh, settings.smoothing)
        self._neighbours = neighbour_table(mesh)

    def __call__(self, values: FloatArray, floor: NoiseFloor | None = None) -> list[Reading]:
        """Regions of an image ``values`` (n_cells,), strongest first.

        With a ``floor``, a region counts only where the image exceeds ``snr`` times its noise.
        """
        image = _of_sign(values, self.settings.sign)
        strength = np.abs(image)
        limit = self.settings.gamma1 * strength.max()
        if not limit > 0:
            return []
        filtered = self._filtered(np.flatnonzero(strength >= limit), image)
        kept = np.flatnonzero(np.abs(filtered) >= self.settings.gamma2 * limit)
        significant = _significant(kept, strength, floor, self.settings.snr)
        if not significant.any():
            return []
        label = connected(kept, filtered > 0, self._neighbours)
        regions = [kept[label == number] for number in np.unique(label[significant])]
        if self.settings.position == "peak":
            found = [r for cells in regions for r in self._extremes(cells, image, filtered)]
        else:
            found = [self._centroid(cells, image, floor) for cells in regions]
        found.sort(key=lambda reading: -abs(reading.peak))
        return found[: self.settings.max_touches]

    def _filtered(self, active: IntArray, image: FloatArray) -> FloatArray:
        """(n_cells,) Gaussian average of the image where it is ``active``, zero elsewhere."""
        spread = self._weights[active] * image[active, None]
        near = self._near[active]
        return np.asarray(np.bincount(near.ravel(), spread.ravel(), minlength=len(image)), float)

    def _centroid(self, cells: IntArray, image: FloatArray, floor: NoiseFloor | None) -> Reading:
        weights = image[cells]
        centre = centroid(self.mesh, cells, np.abs(image))
        sd = np.full(2, np.nan)
        if floor is not None:
            margin = _REACH * self.settings.smoothing
            sd = centroid_sd(self.mesh, cells, image, margin, floor)
        return Reading(
            x=float(centre[0]),
            y=float(centre[1]),
            sd_x=float(sd[0]),
            sd_y=float(sd[1]),
            area=float(self.mesh.volumes[cells].sum()),
            peak=float(weights[np.argmax(np.abs(weights))]),
            cells=cells,
        )

    def _extremes(self, cells: IntArray, image: FloatArray, filtered: FloatArray) -> list[Reading]:
        """One reading at each cell where the filtered image exceeds all its neighbours'.

        A level region has no such cell; its first highest one stands for it.
        """
        height = np.append(np.abs(filtered), -1.0)  # the last stands for "no neighbour"
        above = height[cells] > height[self._neighbours[cells]].max(axis=1)
        above[np.argmax(height[cells])] = True
        area = float(self.mesh.volumes[cells].sum())
        return [
            Reading(
                x=float(self.mesh.centroids[top, 0]),
                y=float(self.mesh.centroids[top, 1]),
                sd_x=float("nan"),
                sd_y=float("nan"),
                area=area,
                peak=float(image[top]),
                cells=cells,
            )
            for top in cells[above]
        ]


def _of_sign(values: FloatArray, sign: str) -> FloatArray:
    if sign == "decrease":
        return np.minimum(values, 0.0)
    if sign == "increase":
        return np.maximum(values, 0.0)
    return values


def _significant(
    kept: IntArray, strength: FloatArray, floor: NoiseFloor | None, snr: float
) -> NDArray[np.bool_]:
    if floor is None:
        return np.ones(len(kept), dtype=bool)
    return np.asarray(strength[kept] >= snr * floor.sd[kept])


def _gaussian_table(mesh: Mesh, width: float) -> tuple[IntArray, FloatArray]:
    """Area-weighted Gaussian average as two (n_cells, n_near) tables.

    Row c lists the cells whose average cell c enters, and with what weight; short rows are
    padded with weight zero. The weights that enter one average sum to one.
    """
    width = max(width, _NO_WIDTH)
    tree = cKDTree(mesh.centroids)
    near = tree.sparse_distance_matrix(tree, _REACH * width, output_type="coo_matrix")
    n = len(mesh.centroids)
    weights = np.exp(-0.5 * (near.data / width) ** 2) * mesh.volumes[near.row]
    weights /= np.bincount(near.col, weights, minlength=n)[near.col]
    order = np.argsort(near.row, kind="stable")
    count = np.bincount(near.row, minlength=n)
    place = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
    cells, table = np.zeros((2, n, count.max()))
    rows = near.row[order]
    cells[rows, place] = near.col[order]
    table[rows, place] = weights[order]
    return cells.astype(np.int64), table
