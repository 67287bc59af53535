"""Several ways from features to a place, weighed by what each does on presses left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import nnls

from tomoskin.calibration.locator.kernel import squared_distances
from tomoskin.calibration.locator.process import Distances, Process
from tomoskin.core import FloatArray

_PLAIN = (("features",), ("features",))
_BOTH = (("features", "estimate"), ("features",), ("estimate",))

_NEAR = 0.5
"""Unit of the estimates' distances, in radii of the region."""

_BEFORE, _WORTH = np.array([0.55, 0.15, 0.15, 0.15]), 8
"""Weights before any press, the maps first, and as many presses they count for: from few, weights
are learnt badly."""

_TOGETHER = 1e3
"""Weight of the demand that the parts add up to one."""


@dataclass(frozen=True, eq=False)
class Expert:
    """A process that predicts a place: from ``start`` it learns the rest, in units of ``scale``."""

    process: Process
    from_estimate: bool
    centre: FloatArray
    scale: float

    @classmethod
    def of(
        cls,
        terms: tuple[tuple[str, ...], ...],
        squares: Distances,
        xy: FloatArray,
        estimate: FloatArray | None,
        like: Expert | None,
    ) -> Self:
        """Learn ``xy`` (n, 2), or what is left of it after ``estimate`` (n, 2).

        An expert that is ``like`` another has its hyper-parameters.
        """
        rest = xy if estimate is None else xy - estimate
        centre = rest.mean(axis=0) if estimate is None else np.zeros(2)
        scale = float((rest - centre).std()) or 1.0
        targets = (rest - centre) / scale
        if like is None:
            process = Process.of(terms, squares, targets)
        else:
            process = Process.known(terms, like.process.logs, squares, targets)
        return cls(process, estimate is not None, centre, scale)

    def left_out(self, estimate: FloatArray) -> FloatArray:
        """(n, 2) what each press would be told without itself."""
        return self._placed(self.process.left_out, estimate)

    def __call__(self, squares: Distances, estimate: FloatArray) -> FloatArray:
        """(m, 2) places of frames."""
        return self._placed(self.process(squares), estimate)

    def _placed(self, answer: FloatArray, estimate: FloatArray) -> FloatArray:
        start = estimate if self.from_estimate else self.centre
        return np.asarray(start + self.scale * answer)


@dataclass(frozen=True, eq=False)
class Stack:
    """The weighted mean of the maps' estimate and of processes on features and estimate.

    Stacked generalisation (Wolpert 1992; weights not negative as in Breiman 1996): the estimates
    that the processes learn from, and the weights, come from presses that were left out.
    """

    features: FloatArray
    estimates: FloatArray
    unit: float
    experts: tuple[Expert, ...]
    weights: FloatArray
    left_out_told: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        estimates: FloatArray,
        xy: FloatArray,
        like: Stack | None = None,
    ) -> Self:
        """Learn from ``features`` (n, k), held-out ``estimates`` (n, 2) and places ``xy``.

        A stack that is ``like`` another has its hyper-parameters; weights are always learnt.
        """
        between = squared_distances(features, features)
        unit = like.unit if like else _usual(between)
        squares = {
            "features": between / unit,
            "estimate": squared_distances(estimates, estimates) / _NEAR**2,
        }
        known = like.experts if like else (None, None, None)
        experts = (
            Expert.of(_PLAIN, squares, xy, None, known[0]),
            Expert.of(_BOTH, squares, xy, None, known[1]),
            Expert.of(_BOTH, squares, xy, estimates, known[2]),
        )
        told = np.stack([estimates, *(e.left_out(estimates) for e in experts)])
        weights = _weights(told, xy)
        return cls(features, estimates, unit, experts, weights, told)

    @property
    def left_out(self) -> FloatArray:
        """(n, 2) what each press would be told without itself."""
        return self.combined(self.left_out_told)

    def told(self, features: FloatArray, estimates: FloatArray) -> FloatArray:
        """(experts, m, 2) what each says of frames, the maps first."""
        squares = {
            "features": squared_distances(features, self.features) / self.unit,
            "estimate": squared_distances(estimates, self.estimates) / _NEAR**2,
        }
        return np.stack([estimates, *(expert(squares, estimates) for expert in self.experts)])

    def combined(self, told: FloatArray) -> FloatArray:
        """(m, 2) places from what each says, (experts, m, 2)."""
        return np.asarray(np.tensordot(self.weights, told, 1))


def _usual(between: FloatArray) -> float:
    """The median of squared distances, without those of presses that are alike."""
    return float(np.median(between[between > 0])) if (between > 0).any() else 1.0


def _weights(told: FloatArray, xy: FloatArray) -> FloatArray:
    """Parts that add up to one, of least squared error; far-off presses weigh less (Huber)."""
    errors = np.linalg.norm(told - xy, axis=2).min(axis=0)
    weigh = np.sqrt(1 / np.maximum(errors, np.median(errors) + 1e-9))[:, None]
    columns = (told * weigh).reshape(len(told), -1).T
    design = np.vstack([columns, np.full((1, len(told)), _TOGETHER)])
    weights, _ = nnls(design, np.append((xy * weigh).ravel(), _TOGETHER))
    learnt = len(xy) / (len(xy) + _WORTH)
    return np.asarray(learnt * weights / weights.sum() + (1 - learnt) * _BEFORE)
