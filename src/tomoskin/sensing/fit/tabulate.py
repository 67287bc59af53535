"""Making a table of what one spot does, and changing it to that of an uneven sheet.

The exact model is asked at every point of the table once, on an even sheet. What unevenness does
is nearly linear: of each change it is the same part as of the linear model's, to 0.1 % of the
change on sheets uneven by 20 %. So another sheet costs one product a radius.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product
from typing import Self

import numpy as np
from scipy.ndimage import spline_filter1d
from scipy.spatial import cKDTree

from tomoskin.core import Arrays, FloatArray, IntArray, kept, reach
from tomoskin.sensing.fit.certificate import Certificate
from tomoskin.sensing.fit.spot import PLAIN, Footprints, Response, Spots
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.fit.table import ABREAST, N_DIRECTIONS, PADDING, PositionGrid, ResponseTable

FORMAT = 2
"""Of tables on disk: one more whenever the same spots would be tabulated otherwise."""

STEP = 0.5
"""Between grid points, in radii of the smallest spot; in larger ones as their root: at the rim,
where all is steep, the sheet's end counts more than a spot's size."""

LOG_STEP = 0.26
"""Between radii, in their logarithm."""

NEGLIGIBLE, SAMPLED = 3e-5, 3000
"""Part of the largest change below which a direction of the data counts as none, by so many."""

FAINT = -0.3
"""Near this depth it is taken what a shape does; that is in proportion to the depth."""

UNCLEAR = 1e-9
"""Part of the largest square below which a linear change is no measure of an exact one."""

_PIECE = 80_000
"""Numbers that are filtered in a piece of work: less than a millisecond."""

_SUMS = 8_000_000
"""Products that are summed in a piece of work: as long."""

_BLOCKS = 8
"""Of cells whose fields are compared, one in a piece of work."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """The spots of one radius on a grid of positions.

    Points far off the sheet have what their nearest neighbour has: splines are smooth then.

    Attributes
    ----------
    nearest
        (n_points,) which of the spots each point of the grid has.
    feet
        The spots, of depth 1.
    """

    grid: PositionGrid
    nearest: IntArray
    feet: Footprints

    @classmethod
    @lru_cache(maxsize=16)
    def of(cls, spots: Spots, grid: PositionGrid, radius: float) -> Self:
        """On the sheet of ``spots``, of ``radius`` m; equal sheets of a process share one."""
        points = grid.points
        apart, _ = cKDTree(spots.mesh.centroids).query(points)
        needed = np.flatnonzero(apart < PADDING * math.sqrt(2) * grid.step)
        _, nearest = cKDTree(points[needed]).query(points)
        return cls(grid, np.asarray(nearest), spots.footprints(points[needed], radius))

    def linear(self, slopes: FloatArray, part: FloatArray) -> FloatArray:
        """(n_points, r) of ``slopes`` (n_cells, r) where each cell (c,) has its ``part`` (c,)."""
        return np.asarray((self.feet.sums(part, len(slopes)) @ slopes)[self.nearest])

    def summing(self, slopes: FloatArray) -> Generator[None, None, FloatArray]:
        """As :meth:`linear`, each cell by its height; a piece of work between two yields."""
        sums = self.feet.sums(self.feet.height, len(slopes))
        linear = np.empty((len(self.nearest), slopes.shape[1]))
        for part in _slices(sums.nnz, slopes.shape[1], _SUMS):
            yield
            linear[:, part] = (sums @ slopes[:, part])[self.nearest]
        return linear

    def exact(self, response: Response, depth: float) -> FloatArray:
        """(n_points, n_meas) V of each spot alone, of that ``depth``."""
        feet = self.feet
        sigma = response.state.conductivity[feet.cells] * np.exp(depth * feet.height)
        ends = [slice(*pair) for pair in pairwise(feet.starts)]
        changed = response.voltages([(feet.cells[e], sigma[e]) for e in ends])
        return np.asarray((changed - response.reference)[self.nearest])


@dataclass(frozen=True, eq=False)
class Tabulation:
    """A table of an even sheet, and what it takes to change it to that of an uneven one.

    Attributes
    ----------
    table
        Of ``response``.
    parts
        (n_points, n_nodes): each change divided by s, in parts of the linear model's change.
    certificate
        How far the table is from the exact model.
    """

    response: Response
    table: ResponseTable
    parts: FloatArray
    certificate: Certificate

    @classmethod
    def of(cls, response: Response, prior: SpotPrior, sign: str) -> Self:
        """For spots as the ``prior`` and the ``sign`` allow them."""
        log_radii, grids = layout(response, prior)
        nodes = _nodes(*prior.depths(sign))
        sampled, parts = [], []
        for log_radius, grid in zip(log_radii, grids, strict=True):
            reach()
            lattice = Lattice.of(response.spots, grid, math.exp(log_radius))
            samples, part = _sampled(response, lattice, nodes)
            sampled.append(samples)
            parts.append(part)
        basis = _basis(sampled)
        values = [_filtered(s @ basis.T, g.shape) for s, g in zip(sampled, grids, strict=True)]
        every = np.concatenate(values).astype(np.float32)
        table = ResponseTable(log_radii, grids, sign, nodes, every, basis)
        certificate = Certificate.of(response, table, prior)
        return cls(response, table, np.concatenate(parts), certificate)

    @classmethod
    def unpacked(cls, arrays: Arrays, response: Response, prior: SpotPrior, sign: str) -> Self:
        """Of the arrays that :meth:`packed` made of the same."""
        log_radii, grids = layout(response, prior)
        nodes = _nodes(*prior.depths(sign))
        table = ResponseTable(log_radii, grids, sign, nodes, arrays["values"], arrays["basis"])
        return cls(response, table, arrays["parts"], Certificate.unpacked(arrays))

    def packed(self) -> Arrays:
        """The arrays that take long to compute."""
        table = self.table
        return {
            "values": table.values,
            "basis": table.basis,
            "parts": self.parts,
            **self.certificate.packed(),
        }

    def adapted(self, response: Response) -> Generator[None, None, ResponseTable]:
        """The table of ``response``, another sheet on the same mesh, a piece between two yields."""
        table = self.table
        basis, n_nodes = table.basis.T, len(table.nodes)
        more = np.empty((len(response.by_cell), basis.shape[1]))
        for cells in np.array_split(np.arange(len(more)), _BLOCKS):
            yield
            more[cells] = (response.by_cell[cells] - self.response.by_cell[cells]) @ basis
        values, start = np.empty_like(table.values), 0
        for lattice in self.lattices:
            yield
            linear = yield from lattice.summing(more)
            here = slice(start, start + len(linear))
            yield
            values[here, n_nodes:] = table.values[here, n_nodes:]
            for node, part in product(
                range(n_nodes), _slices(len(linear), linear.shape[1], _PIECE)
            ):
                yield
                moved = self.parts[here, node, None] * linear[:, part]
                filtered = _filtered(moved, lattice.grid.shape)
                values[here, node, part] = table.values[here, node, part] + filtered
            start = here.stop
        return replace(table, values=values)

    @cached_property
    def lattices(self) -> list[Lattice]:
        """The spots of the table: half a second of work, for :meth:`adapted`."""
        spots, table = self.response.spots, self.table
        return [
            Lattice.of(spots, grid, math.exp(log_radius))
            for log_radius, grid in zip(table.log_radii, table.grids, strict=True)
        ]


def kept_tabulation(response: Response, prior: SpotPrior, sign: str) -> Tabulation:
    """That of :meth:`Tabulation.of`, kept on disk."""

    def make() -> Arrays:
        return Tabulation.of(response, prior, sign).packed()

    arrays = kept(f"touch-{_identity(response, prior, sign)}", make)
    return Tabulation.unpacked(arrays, response, prior, sign)


def _identity(response: Response, prior: SpotPrior, sign: str) -> str:
    """Hash of all that a tabulation depends on."""
    state, model = response.state, response.state.model
    said = f"{FORMAT} {model.mesh.identity} {model.pattern.identity} {prior} {sign}"
    if (profile := response.spots.profile) != PLAIN:
        said += f" {profile}"
    digest = hashlib.sha256(said.encode())
    for numbers in (state.conductivity, model.contact_impedance, model.current):
        digest.update(np.ascontiguousarray(numbers, dtype=np.float64).tobytes())
    return digest.hexdigest()[:32]


def layout(response: Response, prior: SpotPrior) -> tuple[FloatArray, tuple[PositionGrid, ...]]:
    """(n_radii,) logarithms of the radii of a table, and their grids."""
    low, high = prior.log_radii
    log_radii = np.linspace(low, high, 1 + math.ceil((high - low) / LOG_STEP))
    points = response.spots.mesh.points
    steps = STEP * np.exp((low + log_radii) / 2)
    return log_radii, tuple(PositionGrid.over(points, step) for step in steps.tolist())


def _nodes(low: float, high: float) -> FloatArray:
    """Chebyshev nodes of s between two depths: three on one side of none, five on both."""
    ends, count = np.expm1(np.array([low, high]) / 4), 5 if low < 0 < high else 3
    turn = np.cos((2 * np.arange(count) + 1) / (2 * count) * np.pi)
    return np.asarray(ends.mean() + (ends[1] - ends[0]) / 2 * turn)


def _sampled(
    response: Response, lattice: Lattice, nodes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n_points, n_nodes + N_DIRECTIONS, n_meas) V, and :attr:`Tabulation.parts`."""
    feet, depths = lattice.feet, 4 * np.log1p(nodes)
    out = np.empty((len(lattice.nearest), len(nodes) + N_DIRECTIONS, len(response.reference)))
    for number, (node, depth) in enumerate(zip(nodes, depths.tolist(), strict=True)):
        out[:, number] = lattice.exact(response, depth) / node
    parts = _parts(out[:, : len(nodes)], lattice.linear(response.by_cell, feet.height))
    directed = zip(response.by_direction, feet.directed, strict=True)
    out[:, -2] = sum(lattice.linear(slopes.T, part) for slopes, part in directed)
    faint = int(np.abs(depths - FAINT).argmin())
    less = parts[:, faint, None] * nodes[faint] / depths[faint]  # than the linear model has
    out[:, -1] = less * lattice.linear(response.by_cell, feet.reshaped)
    return out, parts


