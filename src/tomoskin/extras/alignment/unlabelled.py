"""Where touches were that nobody has labelled: roughly by the order in which measurements answer to
them, by which frames are alike, and by the skin's model where the sheet answers as it says."""

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
from tomoskin.extras.alignment.topographic import (
    TopographicMap,
    balanced,
    coefficients_of,
    refined,
)
from tomoskin.learning import (
    Basis,
    Features,
    Likeness,
    Locator,
    Presses,
    compared,
    moments,
    squared_distances,
)
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

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


_POSITIONS = 400
_NEIGHBOURS = (10, 14)
"""Of a frame: what both fits agree on does not rest on either. Chosen on two skins."""

_FOLDS = 3
"""Into which labels are divided, to see how far left-out ones are missed."""


_MOST = 256
"""Features from which only so many directions of largest variance are used."""


def signed_features(dv: FloatArray) -> FloatArray:
    """(n, k) features of the shape of frames (n, n_meas), with their sign, about their mean."""
    shape = dv / levels(dv)
    features: FloatArray = Features.of(shape)(shape)
    features = np.asarray(features - features.mean(axis=0))
    if features.shape[1] <= _MOST:
        return features
    return np.asarray(features @ np.linalg.svd(features, full_matrices=False)[2][:_MOST].T)


@dataclass(frozen=True, eq=False)
class UnlabelledFit:
    """Where touches were; positions are in radii of the region.

    Attributes
    ----------
    positions
        (n, 2) mean of all fits.
    spread
        (n, 2, 2) covariance: each fit's own, and that of the fits about their mean.
    disagreement
        Root mean square by which the fits differ from their mean.
    moved
        Mean way from where the electrodes' order alone puts the touches.
    alike
        Correlation with what the skin's model expects.
    modelled
        Whether the sheet answers as its model says, and the positions are the model's.
    """

    positions: FloatArray
    spread: FloatArray
    disagreement: float
    moved: float
    alike: float
    modelled: bool

    @classmethod
    def of(
        cls, dv: FloatArray, skin: Skin, pattern: Pattern, region: Region, labels: FloatArray
    ) -> Self:
        """Fit frames (n, n_meas); ``labels`` (n, 2) in radii, NaN where there is none."""
        model, answer = compared(dv, skin, pattern, region)
        if answer.holds:
            alike = float(np.sqrt(answer.explained))
            return cls._mean([answer.weights], region.grid, (0.0, alike, True))
        grid = region.lattice(_POSITIONS)
        ranked = Ranked.of(dv, expected_sizes(model, skin.conductivity, region.metres(grid)), grid)
        features, fits = signed_features(dv), []
        for neighbours in _NEIGHBOURS:
            layout = unfolded(ranked.scores, neighbours)
            none = np.full(labels.shape, np.nan)
            start = ranked.fitted(inside(laid_over(layout, ranked.positions, none)))
            if np.isfinite(labels).any():
                start = laid_over(layout, start, labels)
            fits.append(refined(features, start, labels, grid))
        away = np.mean(fits, axis=0) @ grid - ranked.positions
        moved = float(np.linalg.norm(away, axis=1).mean())
        return cls._mean(fits, grid, (moved, ranked.alike, False))

    @classmethod
    def _mean(
        cls,
        fits: list[FloatArray],
        grid: FloatArray,
        about: tuple[float, float, bool],
    ) -> Self:
        means = np.stack([weights @ grid for weights in fits])
        middle = means.mean(axis=0)
        off = means - middle
        between = np.einsum("fna,fnb->nab", off, off) / len(fits)
        within = np.mean([moments(weights, grid)[1] for weights in fits], axis=0)
        apart = float(np.sqrt(np.trace(between, axis1=1, axis2=2).mean()))
        return cls(middle, within + between, apart, *about)


def from_labels(dv: FloatArray, labels: FloatArray, region: Region, pattern: Pattern) -> FloatArray:
    """(n, 2) positions in radii of frames of which some have ``labels`` (n, 2), others NaN.

    It begins where a calibration from the labels puts the frames, and asks the model nothing.
    """
    known = np.isfinite(labels).all(axis=1)
    presses = Presses.checked(dv[known], region.metres(labels[known]))
    start = region.scaled(Locator.learn(presses, region, pattern).predict(dv)[0])
    grid = region.lattice(_POSITIONS)
    return np.asarray(refined(signed_features(dv), start, labels, grid) @ grid)


def missed_labels(dv: FloatArray, labels: FloatArray, region: Region, pattern: Pattern) -> float:
    """Root mean square in radii by which labels are missed in :func:`from_labels` without them."""
    known = np.flatnonzero(np.isfinite(labels).all(axis=1))
    square = 0.0
    for fold in range(_FOLDS):
        others = labels.copy()
        others[known[fold::_FOLDS]] = np.nan
        off = (from_labels(dv, others, region, pattern) - labels)[known[fold::_FOLDS]]
        square += float((off**2).sum())
    return float(np.sqrt(square / len(known)))
