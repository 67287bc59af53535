"""Where several touches may be at once: sets of candidates that explain a frame together.

One touch after the other may end where no step leads out: what two do together can look like a
third between them. So sets are searched as sets, as far as faint touches add up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.problem import Matched
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS

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
