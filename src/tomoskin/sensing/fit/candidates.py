"""Where a touch may have begun: signatures of faint spots all over the sheet, matched at once."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.problem import Matched, WhitenedTable
from tomoskin.sensing.fit.spot import CONTENT, FILLING, LOG_RADIUS, Footprints, Response, spots_of

_SPACING = 0.7
"""Between candidates, in median radii."""

_SIZES = (0.6, 1.0, 1.6)
"""Radii of the candidates, in median radii."""

_FAINT = 0.05
"""Depth at which signatures are taken: linear, and far above rounding."""

_PIECES = 4
"""Of the work for the candidates of one size."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Spots of content one, and what each does to the rows: made once for a model.

    Attributes
    ----------
    spots
        (n, 4) of content 1 m².
    signatures
        (n, n_meas) V/m².
    """

    spots: FloatArray
    signatures: FloatArray

    @classmethod
    def of(cls, response: Response, prior: SpotPrior) -> Self:
        """On a hexagonal grid, in three sizes."""
        positions = _positions(response, prior)
        spots = np.concatenate(
            [spots_of(positions, size * prior.radius, -_FAINT) for size in _SIZES]
        )
        changes = response.changes([spot[None] for spot in spots])
        content = spots[:, CONTENT].copy()
        spots[:, CONTENT] = 1.0
        return cls(spots, changes / content[:, None])

    def adapted(
        self, even: Response, uneven: Response, feet: Sequence[Footprints]
    ) -> Generator[None, None, Candidates]:
        """Those of an ``uneven`` sheet, from these of an ``even`` one on the same mesh, a piece
        between two yields: what faint spots change is linear in the fields.

        ``feet``: what :func:`footprints_of` gives for the even one.
        """
        more = uneven.by_cell - even.by_cell
        signatures = self.signatures.copy()
        content = np.exp(2 * self.spots[:, LOG_RADIUS]) * FILLING
        start = 0
        for own in feet:
            yield
            sums = own.sums(own.height, len(more))
            here = slice(start, start + sums.shape[0])
            for rows in np.array_split(np.arange(signatures.shape[1]), _PIECES):
                yield
                signatures[here, rows] += sums @ more[:, rows] / content[here, None]
            start = here.stop
        return Candidates(self.spots, signatures)

    def matched(self, seen: WhitenedTable) -> Matched:
        """The same for one noise."""
        return Matched.of(self.spots, self.signatures @ seen.matrix[: seen.narrow].T)


def footprints_of(response: Response, prior: SpotPrior) -> tuple[Footprints, ...]:
    """Of the candidates, of one size after the other."""
    positions = _positions(response, prior)
    spots = response.spots
    return tuple(spots.footprints(positions, size * prior.radius) for size in _SIZES)


def _positions(response: Response, prior: SpotPrior) -> FloatArray:
    """(n, 2) m."""
    return _grid(response.spots.mesh.centroids, _SPACING * prior.radius)


def _grid(inside: FloatArray, step: float) -> FloatArray:
    """(n, 2) hexagonal grid of positions near cells whose centroids are ``inside``."""
    low, high = inside.min(axis=0), inside.max(axis=0)
    rows = np.arange(low[1], high[1] + step, step * math.sqrt(3) / 2)
    x = np.arange(low[0], high[0] + step, step)
    grid = np.concatenate([
        np.column_stack([x + (number % 2) * step / 2, np.full(len(x), y)])
        for number, y in enumerate(rows)
    ])  # fmt: skip
    apart = np.linalg.norm(grid[:, None] - inside, axis=2).min(axis=1)
    return np.asarray(grid[apart < step / 2])
