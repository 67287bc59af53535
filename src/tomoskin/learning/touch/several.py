"""One touch, two, or too close to say: by superposition of what single presses have taught."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import Detection, FloatArray, IntArray
from tomoskin.learning.touch.gaussian_process import moments, squared_distances
from tomoskin.learning.touch.locator import Locator, detection_at
from tomoskin.learning.touch.maps import ResponseMaps
from tomoskin.learning.touch.presses import frames

_PLACES = 160
"""Places that a touch is looked for at; what is between them is their mean."""

_GAINS = np.array([0.3, 0.5, 0.7, 1.0, 1.4, 2.0])
"""How many times as strong as the presses a touch may be."""

_SEEDS = 8
"""Places that the first of two touches is tried at; from each both are sought in turn."""

_CLOSE = 1.5
"""Touches nearer than so many length scales of the maps are too close to separate."""

_SURE = 3.0
"""Log-likelihood by which two touches must explain a frame better than one, or than two that are
close: twenty to one. Likelihoods are tempered as the locator's own are."""

_USUAL = 0.99
"""A frame that one touch explains as well as it does so many of the presses is of one touch."""


@dataclass(frozen=True, eq=False)
class TouchHypotheses:
    """Log-likelihoods of a frame: one touch, two close together, two apart; and the latter two.

    ``positions`` (2, 2) and ``spread`` (2, 2, 2) are m and m²; ``gains`` (2,).
    """

    one: float
    close: float
    apart: float
    positions: FloatArray
    spread: FloatArray
    gains: FloatArray

    @property
    def says(self) -> str:
        """ "one", "close" or "two": what is not sure is the lesser claim."""
        if self.apart - max(self.one, self.close) > _SURE:
            return "two"
        return "close" if max(self.close, self.apart) - self.one > _SURE else "one"


