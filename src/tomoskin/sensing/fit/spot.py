"""A touch by its parameters: a smooth dent in the logarithm of the conductivity, and its cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray, ModelError, reach
from tomoskin.model.forward import State
from tomoskin.model.mesh import Mesh

X, Y, LOG_RADIUS, CONTENT = range(4)
"""Columns of spots (…, 4): centre m; logarithm of the radius in m; content m²."""

N_PARAMETERS = 4

_SCALES = 6.0
"""A spot ends at this many of its scales."""

_NARROW = 1.15
"""Squared reaches of a bell in one of the spot with a tail: then their second moments agree."""

_BELL = 0.5
"""How far a spot is on the way from one with a tail to a bell."""

_SPLIT = 2
"""Each side of a cell is cut into so many, for the mean of a profile over the cell."""

_FEW = 300
"""Up to so many cells a local update is faster than a new solve (1,500 cells, native engine)."""


def profile(square: FloatArray) -> FloatArray:
    """Height at squared distances from the centre, in squared reaches: 1 there, 0 from 1 on.

    Between a spot with a tail, (1 + v) e⁻ᵛ with v the distance in scales, as a stretched sheet goes
    back to rest on what carries it, and a bell, as soft things press: both are level at the centre.
    """
    return _shapes(square)[0]


def _shapes(square: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """:func:`profile`, its derivative by its argument, and the whole way from tail to bell."""
    (tail, tail_fall), (bell, bell_fall) = _tail(square), _bell(square)
    size = 1.0 / (1.0 + _BELL * (_BELL_HEIGHT - 1.0))
    way = size * (bell - tail)
    return size * tail + _BELL * way, size * (tail_fall + _BELL * (bell_fall - tail_fall)), way


def _bell(square: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A bell with the content and second moment of the spot with a tail, and its derivative."""
    rest = np.maximum(1.0 - _NARROW * square, 0.0)
    steep = _BELL_HEIGHT * rest * rest
    return steep * rest, -3.0 * _NARROW * steep


