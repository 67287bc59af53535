"""Responses over the sheet, fitted to frames of which nobody says where they were pressed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.touch.process import Basis, Likeness, squared_distances

_LENGTH = 0.4
"""Length scale of a response, in radii of the region."""

_RIDGE = 0.1
"""Noise over signal of maps learnt from labels."""

_KEPT = 30.0
"""Weight of the earlier maps in those of another session: each coefficient's, as frames."""

_ROUNDS, _BALANCING = 8, 10
_TEMPERING = 0.75
"""Power of the noise's growth by which likelihoods lose weight. This and the weight of the earlier
maps were chosen on the two sessions of eskin_hydrogel_round."""

_DIAGONAL = 0.1
"""Part of the noise's covariance that is taken as diagonal."""

_LEAST = 1e-12


def surface_basis(grid: FloatArray) -> Basis:
    """Functions of the position that hold a response."""
    return Basis.of(Likeness(_LENGTH), grid)


@dataclass(frozen=True, eq=False)
class TopographicMap:
    """A generative topographic mapping (Bishop, Svensén & Williams 1998) of whitened features.

    A frame is Gaussian about the response of its position; positions are those of a grid, all as
    likely. ``values`` (g, m) of a basis on the grid, ``coefficients`` (m, k) of the responses,
    ``variance`` (k,) of the noise, ``power`` to which a frame's likelihood is raised: features err
    together.
    """

    values: FloatArray
    coefficients: FloatArray
    variance: FloatArray
    power: float

    @property
    def answers(self) -> FloatArray:
        """(g, k) responses at the grid's positions."""
        return np.asarray(self.values @ self.coefficients)

    @property
    def noise(self) -> float:
        """Geometric mean of the noise's variance."""
        return float(np.exp(np.log(self.variance).mean()))

    def posterior(self, features: FloatArray) -> FloatArray:
        """(n, g) probabilities of the grid's positions for features (n, k)."""
        scale = 1 / np.sqrt(self.variance)
        misfit = squared_distances(features * scale, self.answers * scale)
        weight = np.exp(-0.5 * self.power * (misfit - misfit.min(axis=1, keepdims=True)))
        return np.asarray(weight / weight.sum(axis=1, keepdims=True))

    def fitted(
        self, features: FloatArray, named: IntArray, *, everywhere: bool
    ) -> tuple[Self, float]:
        """The same fitted to frames of another session by expectation maximisation.

        Also how large their noise is; that of the answer is as large as before, its features' in
        proportion to each other.

        Parameters
        ----------
        features
            (n, k).
        named
            (n,) number on the grid of a frame whose position is known, −1 otherwise.
        everywhere
            Whether touches were everywhere about as often.
        """
        fit, some, noise = self, named >= 0, self.noise
        for _ in range(_ROUNDS):
            weights = fit.posterior(features)
            weights = balanced(weights) if everywhere else weights
            weights[some] = np.eye(len(self.values))[named[some]]
            fit = fit._renewed(features, weights, self.coefficients)
            noise = fit.noise
            fit = replace(fit, variance=fit.variance * (self.noise / noise))
        return fit, noise

    def _renewed(self, features: FloatArray, weights: FloatArray, kept: FloatArray) -> Self:
        """With the responses of frames at positions, one step of the maximisation.

        Parameters
        ----------
        features, weights
            (n, k), and (n, g) how much each frame counts at each position.
        kept
            (m, k) coefficients of the earlier responses.
        """
        count, frames = weights.sum(axis=0)[:, None], weights.sum(axis=1)
        pull = weights.T @ features
        normal = (self.values * count).T @ self.values + _KEPT * np.eye(self.values.shape[1])
        coefficients = np.linalg.solve(normal, self.values.T @ pull + _KEPT * kept)
        answers = self.values @ coefficients
        left = frames @ features**2 - 2 * (pull * answers).sum(axis=0)
        variance = (left + (count * answers**2).sum(axis=0)) / frames.sum()
        return replace(self, coefficients=coefficients, variance=np.maximum(variance, _LEAST))

    def tempered(self, grown: float) -> Self:
        """With likelihoods of less weight where the noise has ``grown``."""
        return replace(self, power=self.power * min(grown**-_TEMPERING, 1.0))


def balanced(weights: FloatArray) -> FloatArray:
    """(n, g) probabilities whose sums over frames are nearly alike (Sinkhorn & Knopp 1967)."""
    target = len(weights) / weights.shape[1]
    for _ in range(_BALANCING):
        weights = weights * (target / np.maximum(weights.sum(axis=0), _LEAST))
        weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), _LEAST)
    return weights


def covariances(weights: FloatArray, grid: FloatArray) -> FloatArray:
    """(n, 2, 2) of positions that are those of ``grid`` (g, 2) with probabilities (n, g)."""
    mean = weights @ grid
    second = (weights @ (grid[:, :, None] * grid[:, None]).reshape(-1, 4)).reshape(-1, 2, 2)
    return np.asarray(second - mean[:, :, None] * mean[:, None])


def learnt_surface(
    basis: Basis, positions: FloatArray, features: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients (m, k) of whitened responses, and the whitening (k, k), from labelled presses.

    ``features`` (n, k) about their mean, ``positions`` (n, 2) in radii of the region.
    """
    values = basis(positions)
    normal = values.T @ values + _RIDGE * np.eye(values.shape[1])
    coefficients = np.linalg.solve(normal, values.T @ features)
    left = features - values @ coefficients
    covariance = left.T @ left / len(left)
    diagonal = np.diag(covariance) + _LEAST
    covariance = (1 - _DIAGONAL) * covariance + _DIAGONAL * np.diag(diagonal)
    size, axes = np.linalg.eigh(covariance)
    whiten = axes / np.sqrt(np.maximum(size, _LEAST))
    return coefficients @ whiten, whiten


def likeliest_power(parts: Sequence[tuple[TopographicMap, FloatArray, IntArray]]) -> float:
    """The power at which left-out presses are likeliest: maps, features and numbers on the grid."""
    powers = np.geomspace(0.01, 1.0, 14)
    score = np.zeros(len(powers))
    for surface, features, numbers in parts:
        for k, power in enumerate(powers):
            weights = replace(surface, power=float(power)).posterior(features)
            score[k] += np.log(weights[np.arange(len(numbers)), numbers] + 1e-6).sum()
    return float(powers[int(score.argmax())])
