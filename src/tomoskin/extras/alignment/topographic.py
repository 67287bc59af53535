"""Responses over the sheet, fitted to frames of which nobody says where they were pressed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray, reach
from tomoskin.learning import Basis, Likeness, squared_distances

_KEPT = 30.0
"""Weight of the earlier maps in those of another session: each coefficient's, as frames."""

_ROUNDS, _BALANCING = 8, 10
_TEMPERING = 0.75
"""Power of the noise's growth by which likelihoods lose weight. This and the weight of the earlier
maps were chosen on the two sessions of eskin_hydrogel_round."""

_LENGTHS, _REFINED = (0.5, 0.3), 10
"""Length scales of responses that are refined, one after the other, and rounds with each."""

_ROUGH = 0.15
"""Deviation, in radii, of the positions that this begins with."""

_POWER, _REFINED_DIAGONAL, _REFINED_RIDGE = 0.3, 0.2, 0.3
"""Power of a frame's likelihood, part of the noise's covariance that is taken as diagonal, and
noise over signal of the responses. Chosen on two skins."""

_LABEL = 10.0
"""Frames that a labelled one counts for."""

_LEAST = 1e-12


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
        residual = frames @ features**2 - 2 * (pull * answers).sum(axis=0)
        variance = (residual + (count * answers**2).sum(axis=0)) / frames.sum()
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


def whitening(covariance: FloatArray, diagonal: float) -> FloatArray:
    """(k, k) what makes noise of the ``covariance`` independent, with variance 1.

    So large a part of it is taken as ``diagonal``: it was learnt from few frames.
    """
    own = np.diag(np.diag(covariance) + _LEAST)
    size, axes = np.linalg.eigh((1 - diagonal) * covariance + diagonal * own)
    return np.asarray(axes / np.sqrt(np.maximum(size, _LEAST)))


def coefficients_of(
    values: FloatArray, features: FloatArray, ridge: float, weights: FloatArray | None = None
) -> FloatArray:
    """(m, k) of the functions with ``values`` (g, m), by which ``features`` (n, k) are nearest.

    ``weights`` (n, g) say how much each frame counts at each position; without them the n
    positions are the frames' own.
    """
    count = 1.0 if weights is None else weights.sum(axis=0)[:, None]
    pull = features if weights is None else weights.T @ features
    normal = (values * count).T @ values + ridge * np.eye(values.shape[1])
    return np.asarray(np.linalg.solve(normal, values.T @ pull))


def refined(
    features: FloatArray, positions: FloatArray, labels: FloatArray, grid: FloatArray
) -> FloatArray:
    """(n, g) probabilities of the grid's positions for frames with ``features`` (n, k).

    Expectation maximisation begins at ``positions`` (n, 2), all in radii. Responses are smooth
    over the sheet, their noise has a covariance, and touches are everywhere equally frequent.
    ``labels`` (n, 2) are NaN where there is none.
    """
    known = np.flatnonzero(np.isfinite(labels).all(axis=1))
    named = squared_distances(labels[known], grid).argmin(axis=1)
    off = squared_distances(positions, grid)
    weights = np.exp(-0.5 * (off - off.min(axis=1, keepdims=True)) / _ROUGH**2)
    weights = _named(balanced(weights), known, named)
    for length in _LENGTHS:
        values = Basis.of(Likeness(length), grid)(grid)
        for _ in range(_REFINED):
            reach()
            surface, white = _responses(features, weights, values, known)
            weights = _named(balanced(surface.posterior(white)), known, named)
    return weights


def _named(weights: FloatArray, known: IntArray, named: IntArray) -> FloatArray:
    weights[known] = np.eye(weights.shape[1])[named]
    return weights


def _responses(
    features: FloatArray, weights: FloatArray, values: FloatArray, known: IntArray
) -> tuple[TopographicMap, FloatArray]:
    """Responses of frames at positions, and the features in which their noise is white."""
    counted = weights.copy()
    counted[known] *= _LABEL
    coefficients = coefficients_of(values, features, _REFINED_RIDGE, counted)
    answers = values @ coefficients
    mean = weights @ answers
    residual = features - mean
    within = (answers * weights.sum(axis=0)[:, None]).T @ answers - mean.T @ mean
    whiten = whitening((residual.T @ residual + within) / len(features), _REFINED_DIAGONAL)
    ones = np.ones(whiten.shape[1])
    return TopographicMap(values, coefficients @ whiten, ones, _POWER), features @ whiten
