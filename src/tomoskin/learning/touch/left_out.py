"""What a calibration's presses say of it when each is left out in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.presses import equally_hard

_GUESS, _GUESS_OF_FEW = 0.75, 2.5
"""Part of a guess's error above which nothing was learnt; less by the second over the number of
presses. Noise gives 0.5 to 0.85 with 8 presses, 0.8 to 0.92 with 10, 0.93 to 0.99 from 20 on."""


@dataclass(frozen=True)
class LeftOut:
    """How far a locator's positions may be trusted.

    Attributes
    ----------
    guessed
        Mean m by which presses are missed when the middle of the others is the answer.
    is_guess
        Whether the locator misses them about as far: noise alone gives such errors.
    drift
        How many times as far as usual the last eighth of the presses is missed (medians).
    one_force
        Whether all presses were about equally hard. Errors and covariances then hold for such
        presses alone, and softer or harder ones are missed by more.
    """

    guessed: float
    is_guess: bool
    drift: float
    one_force: bool

    @classmethod
    def of(cls, locator: Locator) -> Self:
        """Of the presses that ``locator`` was learnt from."""
        presses, errors = locator.presses, locator.errors
        away = np.linalg.norm(presses.xy - presses.xy.mean(axis=0), axis=1)
        guessed = float(away.mean() * len(away) / max(len(away) - 1, 1))
        limit = _GUESS - _GUESS_OF_FEW / len(away)
        newest = errors[-max(len(errors) // 8, 5) :]
        return cls(
            guessed=guessed,
            is_guess=bool(errors.mean() > limit * guessed),
            drift=float(np.median(newest) / np.median(errors)),
            one_force=equally_hard(presses, locator.region.scaled(presses.xy)),
        )
