"""Stacking: how much each estimate of a position counts, and how sure the answer is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy.optimize import minimize, nnls
from scipy.special import chdtri

from tomoskin.core import FloatArray
from tomoskin.learning.touch.gaussian_process import (
    Process,
    nine_in_ten,
    squared_distances,
    squared_norms,
)

_SPREAD = 1e-3
"""Deviation, in radii of the region, below which no place is known."""

_FREEDOM = 5.0
"""Degrees of freedom of the errors: their tail is heavier than a Gaussian's."""

NINE_IN_TEN = float(chdtri(2, 0.1))
"""Squared length within which nine in ten of a Gaussian's errors lie."""

_RECENT, _FEWEST = 8, 30
"""The last eighth of the presses, or so many, tell whether the skin has changed."""

_CHANCE = 1.6
"""By which few presses may miss farther than many without any change."""

_SPENT = 7
"""Presses that the choice of settings has used up: left-out errors of few presses flatter."""

_FOLDED = 0.88
"""Part of the variance of left-out errors that those of presses to come have: left-out ones are
estimated from four fifths of the presses. This and the number before were chosen on noPattern,
radial, cam09_05 and the 8 electrodes of eskin_hydrogel_round, 25 to 200 presses."""


@dataclass(frozen=True)
class CalibratedCovariance:
    """Covariance of an answer: parts of the posterior's own, of the experts' disagreement, and
    the same for all, with a factor by which nine ellipses in ten hold their press.
    """

    posterior: float
    disagreement: float
    everywhere: float

    @classmethod
    def of(cls, errors: FloatArray, posterior: FloatArray, disagreement: FloatArray) -> Self:
        """Learn from left-out ``errors`` (n, 2), and (n, 2, 2) of both kinds.

        The parts are those at which the errors are likeliest (a Student density); the common
        factor is split-conformal (Vovk, Gammerman & Shafer 2005). The errors are in the order of
        the presses: where the last ones are larger, the skin has changed, and they count alone.
        """
        size = float((errors**2).mean()) + _SPREAD**2

        def cost(logs: FloatArray) -> float:
            cov = cls(*np.exp(logs))(posterior, disagreement)
            far = squared_lengths(errors, cov)
            heavy = (_FREEDOM + 2) * np.log1p(far / _FREEDOM)
            return float((np.log(np.linalg.det(cov)) + heavy).sum()) + 0.05 * float(logs @ logs)

        start = np.array([-1.0, -1.0, np.log(0.3 * size)])
        optimum = np.exp(minimize(cost, start, method="Nelder-Mead", options={"maxiter": 150}).x)
        far = squared_lengths(errors, cls(*optimum)(posterior, disagreement))
        last = far[-max(len(far) // _RECENT, _FEWEST) :]
        factor = max(nine_in_ten(far), nine_in_ten(last) / _CHANCE) / NINE_IN_TEN
        spent = _FOLDED * (len(errors) + _SPENT) / max(len(errors) - _SPENT, 1)
        return cls(*(float(x) for x in factor * spent * optimum))

    def __call__(self, posterior: FloatArray, disagreement: FloatArray) -> FloatArray:
        """The covariance (n, 2, 2) of each position, in m²."""
        common = (self.everywhere + _SPREAD**2) * np.eye(2)
        return np.asarray(self.posterior * posterior + self.disagreement * disagreement + common)


def disagreement_of(by_expert: FloatArray, answer: FloatArray) -> FloatArray:
    """(n, 2, 2) scatter of what the experts say, (experts, n, 2), about the answer (n, 2)."""
    away = by_expert - answer
    return np.asarray(np.einsum("eni,enj->nij", away, away) / len(by_expert))


def squared_lengths(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) squared Mahalanobis lengths."""
    solved = np.linalg.solve(covariance, errors[:, :, None])[:, :, 0]
    return np.asarray((errors * solved).sum(axis=1))


_PLAIN = (("features",), ("features",))
_BOTH = (("features", "estimate"), ("features",), ("estimate",))

_NEAR = 0.5
"""Unit of the estimates' distances, in radii of the region."""

_BEFORE, _WORTH = np.array([0.64, 0.18, 0.18]), 8
"""Weights before any press, the maps first, and as many presses they count for: from few, weights
are learnt badly."""

_TOGETHER = 1e3
"""Weight of the demand that the parts add up to one."""


@dataclass(frozen=True, eq=False)
class Stacking:
    """The weighted mean of the maps' estimate and of processes on features and estimate.

    Stacked generalisation (Wolpert 1992; weights not negative as in Breiman 1996): the estimates
    that the processes learn from, and the weights, come from presses that were left out.
    """

    features: FloatArray
    estimates: FloatArray
    unit: float
    experts: tuple[Process, ...]
    weights: FloatArray
    left_out_by_expert: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        estimates: FloatArray,
        xy: FloatArray,
    ) -> Self:
        """Learn from ``features`` (n, k), held-out ``estimates`` (n, 2) and places ``xy``."""
        between = squared_distances(features, features)
        unit = _usual(between)
        squares = {
            "features": between / unit,
            "estimate": squared_distances(estimates, estimates) / _NEAR**2,
        }
        experts = (Process.of(_PLAIN, squares, xy), Process.of(_BOTH, squares, xy))
        by_expert = np.stack([estimates, *(expert.left_out for expert in experts)])
        weights = _weights(by_expert, xy)
        return cls(features, estimates, unit, experts, weights, by_expert)

    @property
    def left_out(self) -> FloatArray:
        """(n, 2) what each press would be told without itself."""
        return self.combined(self.left_out_by_expert)

    @cached_property
    def _norms(self) -> FloatArray:
        return squared_norms(self.features)

    def by_expert(self, features: FloatArray, estimates: FloatArray) -> FloatArray:
        """(experts, m, 2) what each says of frames, the maps first."""
        squares = {
            "features": squared_distances(features, self.features, self._norms) / self.unit,
            "estimate": squared_distances(estimates, self.estimates) / _NEAR**2,
        }
        return np.stack([estimates, *(expert(squares) for expert in self.experts)])

    def combined(self, by_expert: FloatArray) -> FloatArray:
        """(m, 2) places from what each says, (experts, m, 2)."""
        return np.asarray(np.tensordot(self.weights, by_expert, 1))


def _usual(between: FloatArray) -> float:
    """The median of squared distances, without those of presses that are alike."""
    return float(np.median(between[between > 0])) if (between > 0).any() else 1.0


def _weights(by_expert: FloatArray, xy: FloatArray) -> FloatArray:
    """Parts that add up to one, of least squared error; far-off presses weigh less (Huber)."""
    errors = np.linalg.norm(by_expert - xy, axis=2).min(axis=0)
    weigh = np.sqrt(1 / np.maximum(errors, np.median(errors) + 1e-9))[:, None]
    columns = (by_expert * weigh).reshape(len(by_expert), -1).T
    design = np.vstack([columns, np.full((1, len(by_expert)), _TOGETHER)])
    weights, _ = nnls(design, np.append((xy * weigh).ravel(), _TOGETHER))
    learnt = len(xy) / (len(xy) + _WORTH)
    return np.asarray(learnt * weights / weights.sum() + (1 - learnt) * _BEFORE)


_SAME = 1e-6
"""Squared distance of features, in parts of the usual, at which two presses are one."""

_APART = 0.05
_FAR, _UNLIKELY = 0.3, 23.0
"""An outlier is so far off, in radii of the region, and its squared Mahalanobis length so large
(one in 100,000 of a Gaussian's)."""


@dataclass(frozen=True)
class Remark:
    """Press ``row``, counted from 0, and what is wrong with its label."""

    row: int
    reason: str


def twins(features: FloatArray, positions: FloatArray, unit: float) -> list[Remark]:
    """Presses with the same data as an earlier one, at another place."""
    between = squared_distances(features, features)
    usual = float(np.median(between)) or 1.0
    apart = squared_distances(positions, positions)
    pairs = np.argwhere(np.triu((between < _SAME * usual) & (apart > _APART**2), 1))
    remarks: dict[int, Remark] = {}
    for first, second in pairs.tolist():
        far = 1e3 * unit * float(np.sqrt(apart[first, second]))
        remarks.setdefault(
            second, Remark(second, f"has the same data as press {first}, {far:.0f} mm away")
        )
    return list(remarks.values())


def outliers(
    estimates: FloatArray, positions: FloatArray, covariance: FloatArray, unit: float
) -> list[Remark]:
    """Presses that lie far from where the others say they are: ``estimates`` (n, 2) left out."""
    error = estimates - positions
    length = np.linalg.norm(error, axis=1)
    rows = np.flatnonzero((squared_lengths(error, covariance) > _UNLIKELY) & (length > _FAR))
    return [
        Remark(row, f"according to the other presses it was {1e3 * unit * length[row]:.0f} mm away")
        for row in rows.tolist()
    ]
