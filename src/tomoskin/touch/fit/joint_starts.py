"""Where several touches may be at once: sets of candidates that explain a frame together.

One touch after the other may end where no step leads out: what two do together can look like a
third between them. So sets are searched as sets, as far as faint touches add up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.touch.fit.candidates import Matched
from tomoskin.touch.fit.prior import SpotPrior
from tomoskin.touch.fit.spot import CONTENT

_BEAM = 40
"""Sets that are gone on with for each number of touches."""

_ALIKE = 0.05
"""A candidate of which less than this part is its own, beside a set, adds nothing to it."""


@dataclass(frozen=True, eq=False)
class JointStarts:
    """Sets of candidates for one frame.

    Attributes
    ----------
    matched
        The candidates for its noise.
    gram
        (n, n) products of their signatures, with the prior of the content.
    projected
        (n,) products with the data.
    prior, sign
        Of the touches.
    """

    matched: Matched
    gram: FloatArray
    projected: FloatArray
    prior: SpotPrior
    sign: str

    @classmethod
    def of(cls, matched: Matched, data: FloatArray, prior: SpotPrior, sign: str) -> JointStarts:
        """For whitened ``data`` (r,)."""
        gram = matched.gram + np.eye(len(matched.squares)) / prior.content**2
        return cls(matched, gram, matched.signatures @ data, prior, sign)

    def sets(self, count: int, most: int) -> list[FloatArray]:
        """At most so many sets (``count``, 4) of spots, the likeliest first, not alike."""
        found = np.arange(len(self.projected))[:, None]
        for _ in range(count - 1):
            found = self._extended(found)
            if not len(found):
                return []
        return self._distinct(found, most)

    def _extended(self, sets: IntArray) -> IntArray:
        """(b, k + 1) the best of all sets (p, k) with one more, best first."""
        own = self.gram[sets[:, :, None], sets[:, None, :]]
        across = self.gram[sets]
        solved = np.linalg.solve(own, across)
        left = np.diag(self.gram) - np.einsum("pkn,pkn->pn", across, solved)
        data = self.projected - np.einsum("pkn,pk->pn", solved, self.projected[sets])
        base = np.einsum("pk,pk->p", self.projected[sets], self._contents(sets))
        useful = left > _ALIKE * np.diag(self.gram)
        gain = base[:, None] + np.where(useful, data**2 / np.where(useful, left, 1.0), -np.inf)
        best = np.argsort(gain, axis=None)[::-1][: 8 * _BEAM]
        best = best[np.isfinite(gain.ravel()[best])]
        row, new = np.unravel_index(best, gain.shape)
        longer = np.unique(np.sort(np.column_stack([sets[row], new]), axis=1), axis=0)
        return self._ranked(longer)[:_BEAM]

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

    def _distinct(self, sets: IntArray, most: int) -> list[FloatArray]:
        """(k, 4) spots of the first sets of which some touch is elsewhere than in those before."""
        sets = self._ranked(sets)
        spots = self.matched.spots[sets].copy()
        spots[:, :, CONTENT] = self._contents(sets)
        kept: list[FloatArray] = []
        for each in spots:
            if all(_apart(each, other) > self.prior.radius for other in kept):
                kept.append(each)
                if len(kept) == most:
                    break
        return kept


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Largest distance from a spot of ``one`` (k, 4) to the nearest of the ``other``, m."""
    away = np.linalg.norm(one[:, None, :2] - other[:, :2], axis=2)
    return float(max(away.min(axis=1).max(), away.min(axis=0).max()))
