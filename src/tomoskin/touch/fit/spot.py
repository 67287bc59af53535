"""A touch by its parameters: a smooth dent in the logarithm of the conductivity, and its cells."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.forward import State
from tomoskin.mesh import Mesh

X, Y, LOG_RADIUS, CONTENT = range(4)
"""Columns of spots (…, 4): centre m; logarithm of the radius in m; content m²."""

N_PARAMETERS = 4

_REACH = math.sqrt(2.5)
"""A spot ends at this many radii: (1 − u²)³ then has the second moment of an even disc."""

_FILLING = math.pi * _REACH**2 / 4
"""∫ (1 − u²)³ over the plane, in squared radii."""

_SPLIT = 3
"""Each side of a cell is cut into so many, for the mean of a profile over the cell."""


def spots_of(
    places: FloatArray, radius: FloatArray | float, depth: FloatArray | float
) -> FloatArray:
    """(n, 4) spots at ``places`` (n, 2) m, of radius m; ``depth`` is log(σ/σ₀) at the centre.

    A press makes the sheet conduct less: its depth is negative.
    """
    places = np.asarray(places, dtype=np.float64)
    radius = np.broadcast_to(np.asarray(radius, dtype=np.float64), places.shape[:1])
    if places.ndim != 2 or places.shape[1] != 2 or not (radius > 0).all():
        raise ModelError(f"expected places (n, 2) and radii above 0, got {places.shape}, {radius}")
    content = _FILLING * radius**2 * depth
    return np.column_stack([places, np.log(radius), content])


def depth_of(spots: FloatArray) -> FloatArray:
    """(…,) log(σ/σ₀) at the centre of ``spots`` (…, 4)."""
    return np.asarray(spots[..., CONTENT] / (_FILLING * np.exp(2 * spots[..., LOG_RADIUS])))


class Spots:
    """Spots on the cells of a flat mesh of triangles.

    A spot of radius a and content m changes the logarithm of the conductivity by
    m / ∫g · g(d), g = (1 − d²/R²)³ inside R = √2.5 a: twice differentiable, and of the same
    second moment as an even disc of radius a. Content is ∫ log(σ/σ₀): what is far away sees of a
    faint spot. Each cell takes the mean over 9 points, so that nothing jumps between cells.
    """

    def __init__(self, mesh: Mesh) -> None:
        if mesh.dimension != 2 or mesh.points.shape[1] != 2:
            raise ModelError("expected a flat sheet: touches are fitted in the plane")
        corners = mesh.points[mesh.cells]
        self.mesh = mesh
        self._points = np.einsum("qk,ckd->cqd", _sub_centroids(_SPLIT), corners)
        self._margin = np.linalg.norm(corners - mesh.centroids[:, None], axis=2).max(axis=1)

    def change(self, spots: FloatArray) -> tuple[IntArray, FloatArray]:
        """Cells (c,) that sets of spots (b, k, 4) reach, and (b, c) the change of log σ there."""
        middle, reach = spots[..., :2], _REACH * np.exp(spots[..., LOG_RADIUS])
        cells = self._near(middle.mean(axis=0), reach, middle)
        points = self._points[cells].reshape(-1, 2)
        total = np.zeros((len(spots), len(cells)))
        for k in range(spots.shape[1]):
            offset = points - middle[:, k, None, :]
            square = np.einsum("bpd,bpd->bp", offset, offset) / reach[:, k, None] ** 2
            height = np.maximum(1.0 - square, 0.0) ** 3
            mean = height.reshape(len(spots), len(cells), _SPLIT**2).mean(axis=2)
            total += depth_of(spots[:, k])[:, None] * mean
        return cells, total

    def _near(self, centre: FloatArray, reach: FloatArray, middle: FloatArray) -> IntArray:
        """Cells that any of the sets may reach."""
        shift = np.abs(middle - centre).max(axis=(0, 2)) * math.sqrt(2)
        limit = reach.max(axis=0) + shift
        apart = np.linalg.norm(self.mesh.centroids[:, None] - centre, axis=2)
        return np.flatnonzero((apart < limit + self._margin[:, None]).any(axis=1))


class Response:
    """Exact voltages of spots on a state of the forward model, and their derivatives."""

    def __init__(self, state: State) -> None:
        """Prepare a flat sheet with a scalar conductivity; ModelError for another one."""
        if state.conductivity.ndim != 1 or np.iscomplexobj(state.conductivity):
            raise ModelError("expected a real scalar conductivity to fit touches on")
        self.state = state
        self.spots = Spots(state.model.mesh)
        extent = np.ptp(state.model.mesh.points, axis=0).max()
        self._steps = np.array([1e-5 * extent, 1e-5 * extent, 1e-4, 1e-5 * extent**2 / 100])

    @property
    def reference(self) -> FloatArray:
        """(n_meas,) V without a spot."""
        return np.asarray(self.state.voltages)

    def changes(self, spots: FloatArray) -> FloatArray:
        """(b, n_meas) V that sets of spots (b, k, 4) add to the reference."""
        cells, change = self.spots.change(spots)
        if not len(cells):
            return np.zeros((len(spots), len(self.reference)))
        sigma = self.state.conductivity[cells] * np.exp(change)
        pressed = self.state.local.voltages_of([(cells, each) for each in sigma])
        return np.asarray(pressed - self.reference)

    def jacobian(self, spots: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change (n_meas,) V of spots (k, 4), and its derivatives (n_meas, 4k) by each column.

        Forward differences of the exact change: as many local updates as there are parameters.
        """
        k = len(spots)
        sets = np.broadcast_to(spots, (1 + N_PARAMETERS * k, k, N_PARAMETERS)).copy()
        number = np.arange(N_PARAMETERS * k)
        spot, column = np.divmod(number, N_PARAMETERS)
        sets[1 + number, spot, column] += self._steps[column]
        found = self.changes(sets)
        return found[0], (found[1:] - found[0]).T / self._steps[column]

    def each(self, spots: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """:meth:`jacobian` of each of ``spots`` (n, 4), alone on the sheet."""
        for spot in spots:
            yield self.jacobian(spot[None])


def _sub_centroids(split: int) -> FloatArray:
    """(split², 3) barycentric centroids of a triangle's even parts."""
    upright = [((3 * i + 1), (3 * j + 1)) for i in range(split) for j in range(split - i)]
    turned = [((3 * i + 2), (3 * j + 2)) for i in range(split - 1) for j in range(split - 1 - i)]
    first, second = np.array(upright + turned).T / (3.0 * split)
    return np.column_stack([first, second, 1.0 - first - second])
