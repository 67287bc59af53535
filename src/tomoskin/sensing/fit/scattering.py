"""What single spots change of the resistance between electrodes, by the exact model: what a table
is made of, and what certifies it.

No pattern enters: whatever is measured of a sheet is linear in these. So they are kept on disk for
all patterns and currents.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import Arrays, FloatArray, IntArray, kept, reach
from tomoskin.model.forward import TouchBatch
from tomoskin.sensing.fit.certificate import trial_spots
from tomoskin.sensing.fit.profile import PLAIN
from tomoskin.sensing.fit.spot import Footprints, Response, Spots, upper
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.fit.table import PADDING, PositionGrid

FORMAT = 3
"""Of tables on disk: one more whenever the same spots would be tabulated otherwise."""

STEP = 0.5
"""Between grid points, in radii of the smallest spot; in larger ones as their root: at the rim,
where all is steep, the sheet's end counts more than a spot's size."""

LOG_STEP = 0.26
"""Between radii, in their logarithm."""


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
        """(n, r) of ``slopes`` (n_cells, r) where cells (c,) of spots have their ``part`` (c,)."""
        return np.asarray(self.feet.sums(part, len(slopes)) @ slopes)


def layout(response: Response, prior: SpotPrior) -> tuple[FloatArray, tuple[PositionGrid, ...]]:
    """(n_radii,) logarithms of the radii of a table, and their grids."""
    low, high = prior.log_radii
    log_radii = np.linspace(low, high, 1 + math.ceil((high - low) / LOG_STEP))
    points = response.spots.mesh.points
    steps = STEP * np.exp((low + log_radii) / 2)
    return log_radii, tuple(PositionGrid.over(points, step) for step in steps.tolist())


def lattices(response: Response, prior: SpotPrior) -> list[Lattice]:
    """The spots of a table."""
    log_radii, grids = layout(response, prior)
    return [
        Lattice.of(response.spots, grid, math.exp(log_radius))
        for log_radius, grid in zip(log_radii, grids, strict=True)
    ]


def depth_nodes(prior: SpotPrior, sign: str) -> FloatArray:
    """Chebyshev nodes of s = exp(depth/4) − 1 between the depths that touches may have: three on
    one side of none, five on both."""
    low, high = prior.depths(sign)
    ends, count = np.expm1(np.array([low, high]) / 4), 5 if low < 0 < high else 3
    turn = np.cos((2 * np.arange(count) + 1) / (2 * count) * np.pi)
    return np.asarray(ends.mean() + (ends[1] - ends[0]) / 2 * turn)


@dataclass(frozen=True, eq=False)
class Scattering:
    """Changes of the resistance between electrodes, Ω, as :meth:`Response.transfers` has them.

    Attributes
    ----------
    table
        (n, n_nodes, q) of the spots of all lattices, one after the other. In single precision,
        far below the table's own error.
    alone, pairs
        (n, q) and (m, q) of the trial spots of a certificate, each alone and in pairs.
    """

    table: NDArray[np.float32]
    alone: FloatArray
    pairs: FloatArray

    @classmethod
    def of(cls, response: Response, prior: SpotPrior, sign: str) -> Self:
        """By the exact model."""
        batch, depths = TouchBatch(response.state), 4 * np.log1p(depth_nodes(prior, sign))
        changes = []
        for lattice in lattices(response, prior):
            reach()
            feet = lattice.feet
            change = batch.change((feet.starts, feet.cells, feet.height), depths)
            changes.append(upper(change).astype(np.float32))
        spots, pairs = trial_spots(response, prior, sign)
        alone = response.transfers(list(spots[:, None]), batch)
        return cls(np.concatenate(changes), alone, response.transfers(list(spots[pairs]), batch))

    @classmethod
    def kept(cls, response: Response, prior: SpotPrior, sign: str) -> Self:
        """That of :meth:`of`, kept on disk."""

        def make() -> Arrays:
            made = cls.of(response, prior, sign)
            return {"table": made.table, "alone": made.alone, "pairs": made.pairs}

        arrays = kept(f"scattering-{sheet_identity(response, prior, sign)}", make)
        return cls(arrays["table"], arrays["alone"], arrays["pairs"])

    def by_lattice(self, of: list[Lattice]) -> list[NDArray[np.float32]]:
        """The table's changes of each lattice."""
        ends = np.cumsum([0, *(len(lattice.feet.radius) for lattice in of)]).tolist()
        return [self.table[first:end] for first, end in pairwise(ends)]


def sheet_identity(response: Response, prior: SpotPrior, sign: str) -> str:
    """Hash of all that a scattering depends on."""
    state, model = response.state, response.state.model
    said = f"{FORMAT} {model.mesh.identity} {prior} {sign}"
    if (profile := response.spots.profile) != PLAIN:
        said += f" {profile}"
    digest = hashlib.sha256(said.encode())
    for numbers in (state.conductivity, model.contact_impedance):
        digest.update(np.ascontiguousarray(numbers, dtype=np.float64).tobytes())
    return digest.hexdigest()[:32]
