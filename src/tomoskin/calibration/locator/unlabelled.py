"""Positions of touches that nobody has labelled, from how strongly each row answers to each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.special import ndtri

from tomoskin.calibration.locator.process import Basis, Likeness, squared_distances
from tomoskin.calibration.locator.topographic import TopographicMap, balanced
from tomoskin.core import FloatArray, IntArray, reach
from tomoskin.forward import ForwardModel
from tomoskin.pattern import Pattern
from tomoskin.skin import Skin
from tomoskin.touch import Region

_POSITIONS = 400
_LENGTHS, _LEVELLED = (0.3, 0.45), (0.0, 1.0)
"""Length scales, in radii, of what is added to the prior responses, and parts of each frame's own
level that are taken out: what all fits agree on does not rest on either."""

_ROUNDS = 20
_KEPT = (150.0, 5.0)
"""Weight of the prior responses at first and at last, each coefficient's, as frames: where the
prior explains as much of the features as it leaves; elsewhere in proportion."""

_FREEDOM = (12.0, 48.0)
"""Independent features in a frame, at first and at last: its rows err together."""

_LABEL = 10.0
"""Frames that a labelled one counts for."""

_NOISE_FLOOR, _LEAST = 0.03, 1e-12
_SMALL = 0.05
"""Below this part of a row's median a change is lost in noise."""

_NEAR_CELLS = 4
_EVEN, _LEAST_COSINE = 0.65, 0.05
"""Correlation of the data with an even sheet's responses from which the angle between the fields of
drive and measurement counts: patterned sheets hardly keep to it."""

_WARP, _WARP_LENGTH, _WARP_NOISE = 0.25, 0.8, 0.03
"""Deviation and length of what labels may move the positions by, and their noise, in radii."""


def normal_scores(sizes: FloatArray, levelled: float) -> FloatArray:
    """(n, k) rank of each frame in each row, as a normal deviate; 0 where a value is missing.

    ``sizes`` (n, k) of changes. Ranks know no gain of a row and no law of the material. The part
    ``levelled`` of a frame's mean logarithm is taken out before: force, and how sensitive the
    sheet is at the position.
    """
    usual = np.maximum(np.nanmedian(sizes, axis=0), np.finfo(float).tiny)
    level = np.log(sizes / usual + _SMALL)
    level = level - levelled * np.nanmean(level, axis=1, keepdims=True)
    present = np.isfinite(level)
    rank = np.where(present, level, np.inf).argsort(axis=0).argsort(axis=0)
    last = np.maximum(present.sum(axis=0), 1) - 0.5
    return np.asarray(np.where(present, ndtri((rank + 0.5).clip(max=last) / (last + 0.5)), 0.0))


