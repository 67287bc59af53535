"""Bayes on a grid: features → how likely each place is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from tomoskin.calibration.locator.maps import ResponseMaps
from tomoskin.calibration.locator.process import squared_distances
from tomoskin.core import FloatArray

POWERS = 1 / np.array([1, 1.5, 2, 3, 4, 6, 9, 14, 20, 30, 45, 70])
"""To which a likelihood may be raised: rows err together in ways that maps do not know."""

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


def pooled(log_likelihoods: Sequence[FloatArray], powers: FloatArray) -> FloatArray:
    """(n, g) probabilities of the grid's places: the product of powers of each likelihood.

    A logarithmic opinion pool (Genest & Zidek 1986); a single one is tempered by its power.
    """
    scaled = powers[0] * log_likelihoods[0]
    for power, part in zip(powers[1:], log_likelihoods[1:], strict=False):
        scaled += power * part
    weight = np.exp(scaled - scaled.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def powers_of(
    log_likelihoods: Sequence[FloatArray], grid: FloatArray, xy: FloatArray
) -> FloatArray:
    """The power of each likelihood at which held-out presses at ``xy`` are likeliest.

    ``log_likelihoods`` (n, g) each, of presses that the maps have not seen.
    """
    nearest = squared_distances(xy, grid).argmin(axis=1)
    rows = np.arange(len(xy))
    tried = POWERS if len(log_likelihoods) == 1 else np.append(0.0, POWERS)
    choices = [np.array(powers) for powers in product(tried, repeat=len(log_likelihoods))]
    score = [
        np.log(pooled(log_likelihoods, powers)[rows, nearest] + _LEAST).sum() for powers in choices
    ]
    return choices[int(np.argmax(score))]


def moments(probability: FloatArray, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (n, 2) and covariance (n, 2, 2) of ``probability`` (n, g) on ``grid`` (g, 2)."""
    mean = probability @ grid
    pairs = (grid[:, :, None] * grid[:, None, :]).reshape(-1, 4)
    second = (probability @ pairs).reshape(-1, 2, 2)
    return mean, second - mean[:, :, None] * mean[:, None, :]
