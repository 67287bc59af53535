"""A touch by its parameters: a smooth dent in the logarithm of the conductivity, and its cells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, IntArray, ModelError, reach
from tomoskin.model.forward import State, TouchBatch
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.fit.profile import FILLING, PLAIN, Profile

X, Y, LOG_RADIUS, CONTENT = range(4)
"""Columns of spots (…, 4): centre m; logarithm of the radius in m; content m²."""

N_PARAMETERS = 4

_SPLIT = 2
"""Each side of a cell is cut into so many, for the mean of a profile over the cell."""

_PAIRS, _CELLS = 200_000, 20_000
"""Pairs of a spot and a cell, and cells of spots, that are looked at together: they stay near the
processor."""

_TINY = 1e-30
"""m², below any distance squared."""

_MANY = 24
"""From so many sets of spots on it is worth while to have the inverse of the sheet's matrix."""

_FEW = 300
"""Up to so many cells a local update is faster than a new solve (1,500 cells, native engine)."""


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
    """Many spots of depth 1, one after the other.

    Attributes
    ----------
    places, radius
        (n, 2) m and (n,) m of them.
    starts
        (n + 1,) spot k has ``cells[starts[k]:starts[k + 1]]``.
    cells
        (c,) those that it reaches.
    height
        (c,) change of log σ.
    """

    places: FloatArray
    radius: FloatArray
    starts: NDArray[np.int32]
    cells: NDArray[np.int32]
    height: FloatArray

    def sums(self, part: FloatArray, n_cells: int) -> csr_array:
        """(n, n_cells): each spot's sum over the cells, of which each has its ``part`` (c,)."""
        return csr_array((part, self.cells, self.starts), (len(self.starts) - 1, n_cells))

    @property
    def owner(self) -> IntArray:
        """(c,) which spot each cell is of."""
        return np.repeat(np.arange(len(self.radius)), np.diff(self.starts))


