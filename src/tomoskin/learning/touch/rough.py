"""Where touches were that nobody has labelled, roughly: by the order in which measurements answer
to them, by which frames are alike, and by the skin's model where the sheet answers as it says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import shortest_path
from scipy.special import ndtri

from tomoskin.core import FloatArray
from tomoskin.learning.touch.gaussian_process import Basis, Likeness, squared_distances
from tomoskin.learning.touch.topographic import TopographicMap, balanced, coefficients_of
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
        coefficients = coefficients_of(values, self.expected, _RIDGE)
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


_ROUGH = 5.0
"""Labels for which all rough positions together count."""


def unfolded(scores: FloatArray, neighbours: int) -> FloatArray:
    """(n, 2) coordinates whose distances are those along the frames' manifold.

    Isomap (Tenenbaum, de Silva & Langford 2000): from frame to frame by way of ``neighbours``.
    """
    away = np.sqrt(squared_distances(scores, scores))
    n = len(away)
    near = np.argsort(away, axis=1)[:, 1 : neighbours + 1]
    links = np.take_along_axis(away, near, axis=1).ravel()
    ends = (np.repeat(np.arange(n), neighbours), near.ravel())
    along = shortest_path(csr_matrix((links, ends), (n, n)), directed=False)
    along = np.where(np.isfinite(along), along, along[np.isfinite(along)].max()) ** 2
    about = along - along.mean(axis=0) - along.mean(axis=1, keepdims=True) + along.mean()
    size, axes = eigh(-0.5 * about, subset_by_index=(n - 2, n - 1))
    return np.asarray(axes * np.sqrt(np.maximum(size, 0.0)))


def laid_over(layout: FloatArray, rough: FloatArray, labels: FloatArray) -> FloatArray:
    """(n, 2) the ``layout`` (n, 2) moved by an affine map to where the frames were.

    ``rough`` (n, 2) positions, of which each says little; ``labels`` (n, 2), NaN where none is.
    """
    known = np.isfinite(labels).all(axis=1, keepdims=True)
    root = np.sqrt(np.where(known, 1.0, _ROUGH / len(layout)))
    terms = affine_terms(layout)
    target = np.where(known, labels, rough)
    return np.asarray(terms @ np.linalg.lstsq(terms * root, target * root, rcond=None)[0])


_WIDTH = 0.1
"""Deviation, in radii, of a touch on the sheet."""

_MODEL_FREEDOM = 8.0
"""Independent values in a frame: what the model leaves errs together."""

_HOLDS = 0.5
"""Part of a usual frame that the model must explain: 0.75 to 0.9 on the twin, at most 0.24 on the
public hydrogels."""

_TINY = 1e-99


def model_responses(
    model: ForwardModel, conductivity: float, positions: FloatArray, unit: float
) -> FloatArray:
    """(g, n_meas) change of each row by a touch at ``positions`` (g, 2) m, in any one unit.

    ``unit`` m: radius of the skin.
    """
    off = squared_distances(positions, model.mesh.centroids[:, :2])
    touched = np.exp(-0.5 * off / (_WIDTH * unit) ** 2) * model.mesh.volumes
    return np.asarray(touched @ model.jacobian(conductivity).T)


@dataclass(frozen=True, eq=False)
class ModelFit:
    """Frames against the model's responses.

    Attributes
    ----------
    weights
        (n, g) probabilities of the grid's positions. Touches may be anywhere, as often as it be.
    explained
        Part of a usual frame's square that the likeliest response explains (median).
    """

    weights: FloatArray
    explained: float

    @classmethod
    def of(cls, dv: FloatArray, responses: FloatArray) -> Self:
        """Compare shapes: how hard a touch is, and whether changes rise or fall, is not known.

        ``dv`` (n, k), ``responses`` (g, k). Channels' gains are one, or those that make a usual
        change as large as the model's: whatever explains more.
        """
        dv = np.nan_to_num(dv)
        usual = _usual(dv) / _usual(responses)
        scales = (np.ones(len(usual)), np.maximum(usual, _TINY))
        fits = [cls._of(sign * dv / scale, responses) for scale in scales for sign in (1, -1)]
        return max(fits, key=lambda fit: fit.explained)

    @classmethod
    def _of(cls, dv: FloatArray, responses: FloatArray) -> Self:
        shapes, expected = _shapes(dv), _shapes(responses)
        best = (shapes @ expected.T).max(axis=1)
        off = squared_distances(shapes, expected)
        noise = float(off.min(axis=1).mean()) / _MODEL_FREEDOM
        weights = np.exp(-0.5 * (off - off.min(axis=1, keepdims=True)) / noise)
        explained = float(np.median(np.maximum(best, 0.0) ** 2))
        return cls(weights / weights.sum(axis=1, keepdims=True), explained)

    @property
    def holds(self) -> bool:
        """Whether the sheet answers as the model says."""
        return self.explained > _HOLDS


def _shapes(values: FloatArray) -> FloatArray:
    size = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.maximum(size, _TINY))


def _usual(values: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.median(np.abs(values), axis=0), _TINY))
