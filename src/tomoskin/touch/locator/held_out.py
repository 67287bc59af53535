"""The maps' own estimate of a place, for presses that they have not seen and for frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.touch.locator.kernel import Likeness
from tomoskin.touch.locator.maps import ResponseMaps
from tomoskin.touch.locator.posterior import GridLikelihood, moments, temperature_of, tempered

_LENGTHS = (0.16, 0.22, 0.32, 0.45, 0.65)
"""Length scales of a response that are tried, in radii of the region."""

_FOLDS = 5


@dataclass(frozen=True, eq=False)
class Estimates:
    """Posterior mean and covariance of a place.

    ``left_out`` (n, 2) and ``left_out_spread`` (n, 2, 2) are those of the presses themselves,
    each from maps learnt without its fifth of them.
    """

    grid: FloatArray
    likelihood: GridLikelihood
    temperature: float
    left_out: FloatArray
    left_out_spread: FloatArray

    @classmethod
    def of(cls, features: FloatArray, places: FloatArray, grid: FloatArray) -> Self:
        """Learn the maps; the length scale by evidence, the temperature by left-out presses."""
        tried = [ResponseMaps.of(Likeness(x), places, features) for x in _LENGTHS]
        maps = max(tried, key=lambda m: m.evidence)
        log_likelihood = np.empty((len(places), len(grid)))
        fold = np.arange(len(places)) % _FOLDS
        for k in range(_FOLDS):
            out = fold == k
            others = ResponseMaps.of(maps.basis.likeness, places[~out], features[~out])
            log_likelihood[out] = GridLikelihood.of(others, grid)(features[out])
        temperature = temperature_of(log_likelihood, grid, places)
        left_out = moments(tempered(log_likelihood, temperature), grid)
        return cls(grid, GridLikelihood.of(maps, grid), temperature, *left_out)

    def __call__(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (n, 2) and covariance (n, 2, 2) for frames (n, k)."""
        return moments(tempered(self.likelihood(features), self.temperature), self.grid)

    @cached_property
    def least_known(self) -> FloatArray:
        """(2,) place of the grid at which a press would change the maps most.

        Its answers have the largest prior variance over the noise: the expected information
        ½ Σ log(1 + signal / noise) (MacKay 1992).
        """
        return np.asarray(self.grid[int(self.likelihood.volume.argmax())])
