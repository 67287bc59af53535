"""Stacking: how much each of two estimates of a position counts, and how sure the answer is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy.optimize import minimize
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
    """Covariance of an answer: a part of the posterior's own, and the same for all, with a factor
    by which nine ellipses in ten hold their press.
    """

    posterior: float
    everywhere: float

    @classmethod
    def of(cls, errors: FloatArray, posterior: FloatArray) -> Self:
        """Learn from left-out ``errors`` (n, 2), and the ``posterior`` (n, 2, 2) of each.

        The parts are those at which the errors are likeliest (a Student density); the common
        factor is split-conformal (Vovk, Gammerman & Shafer 2005). The errors are in the order of
        the presses: where the last ones are larger, the skin has changed, and they count alone.
        """
        size = float((errors**2).mean()) + _SPREAD**2

        def cost(logs: FloatArray) -> float:
            cov = cls(*np.exp(logs))(posterior)
            far = squared_lengths(errors, cov)
            heavy = (_FREEDOM + 2) * np.log1p(far / _FREEDOM)
            return float((np.log(np.linalg.det(cov)) + heavy).sum()) + 0.05 * float(logs @ logs)

        start = np.array([-1.0, np.log(0.3 * size)])
        optimum = np.exp(minimize(cost, start, method="Nelder-Mead", options={"maxiter": 150}).x)
        far = squared_lengths(errors, cls(*optimum)(posterior))
        last = far[-max(len(far) // _RECENT, _FEWEST) :]
        factor = max(nine_in_ten(far), nine_in_ten(last) / _CHANCE) / NINE_IN_TEN
        spent = _FOLDED * (len(errors) + _SPENT) / max(len(errors) - _SPENT, 1)
        return cls(*(float(x) for x in factor * spent * optimum))

    def __call__(self, posterior: FloatArray) -> FloatArray:
        """The covariance (n, 2, 2) of each position, in m²."""
        common = (self.everywhere + _SPREAD**2) * np.eye(2)
        return np.asarray(self.posterior * posterior + common)


def squared_lengths(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) squared Mahalanobis lengths."""
    solved = np.linalg.solve(covariance, errors[:, :, None])[:, :, 0]
    return np.asarray((errors * solved).sum(axis=1))


_TERMS = (("features", "estimate"), ("features",), ("estimate",))

_NEAR = 0.5
"""Unit of the estimates' distances, in radii of the region."""

_BEFORE, _WORTH = 0.36, 8
"""Part of the process before any press, and as many presses it counts for: from few, the part is
learnt badly."""


@dataclass(frozen=True, eq=False)
class Stacking:
    """The weighted mean of the maps' estimate and of a process on features and estimate.

    Stacked generalisation (Wolpert 1992): the estimates that the process learns from, and its
    ``part`` of the answer, come from presses that were left out. ``left_out`` (n, 2) is what each
    press would be told without itself.
    """

    features: FloatArray
    estimates: FloatArray
    unit: float
    process: Process
    part: float
    left_out: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        between: FloatArray,
        estimates: FloatArray,
        xy: FloatArray,
    ) -> Self:
        """Learn from ``features`` (n, k), their squared distances ``between`` each other (n, n),
        held-out ``estimates`` (n, 2) and places ``xy``."""
        unit = _usual(between)
        squares = {
            "features": between / unit,
            "estimate": squared_distances(estimates, estimates) / _NEAR**2,
        }
        process = Process.of(_TERMS, squares, xy)
        part = _part(estimates, process.left_out, xy)
        left_out = estimates + part * (process.left_out - estimates)
        return cls(features, estimates, unit, process, part, left_out)

    @cached_property
    def _norms(self) -> FloatArray:
        return squared_norms(self.features)

    def __call__(self, features: FloatArray, estimates: FloatArray) -> FloatArray:
        """(m, 2) places of frames with ``features`` (m, k) of which the maps say ``estimates``."""
        squares = {
            "features": squared_distances(features, self.features, self._norms) / self.unit,
            "estimate": squared_distances(estimates, self.estimates) / _NEAR**2,
        }
        return estimates + self.part * (self.process(squares) - estimates)


def _usual(between: FloatArray) -> float:
    """The median of squared distances, without those of presses that are alike."""
    return float(np.median(between[between > 0])) if (between > 0).any() else 1.0


def _part(estimates: FloatArray, others: FloatArray, xy: FloatArray) -> float:
    """Part of the ``others`` of least squared error; far-off presses weigh less (Huber)."""
    errors = np.minimum(*(np.linalg.norm(said - xy, axis=1) for said in (estimates, others)))
    weigh = 1 / np.maximum(errors, np.median(errors) + 1e-9)[:, None]
    way = others - estimates
    best = float((weigh * way * (xy - estimates)).sum() / ((weigh * way**2).sum() + _SPREAD**2))
    learnt = len(xy) / (len(xy) + _WORTH)
    return learnt * min(max(best, 0.0), 1.0) + (1 - learnt) * _BEFORE


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


def twins(between: FloatArray, positions: FloatArray, unit: float) -> list[Remark]:
    """Presses with the same data as an earlier one, at another place, by the squared distances
    ``between`` their features (n, n)."""
    usual = _usual(between)
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
