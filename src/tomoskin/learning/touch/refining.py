"""Positions of touches and the responses over the sheet, each from the other in turn."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray, IntArray, reach
from tomoskin.learning.touch.presses import Features
from tomoskin.learning.touch.process import Basis, Likeness, squared_distances
from tomoskin.learning.touch.rough import levels
from tomoskin.learning.touch.topographic import TopographicMap, balanced

_MOST = 256
"""Features from which only so many directions of largest variance are used."""

_LENGTHS, _ROUNDS = (0.5, 0.3), 10
"""Length scales of the responses, in radii, one after the other, and rounds with each."""

_ROUGH = 0.15
"""Deviation, in radii, of the positions that it begins with."""

_POWER, _DIAGONAL, _RIDGE = 0.3, 0.2, 0.3
"""Power of a frame's likelihood, part of the noise's covariance that is taken as diagonal, and
noise over signal of the responses. Chosen on two skins."""

_LABEL = 10.0
"""Frames that a labelled one counts for."""

_LEAST = 1e-9


def signed_features(dv: FloatArray) -> FloatArray:
    """(n, k) features of the shape of frames (n, n_meas), with their sign, about their mean."""
    shape = dv / levels(dv)
    features: FloatArray = Features.of(shape)(shape)
    features = np.asarray(features - features.mean(axis=0))
    if features.shape[1] <= _MOST:
        return features
    return np.asarray(features @ np.linalg.svd(features, full_matrices=False)[2][:_MOST].T)


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
        for _ in range(_ROUNDS):
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
    count = counted.sum(axis=0)[:, None]
    normal = (values * count).T @ values + _RIDGE * np.eye(values.shape[1])
    coefficients = np.linalg.solve(normal, values.T @ (counted.T @ features))
    answers = values @ coefficients
    mean = weights @ answers
    left, n = features - mean, len(features)
    within = (answers * weights.sum(axis=0)[:, None]).T @ answers - mean.T @ mean
    covariance = (left.T @ left + within) / n
    diagonal = np.diag(np.diag(covariance))
    size, axes = np.linalg.eigh((1 - _DIAGONAL) * covariance + _DIAGONAL * diagonal)
    whiten = axes / np.sqrt(np.maximum(size, _LEAST))
    ones = np.ones(len(size))
    return TopographicMap(values, coefficients @ whiten, ones, _POWER), features @ whiten