class Spots:
    """Spots on the cells of a mesh of triangles in the sheet's own flat coordinates.

    On a curved or stretched sheet they are round there, as large as these coordinates say, and the
    fields that they change are those of the surface: its metric is the forward model's.

    A spot of radius a and content m changes log σ by a :func:`profile` that has the second
    moment of an even disc of radius a; m is the integral of that change over the plane, which is
    what electrodes far from a faint spot see. Each cell takes the mean over 4 points, so that
    nothing jumps as a spot moves.
    """

    def __init__(self, mesh: Mesh, profile: Profile = PLAIN) -> None:
        if mesh.dimension != 2 or mesh.points.shape[1] != 2:
            raise ModelError(
                "expected a sheet with flat coordinates, got a volume or a curved sheet",
                hint='set method = "image" in [touch]',
            )
        corners = mesh.points[mesh.cells]
        self.mesh, self.profile = mesh, profile
        self._points = np.einsum("qk,ckd->cqd", _sub_centroids(_SPLIT), corners)
        self._by_axis = np.ascontiguousarray(self._points.transpose(2, 1, 0))
        self._centroids = np.ascontiguousarray(mesh.centroids.T)
        self._margin = np.linalg.norm(corners - mesh.centroids[:, None], axis=2).max(axis=1)

    def __eq__(self, other: object) -> bool:
        """Whether the sheets and the profiles are equal."""
        return isinstance(other, Spots) and (self.mesh.identity, self.profile) == (
            other.mesh.identity,
            other.profile,
        )

    def __hash__(self) -> int:
        """The hash of the sheet that the spots lie on."""
        return hash((self.mesh.identity, self.profile))

    def change(self, spots: FloatArray) -> tuple[IntArray, FloatArray]:
        """Cells (c,) that spots (k, 4) reach together, and (c,) the change of log σ there."""
        total, reached = np.zeros(len(self.mesh.cells)), np.zeros(len(self.mesh.cells), dtype=bool)
        for spot in spots:
            own = self._near(spot)
            square, _ = self._squares(spot, own)
            total[own] += depth_of(spot) * self.profile.at(square).mean(axis=1)
            reached[own] = True
        return np.flatnonzero(reached), total[reached]

    def part(self, spot: FloatArray) -> Part:
        """What one spot (4,) does to its cells, and how that depends on it."""
        cells = self._near(spot)
        square, offset = self._squares(spot, cells)
        depth, reach = float(depth_of(spot)), self.profile.reach * float(np.exp(spot[LOG_RADIUS]))
        height, fall, way = self.profile.shapes(square)
        fall *= depth
        mean = height.mean(axis=1)
        towards = -2.0 / reach**2 / _SPLIT**2 * np.einsum("cq,cqd->dc", fall, offset)
        wider = -2.0 * (depth * mean + (fall * square).mean(axis=1))
        more = mean * (self.profile.reach**2 / FILLING / reach**2)
        slopes, directed = np.stack([*towards, wider, more]), _along(-square * fall, offset)
        return Part(cells, depth * mean, slopes, directed, depth * way.mean(axis=1))

    def footprints(self, places: FloatArray, radius: FloatArray | float) -> Footprints:
        """Of spots at ``places`` (n, 2) m, of ``radius`` m, or (n,) m."""
        radius = np.broadcast_to(np.asarray(radius, np.float64), places.shape[:1])
        reach = self.profile.reach * radius
        owners, numbers, heights = [], [], []
        x, y = self._centroids
        for some in np.array_split(np.arange(len(places)), 1 + len(places) * len(x) // _PAIRS):
            square = (x - places[some, :1]) ** 2 + (y - places[some, 1:]) ** 2
            own, cells = np.nonzero(square < (reach[some, None] + self._margin) ** 2)
            own += some[:1].sum()
            x_off, y_off = self._offsets(places, own, cells)
            square = (x_off * x_off + y_off * y_off) / reach[own] ** 2
            height = self.profile.at(square).mean(axis=0)
            reached = np.flatnonzero(height)
            owners.append(own[reached])
            numbers.append(cells[reached].astype(np.int32))
            heights.append(height[reached])
        count = np.bincount(np.concatenate(owners), minlength=len(places))
        starts = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        return Footprints(places, radius, starts, np.concatenate(numbers), np.concatenate(heights))

    def flanks(self, feet: Footprints) -> tuple[FloatArray, FloatArray]:
        """(2, c) and (c,): what direction and shape of spots change; see :class:`Part`."""
        directed, reshaped = np.empty((2, len(feet.cells))), np.empty(len(feet.cells))
        owner, reach = feet.owner, self.profile.reach * feet.radius
        for some in np.array_split(np.arange(len(owner)), 1 + len(owner) // _CELLS):
            own = owner[some]
            x, y = self._offsets(feet.places, own, feet.cells[some])
            away = x * x + y * y
            square = away / reach[own] ** 2
            _, fall, way = self.profile.shapes(square)
            weight = -square * fall / np.maximum(away, _TINY)
            directed[0, some] = (weight * (x * x - away / 2)).mean(axis=0)
            directed[1, some] = (weight * x * y).mean(axis=0)
            reshaped[some] = way.mean(axis=0)
        return directed, reshaped

    def _offsets(
        self, places: FloatArray, own: IntArray, cells: NDArray[np.integer]
    ) -> tuple[FloatArray, FloatArray]:
        """(q, c) m, x and y: points of cells (c,), each from its ``own`` (c,) of ``places``."""
        x, y = self._by_axis
        return x[:, cells] - places[own, 0], y[:, cells] - places[own, 1]

    def _squares(self, spot: FloatArray, cells: IntArray) -> tuple[FloatArray, FloatArray]:
        """(c, q) squared distances in reaches of the points of cells, and (c, q, 2) offsets, m."""
        offset = self._points[cells] - spot[:2]
        square = np.einsum("cqd,cqd->cq", offset, offset)
        return square * float(self.profile.reach * np.exp(spot[LOG_RADIUS])) ** -2, offset

    def _near(self, spot: FloatArray) -> IntArray:
        """Cells that a spot may reach."""
        x, y = self._centroids - spot[:2, None]
        limit = self.profile.reach * np.exp(spot[LOG_RADIUS]) + self._margin
        return np.flatnonzero(x * x + y * y < limit * limit)


class Response:
    """Exact voltages of spots on a state of the forward model, and their derivatives."""

    def __init__(self, state: State, profile: Profile = PLAIN) -> None:
        """Prepare a flat sheet with a scalar conductivity; ModelError for another one."""
        if state.conductivity.ndim != 1 or np.iscomplexobj(state.conductivity):
            raise ModelError("expected a real scalar conductivity to fit touches, got another one")
        self.state = state
        self.spots = Spots(state.model.mesh, profile)

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
        if len(sets) >= _MANY:
            return self.transfers(sets, TouchBatch(self.state)) @ self.by_transfer
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

    def transfers(self, sets: Sequence[FloatArray], batch: TouchBatch) -> FloatArray:
        """(b, q) Ω: what each of some sets of spots (k, 4) changes between electrodes.

        The entries of a symmetric matrix without the last electrode, its upper triangle by rows.
        """
        every = np.concatenate(sets)
        feet = self.spots.footprints(every[:, [X, Y]], np.exp(every[:, LOG_RADIUS]))
        n_cells = len(self.state.conductivity)
        heights = feet.sums(feet.height * depth_of(every)[feet.owner], n_cells)
        owner = np.repeat(np.arange(len(sets)), [len(spots) for spots in sets])
        ones = np.ones(len(every))
        joined = csr_array((ones, (owner, np.arange(len(every))))) @ heights
        touches = joined.indptr, joined.indices, joined.data
        return upper(batch.change(touches, np.ones(1))[:, 0])

    @cached_property
    def by_transfer(self) -> FloatArray:
        """(q, n_meas) V/Ω: what the rows read of such entries."""
        model = self.state.model
        read, driven = model.readers, model.drive_currents[model.pattern.drive_index]
        rows, columns = np.triu_indices(read.shape[1] - 1)
        both = read[:, rows] * driven[:, columns] + read[:, columns] * driven[:, rows]
        both[:, rows == columns] /= 2
        return np.ascontiguousarray(both.T)

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


def upper(matrices: FloatArray) -> FloatArray:
    """(…, q) entries of the upper triangle of matrices (…, n, n), by rows."""
    rows, columns = np.triu_indices(matrices.shape[-1])
    return np.asarray(matrices[..., rows, columns])


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
    away = np.maximum(np.einsum("cqd,cqd->cq", offset, offset), _TINY)
    x, y = offset[..., 0], offset[..., 1]
    xx, xy = weight * (x * x / away - 0.5), weight * x * y / away
    return np.stack([xx.mean(axis=1), xy.mean(axis=1)])


def _sub_centroids(split: int) -> FloatArray:
    """(split², 3) barycentric centroids of a triangle's even parts."""
    upright = [((3 * i + 1), (3 * j + 1)) for i in range(split) for j in range(split - i)]
    turned = [((3 * i + 2), (3 * j + 2)) for i in range(split - 1) for j in range(split - 1 - i)]
    first, second = np.array(upright + turned).T / (3.0 * split)
    return np.column_stack([first, second, 1.0 - first - second])
