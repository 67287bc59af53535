"""A locator in another session: how far its frames are from the presses, and where they were."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.touch.matching import CHANCE, distance, matched, prevalence
from tomoskin.learning.touch.posterior import BoolArray
from tomoskin.learning.touch.presses import Presses, frames
from tomoskin.learning.touch.process import nearness, squared_distances
from tomoskin.learning.touch.topographic import (
    TopographicMap,
    covariances,
    learnt_surface,
    likeliest_power,
    surface_basis,
)

if TYPE_CHECKING:
    from tomoskin.learning.touch.locator import Locator

_FEWEST = 50
"""Frames of a session from which it can be aligned."""

_LEARNT_ON = 800
"""Presses of the calibration that make its maps here."""

_PLACES, _FOLDS = 600, 3

_COVERED = 0.5
"""Part of the sheet that touches must cover to be taken for spread over all of it."""

_MOVED = 0.22
"""Mean way, in radii of the region, by which an alignment may move the touches. On the public
sets sessions of one kind of skin moved by 0.06 to 0.14, other patterns of it by 0.34 to 0.42."""

_AGREE = 0.35
"""Mean distance, in radii of the region, by which given labels may be missed."""

_FLOOR = 0.01
"""Deviation, in radii of the region, that every estimated label has at least."""

_CORRECTS = 5
"""Labels from which the positions of all frames are corrected."""

_SMOOTH, _UNSURE = 0.8, 2.0
"""Length scale of that correction, in radii of the region, and variance of a label over its. Both
were chosen on seeds 100 to 105 of the pairs of sessions."""

_AS_BEFORE = 1.5
"""Strangeness up to which a session is as the calibration was: learnt maps are better then."""

_GAIN, _NOISE = 1.25, 2.0
"""Change of a channel's gain, and growth of the noise, from which they are said."""


@dataclass(frozen=True, eq=False)
class SessionFeatures:
    """arsinh(dv / scale) about its mean, both of one session: gains and offsets drop out.

    ``scale``, ``mean`` (n_meas,).
    """

    scale: FloatArray
    mean: FloatArray

    @classmethod
    def of(cls, dv: FloatArray) -> Self:
        """Of frames (n, n_meas) of one touch each, NaN where a value is missing."""
        finite = np.where(np.isfinite(dv), np.abs(dv), 0.0)
        scale = np.maximum(np.median(finite, axis=0), 1e-3 * max(float(np.median(finite)), 1e-99))
        values = np.where(np.isfinite(dv), np.arcsinh(dv / scale), np.nan)
        count = np.maximum(np.isfinite(values).sum(axis=0), 1)
        return cls(scale, np.asarray(np.nansum(values, axis=0) / count))

    def __call__(self, dv: FloatArray) -> FloatArray:
        """(n, n_meas), 0 where a value is missing."""
        return np.nan_to_num(np.arcsinh(dv / self.scale) - self.mean)


