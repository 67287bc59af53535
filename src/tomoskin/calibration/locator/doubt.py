"""How far a place may be wrong: learnt from presses that were left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import minimize
from scipy.stats import chi2

from tomoskin.core import FloatArray

_SPREAD = 1e-3
"""Deviation, in radii of the region, below which no place is known."""

_FREEDOM = 5.0
"""Degrees of freedom of the errors: their tail is heavier than a Gaussian's."""

_HOLDS = 0.9
NINE_IN_TEN = float(chi2.ppf(_HOLDS, 2))
"""Squared length within which nine in ten of a Gaussian's errors lie."""

_RECENT, _FEWEST = 8, 30
"""The last eighth of the presses, or so many, tell whether the skin has changed."""

_CHANCE = 1.6
"""By which few presses may miss farther than many without any change."""

_SPENT = 5
"""Presses that the choice of settings has used up: left-out errors of few presses flatter."""


@dataclass(frozen=True)
class Doubt:
    """Covariance of an answer: parts of the posterior's own, of the experts' dispute, and the same
    for all, with a factor by which nine ellipses in ten hold their press.
    """

    posterior: float
    dispute: float
    everywhere: float

    @classmethod
    def of(cls, errors: FloatArray, posterior: FloatArray, dispute: FloatArray) -> Self:
        """Learn from left-out ``errors`` (n, 2), and (n, 2, 2) of both kinds.

        The parts are those at which the errors are likeliest (a Student density); the common
        factor is split-conformal (Vovk, Gammerman & Shafer 2005). The errors are in the order of
        the presses: where the last ones are larger, the skin has changed, and they count alone.
        """
        size = float((errors**2).mean()) + _SPREAD**2

        def cost(logs: FloatArray) -> float:
            cov = cls(*np.exp(logs))(posterior, dispute)
            far = squared_lengths(errors, cov)
            heavy = (_FREEDOM + 2) * np.log1p(far / _FREEDOM)
            return float((np.log(np.linalg.det(cov)) + heavy).sum()) + 0.05 * float(logs @ logs)

        start = np.array([-1.0, -1.0, np.log(0.3 * size)])
        found = np.exp(minimize(cost, start, method="Nelder-Mead", options={"maxiter": 150}).x)
        far = squared_lengths(errors, cls(*found)(posterior, dispute))
        last = far[-max(len(far) // _RECENT, _FEWEST) :]
        factor = max(_high(far), _high(last) / _CHANCE) / NINE_IN_TEN
        spent = (len(errors) + _SPENT) / max(len(errors) - _SPENT, 1)
        return cls(*(float(x) for x in factor * spent * found))

    def __call__(self, posterior: FloatArray, dispute: FloatArray) -> FloatArray:
        """(n, 2, 2) covariance."""
        common = (self.everywhere + _SPREAD**2) * np.eye(2)
        return np.asarray(self.posterior * posterior + self.dispute * dispute + common)


def dispute_of(told: FloatArray, answer: FloatArray) -> FloatArray:
    """(n, 2, 2) scatter of what the experts say, (experts, n, 2), about the answer (n, 2)."""
    away = told - answer
    return np.asarray(np.einsum("eni,enj->nij", away, away) / len(told))


def _high(far: FloatArray) -> float:
    """The length that nine in ten of such presses keep to."""
    return float(np.quantile(far, min(1.0, _HOLDS * (1 + 1 / len(far)))))


def squared_lengths(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) squared Mahalanobis lengths."""
    solved = np.linalg.solve(covariance, errors[:, :, None])[:, :, 0]
    return np.asarray((errors * solved).sum(axis=1))