@dataclass(frozen=True, eq=False)
class Several:
    """Two touches on a skin whose single presses a :class:`Locator` has learnt.

    Changes of two light touches add up: dv(a, b) = dv(a) + dv(b), first order in the change. The
    locator's maps tell dv(x) at every place; with a strength for each touch they are asked which
    pair explains a frame, and how much better than one touch does.

    Attributes
    ----------
    locator
        What single presses have taught.
    positions, changes
        (g, 2) in the locator's unit; (g, k) dv there over the features' scale.
    variance
        (k,) of whitened features about the maps, mean over the places.
    usual
        Log-likelihood of one touch below which hardly a press lies.
    """

    locator: Locator
    positions: FloatArray
    changes: FloatArray
    variance: FloatArray
    usual: float

    @classmethod
    def of(cls, locator: Locator) -> Self:
        """Read the maps of ``locator``."""
        maps, grid = _maps(locator), locator.estimates.grid
        positions = grid[_spread_out(grid, _PLACES)]
        changes, variance = np.sinh(maps.features_at(positions)), maps.at(positions)[1]
        new = cls(locator, positions, changes, variance.mean(axis=0), -np.inf)
        presses = locator.features(locator.presses.dv)
        single = np.array([new._single(frame).max() for frame in presses])
        return cls(
            locator, positions, changes, new.variance, float(np.quantile(single, 1 - _USUAL))
        )

    def __call__(self, dv: ArrayLike) -> list[tuple[Detection, ...]]:
        """Readings of each frame (n, n_meas): two, or one, which may be ``close``.

        A frame that one touch explains as well as the presses is not searched for two. Raises
        DataError as :meth:`Locator.predict` does.
        """
        data = frames(dv, self.locator.presses.dv.shape[1])
        positions, covariance = self.locator.predict(data)
        strength = self.locator.strength(data)
        return [
            self._of_frame(frame, positions[k], covariance[k], float(strength[k]))
            for k, frame in enumerate(self.locator.features(data))
        ]

    def _of_frame(
        self, frame: FloatArray, position: FloatArray, covariance: FloatArray, strength: float
    ) -> tuple[Detection, ...]:
        """Of features (k,); the others are what the locator says of one touch."""
        if self._single(frame).max() >= self.usual:
            return (detection_at(position, covariance, strength),)
        evidence = self.evidence(frame)
        if evidence.says == "two":
            pair = zip(evidence.positions, evidence.spread, evidence.gains.tolist(), strict=True)
            return tuple(detection_at(*one) for one in pair)
        close = evidence.says == "close"
        return (replace(detection_at(position, covariance, strength), close=close),)

    def evidence(self, frame: FloatArray) -> TouchHypotheses:
        """What the features (k,) of one frame say."""
        single = self._single(frame)
        best = {False: (-np.inf, 0, 0), True: (-np.inf, 0, 0)}
        tried: set[int] = set()
        for seed in self._seeds(single):
            fixed = seed
            while fixed not in tried:
                tried.add(fixed)
                given = self._log_likelihood(frame, fixed)
                for kind, (value, other) in self._best(given, fixed).items():
                    best[kind] = max(best[kind], (value, fixed, other))
                fixed = int(given.argmax())
        close, apart = best[False], best[True]
        pair = [self._about(frame, apart[2], apart[1]), self._about(frame, apart[1], apart[2])]
        return TouchHypotheses(
            one=float(single.max()),
            close=close[0],
            apart=apart[0],
            positions=self.locator.region.metres(np.stack([mean for mean, _ in pair])),
            spread=self.locator.region.unit**2 * np.stack([cov for _, cov in pair]),
            gains=_GAINS[np.array(apart[1:]) % len(_GAINS)],
        )

    def _single(self, frame: FloatArray) -> FloatArray:
        """(g · gains,) log-likelihood of one touch; index place · gains + gain."""
        return self._likely(frame, self._alone)

    def _log_likelihood(self, frame: FloatArray, other: int) -> FloatArray:
        """The same of a touch beside another of that index."""
        changes: NDArray[np.float32] = np.arcsinh(self._stronger + self._stronger[other])
        return self._likely(frame, changes @ self._whiten)

    def _likely(self, frame: FloatArray, expected: NDArray[np.float32]) -> FloatArray:
        away = expected - frame.astype(np.float32) @ self._whiten
        k = away.shape[1]
        misfit = np.einsum("gk,gk->g", away, away).astype(np.float64)
        return np.asarray(-self.locator.estimates.powers[0] * k * np.log1p(misfit / k))

    @cached_property
    def _whiten(self) -> NDArray[np.float32]:
        """(k, k) to coordinates in which features err about the maps independently, by 1."""
        whiten = _maps(self.locator).whiten / np.sqrt(self.variance)
        return np.asarray(whiten, dtype=np.float32)

    @cached_property
    def _stronger(self) -> NDArray[np.float32]:
        """(g · gains, k) changes of touches of every strength."""
        rows = self.changes[:, None] * _GAINS[:, None]
        return np.asarray(rows.reshape(-1, self.changes.shape[1]), dtype=np.float32)

    @cached_property
    def _alone(self) -> NDArray[np.float32]:
        return np.asarray(np.arcsinh(self._stronger) @ self._whiten)

    def _seeds(self, single: FloatArray) -> Iterator[int]:
        """The likeliest touch, then others spread over the skin."""
        by_place = single.reshape(-1, len(_GAINS))
        first = int(by_place.max(axis=1).argmax())
        for place in _spread_out(self.positions, _SEEDS, first):
            yield int(place) * len(_GAINS) + int(by_place[place].argmax())

    def _best(self, given: FloatArray, fixed: int) -> dict[bool, tuple[float, int]]:
        """Best partner of the touch ``fixed``, close to it and apart from it."""
        apart = self._is_apart[fixed // len(_GAINS)]
        best = {}
        for kind in (False, True):
            rows = np.flatnonzero(np.repeat(apart == kind, len(_GAINS)))
            if len(rows):
                top = int(rows[given[rows].argmax()])
                best[kind] = (float(given[top]), top)
        return best

    @cached_property
    def _is_apart(self) -> NDArray[np.bool_]:
        limit = _CLOSE * _maps(self.locator).basis.likeness.length
        return squared_distances(self.positions, self.positions) > limit**2

    def _about(self, frame: FloatArray, fixed: int, near: int) -> tuple[FloatArray, FloatArray]:
        """Mean (2,) and covariance (2, 2) of a touch about ``near``, the other one given."""
        given = self._log_likelihood(frame, fixed)
        limit = _maps(self.locator).basis.likeness.length
        centre = self.positions[near // len(_GAINS)]
        around = squared_distances(self.positions, centre[None])[:, 0] <= limit**2
        weight = np.exp(given - given.max()).reshape(-1, len(_GAINS)).sum(axis=1) * around
        mean, covariance = moments((weight / weight.sum())[None], self.positions)
        return mean[0], covariance[0] + np.eye(2) * np.pi / (12 * _PLACES)


def _maps(locator: Locator) -> ResponseMaps:
    return locator.estimates.likelihood.maps


def _spread_out(positions: FloatArray, count: int, first: int = 0) -> IntArray:
    """Indices of ``count`` places, each the farthest from those before (Gonzalez 1985)."""
    chosen = [first]
    nearest = squared_distances(positions, positions[[first]])[:, 0]
    while len(chosen) < min(count, len(positions)):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, squared_distances(positions, positions[[chosen[-1]]])[:, 0])
    return np.array(chosen)