@dataclass(frozen=True, eq=False)
class SessionAlignment:
    """Frames of another session against a calibration, made by :meth:`of`.

    Attributes
    ----------
    presses
        What a locator of the session learns from: the calibration's presses as the session would
        have measured them, then frames with their labels, estimated ones with their covariance.
    labelled
        The frames whose label was given.
    gains
        (n_meas,) size of each channel's changes, in parts of that in the calibration.
    moved
        Mean distance, in radii of the region, by which the alignment has moved the touches.
    noise
        By how much the variance of what the maps leave has grown.
    covered
        Part of the sheet over which the touches are spread.
    missed
        Mean m by which given labels are missed; NaN where none is given.
    strangeness
        How many times worse than the calibration's own presses the frames fit it (medians).
    apart
        How far the distributions of the channels' changes are from those of the calibration, in
        parts of what chance makes of the same ones; see :func:`.matching.distance`.
    holds
        Whether the positions can be believed.
    """

    presses: Presses
    labelled: Presses
    gains: FloatArray
    moved: float
    noise: float
    covered: float
    missed: float
    strangeness: float
    apart: float
    holds: bool

    @classmethod
    def of(cls, locator: Locator, dv: ArrayLike, xy: ArrayLike | None = None) -> Self:
        """Align frames (n, n_meas) of one touch each; ``xy`` (n, 2) m, NaN where not known.

        Raises DataError for fewer than fifty frames, and arrays that do not belong together.
        """
        data = frames(dv, locator.presses.dv.shape[1])
        labels = np.full((len(data), 2), np.nan) if xy is None else np.asarray(xy, dtype=float)
        if labels.shape != (len(data), 2):
            raise DataError(f"expected xy of shape ({len(data)}, 2), got {labels.shape}")
        if len(data) < _FEWEST:
            raise DataError(
                f"expected at least {_FEWEST} touches of the session, got {len(data)}",
                hint="touch the whole skin, or press ten known positions",
            )
        with threadpool_limits(1):
            return cls._of(locator, data, labels)

    @classmethod
    def _of(cls, locator: Locator, dv: FloatArray, xy: FloatArray) -> Self:
        region, before = locator.region, locator.presses
        positions, _, strangeness = locator.told(dv)
        strange = float(np.median(strangeness))
        fits = strange <= _AS_BEFORE
        touches = region.scaled(positions)
        weight = np.full(len(before), 1 / len(before))
        if fits:  # where they are is known, so they need not be everywhere
            weight = prevalence(region.scaled(before.xy), touches)
        apart = distance(before.dv, dv, weight)
        known: BoolArray = np.asarray(np.isfinite(xy).all(axis=1))
        session = _Frames(dv, xy, known)
        found = _Found(before, touches, 0.0, 1.0, 1.0)
        if not fits or apart > CHANCE:
            found = _found(locator, session, weight if fits else None, touches)
        missed = _missed(found.positions[known], region.scaled(xy[known]))
        believed = found.moved < _MOVED and found.covered > _COVERED
        return cls(
            found.presses,
            Presses.of_more(dv[known], xy[known]),
            SessionFeatures.of(dv).scale / SessionFeatures.of(before.dv).scale,
            found.moved,
            found.noise,
            found.covered,
            region.unit * missed,
            strange,
            apart,
            holds=believed if np.isnan(missed) else missed < _AGREE,
        )

    @property
    def needed(self) -> bool:
        """Whether the frames fit the calibration worse than its own presses do, or their channels
        answer otherwise than they did."""
        return self.strangeness > _AS_BEFORE or self.apart > CHANCE

    @property
    def findings(self) -> tuple[str, ...]:
        """What differs from the calibration, and what would mend it, in words."""
        if not self.needed:
            return ("the session agrees with the calibration",)
        found = []
        middle = float(np.median(self.gains))
        uneven = float(np.exp(np.abs(np.log(self.gains / middle)).mean()))
        if max(middle, 1 / middle) > _GAIN:
            found.append(f"changes are {middle:.2g} times as large as in the calibration")
        if uneven > _GAIN:
            found.append(f"the channels' gains have changed by a factor of {uneven:.2g}, unevenly")
        if self.noise > _NOISE:
            found.append(
                f"the variance that the maps do not explain is {self.noise:.2g} times as large"
            )
        if self.covered <= _COVERED:
            found.append(f"touches cover {self.covered:.0%} of the sheet: touch the whole sheet")
        if not found:
            found.append("the channels' changes are distributed otherwise than in the calibration")
        if not self.holds:
            found.append(
                "the session cannot be aligned with the calibration: touch the whole skin, press "
                "ten known positions as well, or calibrate again"
            )
        return tuple(found)


@dataclass(frozen=True, eq=False)
class _Frames:
    """Frames ``dv`` (n, n_meas) of a session, with labels ``xy`` (n, 2) m where ``known``."""

    dv: FloatArray
    xy: FloatArray
    known: BoolArray


@dataclass(frozen=True, eq=False)
class _Found:
    """What is learnt from, ``positions`` (n, 2) of the session's frames in radii of the region
    before labels correct them, and what a :class:`SessionAlignment` says of these."""

    presses: Presses
    positions: FloatArray
    moved: float
    noise: float
    covered: float


def _found(
    locator: Locator, session: _Frames, weight: FloatArray | None, touches: FloatArray
) -> _Found:
    """Align frames by their channels' distributions, and where that does not do by a mapping.

    ``weight`` of the presses where the ``touches`` (n, 2) that the locator finds are believed.
    """
    grid = locator.region.lattice(_PLACES)
    start, covered = _start(locator, session.dv, grid)
    known = session.known
    like = locator
    if weight is not None or covered > _COVERED:
        even = np.full(len(locator.presses), 1 / len(locator.presses))
        dv = matched(locator.presses.dv, session.dv, even if weight is None else weight)
        presses = replace(locator.presses, dv=dv)
        like = locator.learn(presses, locator.region, locator.pattern, locator.skin_id)
        positions, _, strangeness = like.told(session.dv)
        if float(np.median(strangeness)) <= _AS_BEFORE:
            given = Presses.of_more(session.dv[known], session.xy[known])
            both = presses.and_then(given) if known.any() else presses
            answers = locator.region.scaled(positions)
            before = start if weight is None else touches
            return _Found(both, answers, _way(answers, before), 1.0, 1.0)
    return _mapped(like, session, grid, (start, covered))