def _tail(square: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The spot with a tail, drawn to 0 smoothly at its end; and its derivative."""
    inside = np.minimum(square, 1.0)
    scales = _SCALES * np.sqrt(inside)
    fading, third, more = np.exp(-scales), inside**3, 1.0 + scales
    taper = 1.0 - third
    fading *= taper
    height = more * fading
    height *= taper
    fall = (-6.0 * third) * more
    fall /= np.maximum(inside, 1e-30)
    fall -= 0.5 * _SCALES**2 * taper
    fall *= fading
    return height, fall


def _moments(shape: Callable[[FloatArray], FloatArray]) -> tuple[float, float]:
    """Reach in radii of the disc of the same second moment, and ∫ shape in squared radii."""
    node, weight = np.polynomial.legendre.leggauss(64)
    u = (node + 1.0) / 2.0
    ring = weight / 2.0 * shape(u**2) * u
    reach = math.sqrt(0.5 * float(ring.sum() / (ring @ u**2)))
    return reach, 2.0 * math.pi * float(ring.sum()) * reach**2


def _bell_height() -> float:
    """Of the bell with the content of the spot with a tail, whose height is 1."""
    reach, filling = _moments(lambda square: _tail(square)[0])
    return filling / reach**2 * 4.0 * _NARROW / math.pi


_BELL_HEIGHT = _bell_height()

REACH, FILLING = _moments(profile)
"""Of a spot: where it ends, in radii, and ∫ profile over the plane, in squared radii."""

PROFILE = REACH, FILLING, _SCALES, _NARROW, _BELL_HEIGHT, _BELL
"""All numbers of it, for the native engine."""


def spots_of(
    places: FloatArray, radius: FloatArray | float, depth: FloatArray | float
) -> FloatArray:
    """(n, 4) spots at ``places`` (n, 2) m, of radius m; ``depth`` is log(σ/σ₀) at the centre.

    A press makes the sheet conduct less: its depth is negative.
    """
    places = np.asarray(places, dtype=np.float64)
    radius = np.broadcast_to(np.asarray(radius, dtype=np.float64), places.shape[:1])
    if places.ndim != 2 or places.shape[1] != 2 or not (radius > 0).all():
        raise ModelError(
            f"expected positions (n, 2) and radii above 0, got {places.shape}, {radius}"
        )
    content = FILLING * radius**2 * depth
    return np.column_stack([places, np.log(radius), content])


@cache
def bounds_of(sign: str, most: float) -> tuple[float, float]:
    """Least and largest change by a touch of that ``sign``, as a skin has it, up to ``most``."""
    return 0.0 if sign == "increase" else -most, 0.0 if sign == "decrease" else most


def depth_of(spots: FloatArray) -> FloatArray:
    """(…,) log(σ/σ₀) at the centre of ``spots`` (…, 4)."""
    return np.asarray(spots[..., CONTENT] / (FILLING * np.exp(2 * spots[..., LOG_RADIUS])))


@dataclass(frozen=True, eq=False)
class Part:
    """One spot on its cells.

    Attributes
    ----------
    cells
        (c,) those that it may reach.
    height
        (c,) change of log σ.
    slopes
        (4, c) derivatives of that by each column of the spot.
    directed
        (2, c) xx = −yy and xy of a part of log σ that has a direction: a stretched sheet conducts
        otherwise along the stretch than across. Round a press that is
        depth · r|dg/dr|/2 · (r̂r̂ᵀ − 1/2): none in the middle, most on the flank.
    reshaped
        (c,) change of log σ by a bell instead of a spot with a tail.
    """

    cells: IntArray
    height: FloatArray
    slopes: FloatArray
    directed: FloatArray
    reshaped: FloatArray


@dataclass(frozen=True, eq=False)
class Footprints:
    """Many spots of one radius and depth 1, one after the other.

    Attributes
    ----------
    starts
        (n + 1,) spot k has ``cells[starts[k]:starts[k + 1]]``.
    cells
        (c,) those that it may reach.
    height
        (c,) change of log σ.
    directed, reshaped
        (2, c) and (c,), see :class:`Part`.
    """

    starts: IntArray
    cells: IntArray
    height: FloatArray
    directed: FloatArray
    reshaped: FloatArray

    def sums(self, part: FloatArray, n_cells: int) -> csr_array:
        """(n, n_cells): each spot's sum over the cells, of which each has its ``part`` (c,)."""
        return csr_array((part, self.cells, self.starts), (len(self.starts) - 1, n_cells))


class Spots:
    """Spots on the cells of a mesh of triangles in the sheet's own flat coordinates.

    On a curved or stretched sheet they are round there, as large as these coordinates say, and the
    fields that they change are those of the surface: its metric is the forward model's.

    A spot of radius a and content m changes log σ by a :func:`profile` that has the second
    moment of an even disc of radius a; m is the integral of that change over the plane, which is
    what electrodes far from a faint spot see. Each cell takes the mean over 4 points, so that
    nothing jumps as a spot moves.
    """

    def __init__(self, mesh: Mesh) -> None:
        if mesh.dimension != 2 or mesh.points.shape[1] != 2:
            raise ModelError(
                "expected a sheet with flat coordinates, got a volume or a curved sheet",
                hint='set method = "image" in [touch]',
            )
        corners = mesh.points[mesh.cells]
        self.mesh = mesh
        self._points = np.einsum("qk,ckd->cqd", _sub_centroids(_SPLIT), corners)
        self._centroids = np.ascontiguousarray(mesh.centroids.T)
        self._margin = np.linalg.norm(corners - mesh.centroids[:, None], axis=2).max(axis=1)

    def __eq__(self, other: object) -> bool:
        """Whether the sheets are equal."""
        return isinstance(other, Spots) and self.mesh.identity == other.mesh.identity

    def __hash__(self) -> int:
        """The hash of the sheet that the spots lie on."""
        return hash(self.mesh.identity)

    def change(self, spots: FloatArray) -> tuple[IntArray, FloatArray]:
        """Cells (c,) that spots (k, 4) reach together, and (c,) the change of log σ there."""
        total, reached = np.zeros(len(self.mesh.cells)), np.zeros(len(self.mesh.cells), dtype=bool)
        for spot in spots:
            own = self._near(spot)
            square, _ = self._squares(spot, own)
            total[own] += depth_of(spot) * profile(square).mean(axis=1)
            reached[own] = True
        return np.flatnonzero(reached), total[reached]

    def part(self, spot: FloatArray) -> Part:
        """What one spot (4,) does to its cells, and how that depends on it."""
        cells = self._near(spot)
        square, offset = self._squares(spot, cells)
        depth, reach = float(depth_of(spot)), REACH * float(np.exp(spot[LOG_RADIUS]))
        height, fall, way = _shapes(square)
        fall *= depth
        mean = height.mean(axis=1)
        towards = -2.0 / reach**2 / _SPLIT**2 * np.einsum("cq,cqd->dc", fall, offset)
        wider = -2.0 * (depth * mean + (fall * square).mean(axis=1))
        more = mean * (REACH**2 / FILLING / reach**2)
        slopes, directed = np.stack([*towards, wider, more]), _along(-square * fall, offset)
        return Part(cells, depth * mean, slopes, directed, depth * way.mean(axis=1))

    def footprints(self, points: FloatArray, radius: float) -> Footprints:
        """Of spots at ``points`` (n, 2) m, of ``radius`` m."""
        reach = REACH * radius
        near = cKDTree(self.mesh.centroids).query_ball_point(
            points, reach + self._margin.max(), return_sorted=True
        )
        starts = np.cumsum([0, *map(len, near)])
        cells = np.concatenate([np.zeros(0), *near]).astype(np.int64)
        offset = self._points[cells] - np.repeat(points, np.diff(starts), axis=0)[:, None]
        square = np.einsum("cqd,cqd->cq", offset, offset) / reach**2
        height, fall, way = _shapes(square)
        directed = _along(-square * fall, offset)
        return Footprints(starts, cells, height.mean(axis=1), directed, way.mean(axis=1))

    def _squares(self, spot: FloatArray, cells: IntArray) -> tuple[FloatArray, FloatArray]:
        """(c, q) squared distances in reaches of the points of cells, and (c, q, 2) offsets, m."""
        offset = self._points[cells] - spot[:2]
        square = np.einsum("cqd,cqd->cq", offset, offset)
        return square * float(REACH * np.exp(spot[LOG_RADIUS])) ** -2, offset

    def _near(self, spot: FloatArray) -> IntArray:
        """Cells that a spot may reach."""
        x, y = self._centroids - spot[:2, None]
        limit = REACH * np.exp(spot[LOG_RADIUS]) + self._margin
        return np.flatnonzero(x * x + y * y < limit * limit)


class Response:
    """Exact voltages of spots on a state of the forward model, and their derivatives."""

    def __init__(self, state: State) -> None:
        """Prepare a flat sheet with a scalar conductivity; ModelError for another one."""
        if state.conductivity.ndim != 1 or np.iscomplexobj(state.conductivity):
            raise ModelError("expected a real scalar conductivity to fit touches, got another one")
        self.state = state
        self.spots = Spots(state.model.mesh)

    @cached_property
    def times(self) -> FloatArray:
        """(n_meas,) when each row is read, in parts of a scan about its middle."""
        index = self.state.model.pattern.drive_index
        return np.asarray((index + 0.5) / (index.max() + 1) - 0.5)

    @property
    def reference(self) -> FloatArray:
        """(n_meas,) V of the sheet without a spot."""
        return np.asarray(self.state.voltages)

    def changes(self, sets: Sequence[FloatArray]) -> FloatArray:
        """(b, n_meas) V that each of some sets of spots (k, 4) adds to the reference.

        By the local update of the forward model, or by a new solve where many cells change.
        """
        touched = [self.spots.change(spots) for spots in sets]
        sigma = self.state.conductivity
        pressed = [(cells, sigma[cells] * np.exp(change)) for cells, change in touched]
        return self.voltages(pressed) - self.reference

    def voltages(self, touches: Sequence[tuple[IntArray, FloatArray]]) -> FloatArray:
        """(b, n_meas) V of the sheet with some cells (c,) changed to a conductivity (c,)."""
        few = [k for k, (cells, _) in enumerate(touches) if len(cells) <= _FEW]
        many = [k for k, (cells, _) in enumerate(touches) if len(cells) > _FEW]
        out = np.empty((len(touches), len(self.reference)))
        if few:
            out[few] = self.state.local.voltages_of([touches[k] for k in few])
        for k in many:
            reach()
            cells, sigma = touches[k]
            conductivity = self.state.conductivity.copy()
            conductivity[cells] = sigma
            out[k] = self.state.model.at(conductivity).voltages
        return out

    @cached_property
    def by_cell(self) -> FloatArray:
        """(n_cells, n_meas) V: derivatives by log σ of a cell."""
        state = self.state
        return np.asarray((state.jacobian * state.conductivity).T)

    @cached_property
    def by_direction(self) -> tuple[FloatArray, FloatArray]:
        """(n_meas, n_cells) V twice: derivatives by the xx = −yy and the xy of log σ of a cell."""
        model, field = self.state.model, self.state.gradient
        x, y = field[:, :1], field[:, 1:]
        turned = (x + y) / math.sqrt(2), (x - y) / math.sqrt(2)
        along, across, one, other = (
            model.engine.jacobian(np.ascontiguousarray(part), model.pattern, model.current)
            * self.state.conductivity
            for part in (x, y, *turned)
        )
        return along - across, one - other

    def expanded(self, spots: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Change (n_meas,) V of spots (k, 4), its derivatives (n_meas, 4k) by each column, and
        (n_meas, 2k) V: derivatives by direction and shape of each spot; see :class:`Part`.

        The fields of the pressed sheet give all, by reciprocity, whatever the number of spots.
        """
        parts = [self.spots.part(spot) for spot in spots]
        change = np.zeros(len(self.state.conductivity))
        for part in parts:
            change[part.cells] += part.height
        pressed = self.state.model.at(self.state.conductivity * np.exp(change))
        answers = np.array([_answers(pressed, part) for part in parts])
        slopes = answers[:, :N_PARAMETERS].reshape(-1, answers.shape[2]).T
        nuisances = answers[:, N_PARAMETERS:].reshape(-1, answers.shape[2]).T
        return pressed.voltages - self.reference, slopes, nuisances


def _answers(pressed: State, part: Part) -> FloatArray:
    """(6, n_meas) V: −∫ ∇u · ∂σ ∇w for a spot's four columns, its direction, and its shape."""
    field = pressed.gradient[:, :, part.cells]
    n, sigma = len(field), pressed.conductivity[part.cells]
    flow = np.empty((N_PARAMETERS + 2, *field.shape))
    np.multiply(field, (part.slopes * sigma)[:, None, None], out=flow[:-2])
    (x, y), (xx, xy) = field.swapaxes(0, 1), part.directed * sigma
    flow[-2, :, 0], flow[-2, :, 1] = x * xx + y * xy, x * xy - y * xx
    np.multiply(field, part.reshaped * sigma, out=flow[-1])
    moved = flow.reshape(len(flow) * n, -1) @ field.reshape(n, -1).T
    return np.asarray(-pressed.model.voltages(moved.reshape(-1, n, n)))


def _along(weight: FloatArray, offset: FloatArray) -> FloatArray:
    """(2, c) mean of weight (c, q) times xx and xy of r̂r̂ᵀ − 1/2, for offsets (c, q, 2)."""
    away = np.maximum(np.einsum("cqd,cqd->cq", offset, offset), 1e-30)
    x, y = offset[..., 0], offset[..., 1]
    xx, xy = weight * (x * x / away - 0.5), weight * x * y / away
    return np.stack([xx.mean(axis=1), xy.mean(axis=1)])


def _sub_centroids(split: int) -> FloatArray:
    """(split², 3) barycentric centroids of a triangle's even parts."""
    upright = [((3 * i + 1), (3 * j + 1)) for i in range(split) for j in range(split - i)]
    turned = [((3 * i + 2), (3 * j + 2)) for i in range(split - 1) for j in range(split - 1 - i)]
    first, second = np.array(upright + turned).T / (3.0 * split)
    return np.column_stack([first, second, 1.0 - first - second])
