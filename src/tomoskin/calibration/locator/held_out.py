"""The maps' own estimate of a place, for presses that they have not seen and for frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.calibration.locator.maps import ResponseMaps
from tomoskin.calibration.locator.per_channel import ChannelLikelihood, ChannelMaps
from tomoskin.calibration.locator.posterior import GridLikelihood, moments, pooled, powers_of
from tomoskin.calibration.locator.process import LENGTHS, Likeness
from tomoskin.calibration.locator.rotations import Rotations
from tomoskin.core import FloatArray

FEW = 80
"""So few presses are asked row by row too; with more, all rows together know better."""

_SCARCE = 20
_FOLDS = (8, 5)
"""In which presses are left out, when they are scarce and when they are not."""

_NEAR = 0.5
"""Mean squared step, in parts of that between any two presses, below which they are in an order."""

Likelihood = Callable[[FloatArray], FloatArray]
"""Features (n, k) → log-likelihood (n, g) of the grid's places."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """Posterior mean and covariance of a place.

    ``powers`` weigh the log-likelihoods of ``likelihood``, and of ``per_channel`` where that
    stands.
    ``left_out`` (n, 2) and ``left_out_spread`` (n, 2, 2) are those of the presses themselves,
    each from maps learnt without it and some others.
    """

    grid: FloatArray
    likelihood: GridLikelihood
    per_channel: ChannelLikelihood | None
    powers: FloatArray
    left_out: FloatArray
    left_out_spread: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        places: FloatArray,
        grid: FloatArray,
        turns: Rotations,
        like: ResponseMaps | None = None,
    ) -> Self:
        """Learn the maps; length scales by evidence, powers by left-out presses.

        Maps that are ``like`` others have their length scale and coregionalisation.
        """
        known = like.coregion if like else None
        lengths = [like.basis.likeness] if like else map(Likeness, LENGTHS)
        maps = max(
            (ResponseMaps.of(x, places, features, known) for x in lengths),
            key=lambda m: m.evidence,
        )
        together = maps.basis.likeness

        def joint(some: FloatArray, theirs: FloatArray) -> GridLikelihood:
            return GridLikelihood.of(ResponseMaps.of(together, some, theirs, known), grid)

        parts = [_left_out(joint, places, features)]
        alone = None
        if len(places) < FEW:
            alone = found = ChannelMaps.of(places, features, turns)

            def single(some: FloatArray, theirs: FloatArray) -> ChannelLikelihood:
                return ChannelLikelihood.of(found.again(some, theirs), grid)

            parts.append(_left_out(single, places, features))
        powers = powers_of(parts, grid, places)
        left_out = moments(pooled(parts, powers), grid)
        per_channel = ChannelLikelihood.of(alone, grid) if alone and powers[1] else None
        return cls(grid, GridLikelihood.of(maps, grid), per_channel, powers, *left_out)

    def __call__(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (n, 2) and covariance (n, 2, 2) for frames (n, k)."""
        parts = [self.likelihood(features)]
        if self.per_channel is not None:
            parts.append(self.per_channel(features))
        return moments(pooled(parts, self.powers), self.grid)

    @cached_property
    def least_known(self) -> FloatArray:
        """(2,) place of the grid at which a press would change the maps most.

        Its answers have the largest prior variance over the noise: the expected information
        ½ Σ log(1 + signal / noise) (MacKay 1992).
        """
        return np.asarray(self.grid[int(self.likelihood.volume.argmax())])


def _left_out(
    learn: Callable[[FloatArray, FloatArray], Likelihood], places: FloatArray, features: FloatArray
) -> FloatArray:
    """(n, g) log-likelihood of each press, from what was learnt without its fold.

    Folds are stretches of time, so that they are as strange to each other as presses to come; but
    where presses follow each other over the skin, a stretch of time is a part of the skin.
    """
    n = len(places)
    folds = min(_FOLDS[n >= _SCARCE], n)
    order = np.arange(n)
    fold = order * folds // n if _in_any_order(places) else order % folds
    parts = [fold == k for k in range(folds)]
    found = [learn(places[~out], features[~out])(features[out]) for out in parts]
    order = np.argsort(np.concatenate([np.flatnonzero(out) for out in parts]))
    return np.asarray(np.concatenate(found)[order])


def _in_any_order(places: FloatArray) -> bool:
    """Whether presses that follow each other are about as far apart as any two."""
    step = float((np.diff(places, axis=0) ** 2).sum(axis=1).mean())
    return step > _NEAR * 2 * float(places.var(axis=0).sum())
