"""Positions of touches that nobody has labelled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning.touch.gaussian_process import moments
from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.presses import Features, Presses
from tomoskin.learning.touch.rough import (
    ModelFit,
    Ranked,
    expected_sizes,
    inside,
    laid_over,
    levels,
    model_responses,
    unfolded,
)
from tomoskin.learning.touch.topographic import refined
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

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
        model = ForwardModel(skin.mesh(), pattern, contact_impedance=skin.contact_impedance)
        places, sheet = region.metres(region.grid), skin.conductivity
        answer = ModelFit.of(dv, model_responses(model, sheet, places, region.unit))
        if answer.holds:
            alike = float(np.sqrt(answer.explained))
            return cls._mean([answer.weights], region.grid, (0.0, alike, True))
        grid = region.lattice(_POSITIONS)
        ranked = Ranked.of(dv, expected_sizes(model, sheet, region.metres(grid)), grid)
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
