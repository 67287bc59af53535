"""Rough positions of unlabelled touches, from how strongly each row answers to each of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtri

from tomoskin.core import FloatArray
from tomoskin.learning.touch.process import Basis, Likeness, squared_distances
from tomoskin.learning.touch.topographic import TopographicMap, balanced
from tomoskin.model.forward import ForwardModel

_SMALL = 0.05
"""Below this part of a row's median a change is lost in noise."""

_NEAR_CELLS = 4
_FREEDOM = 12.0
"""Independent features in a frame: its rows err together."""

_LENGTH, _RIDGE = 0.3, 0.1
"""Length scale, in radii, of the expected scores between the grid's positions."""

_HELD, _STEPS = 0.02, 40
"""Weight that holds a map of the positions to what it was, and steps in which it is found."""

_LEAST = 1e-12


def levels(dv: FloatArray) -> FloatArray:
    """(n, 1) how large each frame of ``dv`` (n, k) is: force, and how sensitive the sheet is."""
    return np.asarray(np.exp(np.nanmean(_logarithms(dv), axis=1, keepdims=True)))


def normal_scores(dv: FloatArray) -> FloatArray:
    """(n, k) rank of each frame in each row, as a normal deviate; 0 where a value is missing.

    Of the sizes of ``dv`` (n, k) over each frame's level. Ranks know no gain of a row and no law
    of the material.
    """
    level = _logarithms(dv)
    level = level - np.nanmean(level, axis=1, keepdims=True)
    present = np.isfinite(level)
    rank = np.where(present, level, np.inf).argsort(axis=0).argsort(axis=0)
    last = np.maximum(present.sum(axis=0), 1) - 0.5
    return np.asarray(np.where(present, ndtri((rank + 0.5).clip(max=last) / (last + 0.5)), 0.0))


def expected_sizes(model: ForwardModel, conductivity: float, positions: FloatArray) -> FloatArray:
    """(g, n_meas) how strongly each row should answer at ``positions`` (g, 2) m.

    The current density of its drive times the field of its measurement on an even sheet. The
    angle between the two does not count: sheets that are nothing like the model do not keep to it.
    """
    mesh, pattern = model.mesh, model.pattern
    gradient = model.solve(conductivity).gradient
    drive, measure = (
        gradient[pairs[:, 0]] - gradient[pairs[:, 1]] for pairs in (pattern.drive, pattern.measure)
    )
    product = np.linalg.norm(drive, axis=1) * np.linalg.norm(measure, axis=1)
    sizes = np.log(np.maximum(product / mesh.volumes, np.finfo(float).tiny))
    away = squared_distances(positions, mesh.centroids[:, :2])
    near = np.argpartition(away, _NEAR_CELLS, axis=1)[:, :_NEAR_CELLS]
    return np.asarray(np.exp(sizes.T[near].mean(axis=1)))


@dataclass(frozen=True, eq=False)
class Ranked:
    """Frames' scores (n, k), and those that are ``expected`` (g, k) on a grid.

    Attributes
    ----------
    positions
        (n, 2) where the frames were, in radii, by their scores alone.
    alike
        Correlation of the scores with those that are expected.
    """

    scores: FloatArray
    expected: FloatArray
    grid: FloatArray
    positions: FloatArray
    alike: float

    @classmethod
    def of(cls, dv: FloatArray, expected: FloatArray, grid: FloatArray) -> Self:
        """Compare frames (n, k) with sizes (g, k) that are expected at ``grid`` (g, 2)."""
        scores, prior = normal_scores(dv), normal_scores(expected)
        k = scores.shape[1]
        surface = TopographicMap(np.eye(len(prior)), prior, np.ones(k), 4 * _FREEDOM / k)
        weights = balanced(surface.posterior(scores))
        answers = weights @ prior
        both = (scores - scores.mean(axis=0)) * (answers - answers.mean(axis=0))
        alike = float(both.mean()) / max(float(scores.std() * answers.std()), _LEAST)
        return cls(scores, prior, grid, weights @ grid, alike)

    def fitted(self, positions: FloatArray) -> FloatArray:
        """``positions`` (n, 2) moved by the affine map that makes the scores fit them best."""
        basis = Basis.of(Likeness(_LENGTH), self.grid)
        values = basis(self.grid)
        normal = values.T @ values + _RIDGE * np.eye(values.shape[1])
        coefficients = np.linalg.solve(normal, values.T @ self.expected)
        measured = self.scores - self.scores.mean(axis=0)
        measured = measured / max(float(np.linalg.norm(measured)), _LEAST)
        affine = affine_terms(positions)

        def moved(map_: FloatArray) -> FloatArray:
            return inside(positions + affine @ map_.reshape(-1, 2))

        def misfit(map_: FloatArray) -> float:
            scores = basis(moved(map_)) @ coefficients
            scores = scores - scores.mean(axis=0)
            size = max(float(np.linalg.norm(scores)), _LEAST)
            return _HELD * float(map_ @ map_) - float((measured * scores).sum()) / size

        start = np.zeros(2 * affine.shape[1])
        return moved(minimize(misfit, start, method="L-BFGS-B", options={"maxiter": _STEPS}).x)


def affine_terms(positions: FloatArray) -> FloatArray:
    """(n, d + 1) of positions (n, d)."""
    return np.column_stack([np.ones(len(positions)), positions])


def inside(positions: FloatArray) -> FloatArray:
    """Positions (n, 2) in radii, those beyond one radius drawn back to it."""
    away = np.linalg.norm(positions, axis=1, keepdims=True)
    return np.asarray(positions / np.maximum(away, 1.0))


def _logarithms(dv: FloatArray) -> FloatArray:
    sizes = np.abs(dv)
    usual = np.maximum(np.nanmedian(sizes, axis=0), np.finfo(float).tiny)
    return np.asarray(np.log(sizes / usual + _SMALL))