def _parts(samples: FloatArray, linear: FloatArray) -> FloatArray:
    """(n, k) amplitudes of ``linear`` (n, r) in ``samples`` (n, k, r); 0 where it is too faint."""
    square = np.einsum("nr,nr->n", linear, linear)
    clear = square > UNCLEAR * square.max()
    along = np.einsum("nkr,nr->nk", samples, linear)
    return np.where(clear[:, None], along / np.where(clear, square, 1.0)[:, None], 0.0)


def _basis(sampled: list[FloatArray]) -> FloatArray:
    """(rank, n_meas) what all changes are made of, but for a part of ``NEGLIGIBLE``."""
    rows = np.concatenate([s[:, :-N_DIRECTIONS].reshape(-1, s.shape[2]) for s in sampled])
    rows = rows[:: max(1, len(rows) // SAMPLED)]
    square, basis = np.linalg.eigh(rows.T @ rows)
    wanted = int(np.count_nonzero(square > NEGLIGIBLE**2 * square[-1]))
    return np.asarray(basis.T[-min(-(-wanted // ABREAST) * ABREAST, len(square)) :])


def _slices(size: int, rank: int, most: int) -> list[slice]:
    """Entries of the basis that make up a piece of work, each of that ``size``."""
    step = max(most // size, 1)
    return [slice(first, first + step) for first in range(0, rank, step)]


def _filtered(samples: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Spline coefficients of samples (n_points, ...) on a grid of that shape."""
    grid = samples.reshape(*shape, -1)
    for axis in (0, 1):
        grid = spline_filter1d(grid, 3, axis=axis, mode="mirror")
    return np.asarray(grid.reshape(samples.shape))
