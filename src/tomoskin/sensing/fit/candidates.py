"""Where touches may have begun: signatures of faint spots all over the sheet, and sets of them."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray
from tomoskin.sensing.fit.problem import Matched, WhitenedTable
from tomoskin.sensing.fit.profile import FILLING
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, Footprints, Response, spots_of
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.segment import hexagonal_grid

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
        """The candidates as data of one noise show them."""
        return Matched.of(self.spots, self.signatures @ seen.matrix[: seen.narrow].T)


def footprints_of(response: Response, prior: SpotPrior) -> tuple[Footprints, ...]:
    """Of the candidates, of one size after the other."""
    positions = _positions(response, prior)
    spots = response.spots
    return tuple(spots.footprints(positions, size * prior.radius) for size in _SIZES)


def _positions(response: Response, prior: SpotPrior) -> FloatArray:
    """(n, 2) m of a hexagonal grid of positions near the cells."""
    inside, step = response.spots.mesh.centroids, _SPACING * prior.radius
    grid = hexagonal_grid(inside, step)
    apart, _ = cKDTree(inside).query(grid)
    return np.asarray(grid[apart < step / 2])


_BEAM = 30
"""Sets that are gone on with for each number of touches."""

_RANKED = 800
"""Sets among which those are looked for: most differ by a neighbour only."""

_ALIKE = 0.05
"""A candidate of which less than this part is its own, beside a set, adds nothing to it."""


@dataclass(frozen=True, eq=False)
class JointStarts:
    """Sets of candidates for one frame.

    Attributes
    ----------
    spots
        (n, 4) candidates.
    gram
        (n, n) products of their signatures, with the prior of the content.
    projected
        (n,) products with the data.
    prior, sign
        Of the touches.
    """

    spots: FloatArray
    gram: FloatArray
    projected: FloatArray
    prior: SpotPrior
    sign: str

    @classmethod
    def of(cls, matched: Matched, data: FloatArray, prior: SpotPrior, sign: str) -> JointStarts:
        """For whitened ``data`` (c,), of candidates of median radius."""
        away = np.abs(matched.spots[:, LOG_RADIUS] - np.log(prior.radius))
        chosen = np.flatnonzero(away < away.min() + 1e-9)
        spots, signatures = matched.spots[chosen], matched.signatures[chosen]
        gram = signatures @ signatures.T + np.eye(len(chosen)) / prior.content**2
        return cls(spots, gram, signatures @ data[: signatures.shape[1]], prior, sign)

    def sets(self, count: int, most: int) -> list[FloatArray]:
        """At most so many sets (``count``, 4) of spots, the likeliest first, not alike."""
        found = np.arange(len(self.projected))[:, None]
        for number in range(1, count):
            found = self._extended(found, most if number == count - 1 else _BEAM)
            if not len(found):
                return []
        if count == 1:
            found = self._distinct(self._ranked(found), most)
        spots = self.spots[found]
        spots[:, :, CONTENT] = self._contents(found)
        return list(spots)

    def _extended(self, sets: IntArray, most: int) -> IntArray:
        """(b, k + 1) the best of all sets (p, k) with one more, best first."""
        own = self.gram[sets[:, :, None], sets[:, None, :]]
        across = self.gram[sets]
        solved = np.linalg.solve(own, across)
        left = np.diag(self.gram) - np.einsum("pkn,pkn->pn", across, solved)
        data = self.projected - np.einsum("pkn,pk->pn", solved, self.projected[sets])
        base = np.einsum("pk,pk->p", self.projected[sets], self._contents(sets))
        useful = left > _ALIKE * np.diag(self.gram)
        gain = base[:, None] + np.where(useful, data**2 / np.where(useful, left, 1.0), -np.inf)
        best = np.argsort(gain, axis=None)[::-1][: 2 * _RANKED]
        best = best[np.isfinite(gain.ravel()[best])]
        row, new = np.unravel_index(best, gain.shape)
        longer = np.unique(np.sort(np.column_stack([sets[row], new]), axis=1), axis=0)
        return self._distinct(self._ranked(longer)[:_RANKED], most)

    def _ranked(self, sets: IntArray) -> IntArray:
        """Those whose touches have the sign that counts, by how much they explain."""
        contents = self._contents(sets)
        if self.sign != "both":
            right = contents < 0 if self.sign == "decrease" else contents > 0
            sets, contents = sets[right.all(axis=1)], contents[right.all(axis=1)]
        explained = np.einsum("pk,pk->p", self.projected[sets], contents)
        return np.asarray(sets[np.argsort(-explained)])

    def _contents(self, sets: IntArray) -> FloatArray:
        own = self.gram[sets[:, :, None], sets[:, None, :]]
        return np.asarray(np.linalg.solve(own, self.projected[sets][:, :, None])[:, :, 0])

    def _distinct(self, sets: IntArray, most: int) -> IntArray:
        """(b, k) the first sets of which some touch is elsewhere than in those before."""
        apart = np.linalg.norm(self.spots[:, None, :2] - self.spots[:, :2], axis=2)
        kept: list[IntArray] = []
        for each in sets:
            between = apart[each[:, None, None], np.array(kept, dtype=int).reshape(-1, len(each)).T]
            away = np.maximum(between.min(axis=1).max(axis=0), between.min(axis=0).max(axis=0))
            if (away > self.prior.radius).all():
                kept.append(each)
                if len(kept) == most:
                    break
        return np.array(kept, dtype=int).reshape(-1, sets.shape[1])