def _mapped(
    like: Locator, session: _Frames, grid: FloatArray, begun: tuple[FloatArray, float]
) -> _Found:
    """Positions by a mapping that begins with the responses of a locator ``like`` the session.

    ``begun``: positions (n, 2) in radii without any alignment, and the part of the sheet covered.
    """
    start, covered = begun
    region, known = like.region, session.known
    labels = region.scaled(session.xy[known])
    before, features = _learnt(like, grid)
    white = SessionFeatures.of(session.dv)(session.dv) @ features.whiten + before.middle
    named = np.full(len(white), -1)
    if known.any():
        named[known] = _numbers(labels, grid)
    fit, noise = before.surface.fitted(white, named, everywhere=covered > _COVERED)
    grown = noise / before.noise
    mean = found = fit.posterior(white) @ grid
    if known.sum() >= _CORRECTS:
        mean = found + _correction(found, known, labels)
    spread = _spread(fit.tempered(grown).posterior(white), mean, grid)
    spread[known] = 0.0
    label = np.where(known[:, None], session.xy, region.metres(mean))
    estimated = Presses.checked(session.dv, label, spread=region.unit**2 * spread)
    presses = like.presses.and_then(estimated)
    return _Found(presses, found, _way(found, start), grown, covered)


def _way(positions: FloatArray, before: FloatArray) -> float:
    return float(np.linalg.norm(positions - before, axis=1).mean())


@dataclass(frozen=True, eq=False)
class _Before:
    """Maps of a calibration in its own whitened features; ``middle`` (k,) of a sheet that is
    touched everywhere; ``noise`` of its own frames without their labels."""

    surface: TopographicMap
    middle: FloatArray
    noise: float


@dataclass(frozen=True, eq=False)
class _Whitened:
    """Features of one ``session``, and what whitens them, (n_meas, k)."""

    session: SessionFeatures
    whiten: FloatArray


def _learnt(locator: Locator, grid: FloatArray) -> tuple[_Before, _Whitened]:
    presses = locator.presses
    chosen = np.unique(np.linspace(0, len(presses) - 1, _LEARNT_ON).astype(int))
    dv, positions = presses.dv[chosen], locator.region.scaled(presses.xy[chosen])
    fold = np.arange(len(dv)) % _FOLDS
    parts = []
    for k in range(_FOLDS):
        surface, used, middle = _surface(dv[fold != k], positions[fold != k], grid)
        white = SessionFeatures.of(dv[fold == k])(dv[fold == k]) @ used.whiten + middle
        parts.append((surface, white, _numbers(positions[fold == k], grid)))
    power = likeliest_power(parts)
    surface, used, middle = _surface(dv, positions, grid)
    surface = replace(surface, power=power)
    white = used.session(dv) @ used.whiten + middle
    _, noise = surface.fitted(white, np.full(len(dv), -1), everywhere=True)
    return _Before(surface, middle, noise), used


def _start(locator: Locator, dv: FloatArray, grid: FloatArray) -> tuple[FloatArray, float]:
    """Positions (n, 2) of a session's frames by the calibration's maps of features whose gains and
    offsets have dropped out, and the part of the sheet that they cover."""
    before, features = _learnt(locator, grid)
    theirs = SessionFeatures.of(dv)
    weights = before.surface.posterior(theirs(dv) @ features.whiten + before.middle)
    return weights @ grid, float(np.exp(_entropy(weights.mean(axis=0))) / len(grid))


def _surface(
    dv: FloatArray, positions: FloatArray, grid: FloatArray
) -> tuple[TopographicMap, _Whitened, FloatArray]:
    session, basis = SessionFeatures.of(dv), surface_basis(grid)
    coefficients, whiten = learnt_surface(basis, positions, session(dv))
    values = basis(grid)
    surface = TopographicMap(values, coefficients, np.ones(whiten.shape[1]), 1.0)
    return surface, _Whitened(session, whiten), (values @ coefficients).mean(axis=0)


def _numbers(positions: FloatArray, grid: FloatArray) -> IntArray:
    return np.asarray(squared_distances(positions, grid).argmin(axis=1))


def _entropy(part: FloatArray) -> float:
    return float(-(part * np.log(np.maximum(part, 1e-300))).sum())


def _missed(answers: FloatArray, labels: FloatArray) -> float:
    return float(np.linalg.norm(answers - labels, axis=1).mean()) if len(labels) else np.nan


def _correction(positions: FloatArray, known: BoolArray, labels: FloatArray) -> FloatArray:
    """(n, 2) by which ``positions`` (n, 2) are off, as ``labels`` of the ``known`` ones tell.

    A smooth mapping of the sheet onto itself fits the frames about as well.
    """
    at = positions[known]
    among = nearness(at, at, _SMOOTH) + _UNSURE * np.eye(len(at))
    near = nearness(positions, at, _SMOOTH)
    return np.asarray(near @ np.linalg.solve(among, labels - at))


def _spread(weights: FloatArray, mean: FloatArray, grid: FloatArray) -> FloatArray:
    """(n, 2, 2) mean square of the grid's positions about ``mean`` (n, 2)."""
    off = weights @ grid - mean
    about = covariances(weights, grid) + off[:, :, None] * off[:, None]
    return np.asarray(about + _FLOOR**2 * np.eye(2))
