"""Bayes on a grid: features → how likely each place is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.touch.locator.kernel import squared_distances
from tomoskin.touch.locator.maps import ResponseMaps

TEMPERATURES = np.array([1, 1.5, 2, 3, 4, 6, 9, 14, 20, 30, 45, 70])
"""By which a log-likelihood may be divided: rows err together in ways that maps do not know."""

_LEAST = 1e-6


@dataclass(frozen=True, eq=False)
class GridLikelihood:
    """Maps read at the places of a grid, ready for frames.

    A feature vector of k values has a Student density of k degrees of freedom about each place's
    answer: the covariances were learnt from few presses, and a frame far from every map must
    not be called certain.
    """

    maps: ResponseMaps
    precision: FloatArray
    answer: FloatArray
    offset: FloatArray
    volume: FloatArray

    @classmethod
    def of(cls, maps: ResponseMaps, places: FloatArray) -> Self:
        """For the grid ``places`` (g, 2)."""
        mean, variance = maps.at(places)
        answer = mean / variance
        offset = (mean * answer).sum(axis=1)
        volume = np.log(variance).sum(axis=1)
        return cls(
            maps, np.ascontiguousarray(1 / variance.T), answer.T.copy(), offset, 0.5 * volume
        )

    def __call__(self, features: FloatArray) -> FloatArray:
        """(n, g) log-likelihood of each place, up to a constant of the frame."""
        f = self.maps.whitened(features)
        k = f.shape[1]
        misfit = (f * f) @ self.precision - 2 * (f @ self.answer) + self.offset
        return np.asarray(-k * np.log1p(np.maximum(misfit, 0.0) / k) - self.volume)


def tempered(log_likelihood: FloatArray, temperature: float) -> FloatArray:
    """(n, g) probabilities of the grid's places."""
    scaled = log_likelihood / temperature
    weight = np.exp(scaled - scaled.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def temperature_of(log_likelihood: FloatArray, grid: FloatArray, xy: FloatArray) -> float:
    """The temperature at which held-out presses at ``xy`` are likeliest.

    ``log_likelihood`` (n, g) of presses that the maps have not seen.
    """
    nearest = squared_distances(xy, grid).argmin(axis=1)
    rows = np.arange(len(xy))
    score = [
        np.log(tempered(log_likelihood, t)[rows, nearest] + _LEAST).sum() for t in TEMPERATURES
    ]
    return float(TEMPERATURES[int(np.argmax(score))])


def moments(probability: FloatArray, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (n, 2) and covariance (n, 2, 2) of ``probability`` (n, g) on ``grid`` (g, 2)."""
    mean = probability @ grid
    pairs = (grid[:, :, None] * grid[:, None, :]).reshape(-1, 4)
    second = (probability @ pairs).reshape(-1, 2, 2)
    return mean, second - mean[:, :, None] * mean[:, None, :]