def expected_sizes(
    skin: Skin, pattern: Pattern, positions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(g, n_meas) how strongly each row should answer at ``positions`` (g, 2) m, in two factors.

    The current density of its drive times the field of its measurement on an even sheet, and the
    cosine of the angle between the two, without sign. Raises ModelError as the forward model does.
    """
    mesh = skin.mesh()
    model = ForwardModel(mesh, pattern, contact_impedance=skin.contact_impedance)
    gradient = model.solve(skin.conductivity).gradient
    drive, measure = (
        gradient[pairs[:, 0]] - gradient[pairs[:, 1]] for pairs in (pattern.drive, pattern.measure)
    )
    least = np.finfo(float).tiny
    product = np.linalg.norm(drive, axis=1) * np.linalg.norm(measure, axis=1)
    cosine = np.abs((drive * measure).sum(axis=1)) / np.maximum(product, least)
    sizes = np.log(np.maximum(product / mesh.volumes, least))
    away = squared_distances(positions, mesh.centroids[:, :2])
    near = np.argpartition(away, _NEAR_CELLS, axis=1)[:, :_NEAR_CELLS]
    return np.exp(sizes.T[near].mean(axis=1)), np.asarray(cosine.T[near].mean(axis=1))


@dataclass(frozen=True, eq=False)
class UnlabelledFit:
    """Where touches were, found without labels; positions are in radii of the region.

    Attributes
    ----------
    positions
        (n, 2) mean of all fits.
    spread
        (n, 2, 2) covariance: each fit's own, and that of the fits about their mean.
    disagreement
        Root mean square by which the fits differ from their mean.
    alike
        Correlation of the features with the prior responses, before these are let go.
    """

    positions: FloatArray
    spread: FloatArray
    disagreement: float
    alike: float

    @classmethod
    def of(
        cls, dv: FloatArray, skin: Skin, pattern: Pattern, region: Region, labels: FloatArray
    ) -> Self:
        """Fit frames (n, n_meas); ``labels`` (n, 2) in radii, NaN where there is none."""
        grid = region.lattice(_POSITIONS)
        expected = _prior(np.abs(dv), expected_sizes(skin, pattern, region.metres(grid)))
        named = np.full(len(dv), -1)
        some = np.isfinite(labels).all(axis=1)
        named[some] = squared_distances(labels[some], grid).argmin(axis=1)
        fits = [
            _fitted(np.abs(dv), expected, grid, named, length, levelled)
            for length in _LENGTHS
            for levelled in _LEVELLED
        ]
        means = np.stack([_corrected(fit.weights @ grid, labels) for fit in fits])
        middle = means.mean(axis=0)
        off = means - middle
        between = np.einsum("fna,fnb->nab", off, off) / len(fits)
        within = np.mean([_covariances(fit.weights, grid) for fit in fits], axis=0)
        return cls(
            middle,
            within + between,
            float(np.sqrt(np.trace(between, axis1=1, axis2=2).mean())),
            float(np.mean([fit.alike for fit in fits])),
        )


def _prior(sizes: FloatArray, expected: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(g, n_meas) prior responses: with the angle of the two fields where the sheet keeps to it."""
    product, cosine = expected
    strict = product * np.maximum(cosine, _LEAST_COSINE)
    level = max(_LEVELLED)
    alike = _first(normal_scores(sizes, level), normal_scores(strict, level))[1]
    return strict if alike > _EVEN else product


def _first(features: FloatArray, prior: FloatArray) -> tuple[FloatArray, float]:
    """(n, g) probabilities by the prior responses alone, and how alike frames and these are."""
    k = features.shape[1]
    surface = TopographicMap(np.eye(len(prior)), prior, np.ones(k), 4 * _FREEDOM[0] / k)
    weights = balanced(surface.posterior(features))
    answers = weights @ prior
    both = (features - features.mean(axis=0)) * (answers - answers.mean(axis=0))
    return weights, float(both.mean()) / max(float(features.std() * answers.std()), _LEAST)


@dataclass(frozen=True, eq=False)
class _Fit:
    weights: FloatArray
    alike: float


def _fitted(  # noqa: PLR0917
    sizes: FloatArray,
    expected: FloatArray,
    grid: FloatArray,
    named: IntArray,
    length: float,
    levelled: float,
) -> _Fit:
    """Expectation maximisation; what is added to the prior responses is let go little by little."""
    features, prior = normal_scores(sizes, levelled), normal_scores(expected, levelled)
    k, values = features.shape[1], Basis.of(Likeness(length), grid)(grid)
    count = np.where(named >= 0, _LABEL, 1.0)[:, None]
    weights, alike = _first(features, prior)
    kept = np.zeros((values.shape[1], k))
    surface = TopographicMap(values, kept, np.ones(k), 1.0, alike * prior)
    weights = _named(weights, named)
    trust = alike**2 / max(1 - alike**2, _LEAST)
    for keep, freedom in _annealed():
        reach()
        surface = replace(surface, power=freedom / k)
        surface = surface.renewed(features, weights * count, kept, trust * keep, _NOISE_FLOOR)
        weights = _named(balanced(surface.posterior(features)), named)
    return _Fit(weights, alike)


def _annealed() -> Iterator[tuple[float, float]]:
    pairs = (np.geomspace(*ends, _ROUNDS).tolist() for ends in (_KEPT, _FREEDOM))
    return zip(*pairs, strict=True)


def _named(weights: FloatArray, named: IntArray) -> FloatArray:
    some = np.flatnonzero(named >= 0)
    weights[some] = np.eye(weights.shape[1])[named[some]]
    return weights


def _covariances(weights: FloatArray, grid: FloatArray) -> FloatArray:
    mean = weights @ grid
    second = (weights @ (grid[:, :, None] * grid[:, None]).reshape(-1, 4)).reshape(-1, 2, 2)
    return np.asarray(second - mean[:, :, None] * mean[:, None])


def _corrected(positions: FloatArray, labels: FloatArray) -> FloatArray:
    """Positions (n, 2) moved smoothly, so that labelled ones come to where they were."""
    some = np.isfinite(labels).all(axis=1)
    if not some.any():
        return positions
    known = positions[some]
    likeness = Likeness(_WARP_LENGTH)
    among = likeness(known, known) / likeness.variance
    noise = (_WARP_NOISE / _WARP) ** 2 * np.eye(len(known))
    pull = np.linalg.solve(among + noise, labels[some] - known)
    return np.asarray(positions + likeness(positions, known) / likeness.variance @ pull)
