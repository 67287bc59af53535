"""A locator in another session: how far its frames are from the presses, and where they were."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import entr
from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.extras.alignment.topographic import TopographicMap, coefficients_of, whitening
from tomoskin.learning import (
    Basis,
    BoolArray,
    Likeness,
    Locator,
    Presses,
    Progress,
    labelled_touches,
    moments,
    nearness,
    silent,
    squared_distances,
    telling,
)

_FEWEST = 50
"""Frames of a session from which it can be aligned."""

_LEARNT_ON = 800
"""Presses of the calibration that make its maps here."""

_PLACES, _FOLDS = 600, 3

_LENGTH, _RIDGE, _DIAGONAL = 0.4, 0.1, 0.1
"""Length scale of a response, in radii of the region; noise over signal of the maps; part of the
noise's covariance that is taken as diagonal."""

_COVERED = 0.5
"""Part of the sheet that touches must cover to be taken for spread over all of it."""

_MOVED = 0.22
"""Mean way, in radii of the region, by which an alignment may move the touches. On the public
sets sessions of one kind of skin moved by 0.06 to 0.14, other patterns of it by 0.34 to 0.42."""

_LIKE = 4.0
"""Strangeness that frames may have when each channel's presses are distributed as they are. Of
noPattern, radial, cam09_05 and round16_single550 (120 presses) sessions of one kind of skin have
2.3 to 3.3, other skins 5.1 to 7.7."""

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
    unlike
        The same when each channel's presses are distributed as the frames are; 1 where that was not
        needed.
    apart
        How far the distributions of the channels' changes are from those of the calibration, in
        parts of what chance makes of the same ones; see :func:`distance`.
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
    unlike: float
    apart: float
    holds: bool

    @classmethod
    def of(cls, locator: Locator, dv: ArrayLike, xy: ArrayLike | None = None) -> Self:
        """Align frames (n, n_meas) of one touch each; ``xy`` (n, 2) m, NaN where not known.

        Raises DataError for fewer than fifty frames, and arrays that do not belong together.
        """
        data, labels = labelled_touches(dv, xy, locator.presses.dv.shape[1])
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
        positions, _, strangeness = locator.posterior(dv)
        strange = float(np.median(strangeness))
        fits = strange <= _AS_BEFORE
        touches = region.scaled(positions)
        weight = np.full(len(before), 1 / len(before))
        if fits:  # where they are is known, so they need not be everywhere
            weight = prevalence(region.scaled(before.xy), touches)
        apart = distance(before.dv, dv, weight)
        session = _Session(locator, dv, xy, region.lattice(_PLACES))
        aligned = _Found(before, touches, 0.0, 1.0, 1.0)
        if not fits or apart > CHANCE:
            aligned = session.alignment(weight if fits else None, touches)
        known = session.known
        missed = np.nan
        if known.any():
            missed = _way(aligned.positions[known], region.scaled(xy[known]))
        believed = aligned.moved < _MOVED and aligned.covered > _COVERED and aligned.unlike < _LIKE
        return cls(
            aligned.presses,
            Presses.of_more(dv[known], xy[known]),
            SessionFeatures.of(dv).scale / SessionFeatures.of(before.dv).scale,
            aligned.moved,
            aligned.noise,
            aligned.covered,
            region.unit * missed,
            strange,
            aligned.unlike,
            apart,
            holds=believed if np.isnan(missed) else missed < _AGREE,
        )

    def locator(self, before: Locator, progress: Progress = silent) -> Locator:
        """``before``, that was aligned, having learnt from the frames with their labels.

        Where that is not needed, the labels that were given are added to its own.
        """
        if not self.needed:
            given = self.labelled
            return before.updated(given.dv, given.xy) if len(given) else before
        return before.learn(self.presses, before.region, before.pattern, before.skin_id, progress)

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
        notes = []
        middle = float(np.median(self.gains))
        uneven = float(np.exp(np.abs(np.log(self.gains / middle)).mean()))
        if max(middle, 1 / middle) > _GAIN:
            notes.append(f"changes are {middle:.2g} times as large as in the calibration")
        if uneven > _GAIN:
            notes.append(f"the channels' gains have changed by a factor of {uneven:.2g}, unevenly")
        if self.noise > _NOISE:
            notes.append(
                f"the variance that the maps do not explain is {self.noise:.2g} times as large"
            )
        if self.covered <= _COVERED:
            notes.append(f"touches cover {self.covered:.0%} of the sheet: touch the whole sheet")
        if not notes:
            notes.append("the channels' changes are distributed otherwise than in the calibration")
        if not self.holds:
            notes.append(
                "the session cannot be aligned with the calibration: touch the whole skin, press "
                "ten known positions as well, or calibrate again"
            )
        return tuple(notes)


def in_session(locator: Locator, dv: ArrayLike, xy: ArrayLike | None = None) -> Locator:
    """The locator for another session, from its frames (n, n_meas) of one touch each.

    ``xy`` (n, 2) m where a label is known, rows of NaN otherwise. Where the session is as the
    calibration was only labels are added, and where it cannot be aligned the locator stays as it
    was: see :class:`SessionAlignment`, which says so. Raises DataError as that does.
    """
    alignment = SessionAlignment.of(locator, dv, xy)
    return alignment.locator(locator) if alignment.holds else locator


@dataclass(frozen=True, eq=False)
class _Found:
    """What is learnt from, ``positions`` (n, 2) of the session's frames in radii of the region
    before labels correct them, and what a :class:`SessionAlignment` says of these."""

    presses: Presses
    positions: FloatArray
    moved: float
    noise: float
    covered: float
    unlike: float = 1.0


@dataclass(frozen=True, eq=False)
class _Session:
    """Frames ``dv`` (n, n_meas) of a session, with labels ``xy`` (n, 2) m, NaN where there is
    none, for a ``locator``; positions are those of ``grid`` (g, 2)."""

    locator: Locator
    dv: FloatArray
    xy: FloatArray
    grid: FloatArray

    @cached_property
    def known(self) -> BoolArray:
        """(n,) whether a frame has a label."""
        return np.asarray(np.isfinite(self.xy).all(axis=1))

    def alignment(self, weight: FloatArray | None, touches: FloatArray) -> _Found:
        """Align frames by their channels' distributions, and where that does not do by a mapping.

        ``weight`` of the presses where the ``touches`` (n, 2) that the locator finds are believed.
        """
        locator, known, dv = self.locator, self.known, self.dv
        maps = _SessionMaps.of(locator, self.grid)
        weights = maps.surface.posterior(maps.white(dv))
        start = weights @ self.grid
        covered = float(np.exp(entr(weights.mean(axis=0)).sum()) / len(self.grid))
        unlike = np.inf
        if weight is not None or covered > _COVERED:
            even = np.full(len(locator.presses), 1 / len(locator.presses))
            like = matched(locator.presses.dv, dv, even if weight is None else weight)
            presses = replace(locator.presses, dv=like)
            locator = locator.learn(presses, locator.region, locator.pattern, locator.skin_id)
            positions, _, strangeness = locator.posterior(dv)
            unlike = float(np.median(strangeness))
            if unlike <= _AS_BEFORE:
                given = Presses.of_more(dv[known], self.xy[known])
                both = presses.and_then(given) if known.any() else presses
                answers = locator.region.scaled(positions)
                way = _way(answers, start if weight is None else touches)
                return _Found(both, answers, way, 1.0, 1.0, unlike)
            maps = _SessionMaps.of(locator, self.grid)
        return replace(self._mapped(maps, locator.presses, start, covered), unlike=unlike)

    def _mapped(
        self, maps: _SessionMaps, presses: Presses, start: FloatArray, covered: float
    ) -> _Found:
        """Positions by a mapping that begins with the ``maps`` of ``presses`` like the session's.

        ``start`` (n, 2) in radii without any alignment; part of the sheet that is ``covered``.
        """
        region, known, grid = self.locator.region, self.known, self.grid
        labels = region.scaled(self.xy[known])
        white = maps.white(self.dv)
        named = np.full(len(white), -1)
        if known.any():
            named[known] = _numbers(labels, grid)
        fit, noise = maps.surface.fitted(white, named, everywhere=covered > _COVERED)
        grown = noise / maps.noise
        mean = answers = fit.posterior(white) @ grid
        if known.sum() >= _CORRECTS:
            mean = answers + _correction(answers, known, labels)
        spread = _spread(fit.tempered(grown).posterior(white), mean, grid)
        spread[known] = 0.0
        label = np.where(known[:, None], self.xy, region.metres(mean))
        estimated = Presses.checked(self.dv, label, spread=region.unit**2 * spread)
        return _Found(presses.and_then(estimated), answers, _way(answers, start), grown, covered)


@dataclass(frozen=True, eq=False)
class _SessionMaps:
    """Maps of a calibration in features whose gains and offsets drop out with the session.

    ``whiten`` (n_meas, k) makes their noise white; ``middle`` (k,) is that of a sheet that is
    touched everywhere; ``noise`` that of its own frames without their labels.
    """

    surface: TopographicMap
    whiten: FloatArray
    middle: FloatArray
    noise: float = 1.0

    @classmethod
    def of(cls, locator: Locator, grid: FloatArray) -> Self:
        """Of some of the presses; folds of them say how sharp the maps are."""
        presses = locator.presses
        chosen = telling(len(presses), _LEARNT_ON)
        dv, positions = presses.dv[chosen], locator.region.scaled(presses.xy[chosen])
        fold = np.arange(len(dv)) % _FOLDS
        parts = []
        for k in range(_FOLDS):
            part = cls._plain(dv[fold != k], positions[fold != k], grid)
            white = part.white(dv[fold == k])
            parts.append((part.surface, white, _numbers(positions[fold == k], grid)))
        maps = cls._plain(dv, positions, grid)
        surface = replace(maps.surface, power=_likeliest_power(parts))
        _, noise = surface.fitted(maps.white(dv), np.full(len(dv), -1), everywhere=True)
        return replace(maps, surface=surface, noise=noise)

    @classmethod
    def _plain(cls, dv: FloatArray, positions: FloatArray, grid: FloatArray) -> Self:
        basis = Basis.of(Likeness(_LENGTH), grid)
        features = SessionFeatures.of(dv)(dv)
        there = basis(positions)
        coefficients = coefficients_of(there, features, _RIDGE)
        residual = features - there @ coefficients
        whiten = whitening(residual.T @ residual / len(residual), _DIAGONAL)
        coefficients = coefficients @ whiten
        values = basis(grid)
        surface = TopographicMap(values, coefficients, np.ones(whiten.shape[1]), 1.0)
        return cls(surface, whiten, (values @ coefficients).mean(axis=0))

    def white(self, dv: FloatArray) -> FloatArray:
        """(n, k) features of all frames (n, n_meas) of a session."""
        return SessionFeatures.of(dv)(dv) @ self.whiten + self.middle


def _way(positions: FloatArray, before: FloatArray) -> float:
    return float(np.linalg.norm(positions - before, axis=1).mean())


def _likeliest_power(parts: Sequence[tuple[TopographicMap, FloatArray, IntArray]]) -> float:
    """The power at which left-out presses are likeliest: maps, features and numbers on the grid."""
    powers = np.geomspace(0.01, 1.0, 14)
    score = np.zeros(len(powers))
    for surface, features, numbers in parts:
        for k, power in enumerate(powers):
            weights = replace(surface, power=float(power)).posterior(features)
            score[k] += np.log(weights[np.arange(len(numbers)), numbers] + 1e-6).sum()
    return float(powers[int(score.argmax())])


def _numbers(positions: FloatArray, grid: FloatArray) -> IntArray:
    return np.asarray(squared_distances(positions, grid).argmin(axis=1))


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
    about = moments(weights, grid)[1] + off[:, :, None] * off[:, None]
    return np.asarray(about + _FLOOR**2 * np.eye(2))


# Presses as another session would have measured them, channel by channel.

_NEAR = 0.2
"""Radius of what is called the same place, in radii of the region."""

_FEWEST_VALUES = 10
"""Values of a channel, before and now, below which it stays as it was."""

CHANCE = 1.36
"""Distance of two distributions that chance exceeds once in twenty times (Kolmogorov). Sessions of
public skins are 2.4 to 5.7 apart, and touches of one session, wherever they are, 0.7 to 1.0."""


def prevalence(presses: FloatArray, touches: FloatArray) -> FloatArray:
    """(n,) how often touches come near each of ``presses`` (n, 2), over how often presses do.

    ``touches`` (m, 2), both in radii of the region. The sum is one.
    """
    often, before = (nearness(presses, some, _NEAR).mean(axis=1) for some in (touches, presses))
    weight = often / before
    return np.asarray(weight / weight.sum())


def matched(before: FloatArray, now: FloatArray, weight: FloatArray) -> FloatArray:
    """``before`` (n, k) with each channel's distribution mapped onto that of ``now`` (m, k).

    The ``weight`` (n,) of each press says how often touches are there now. A monotone mapping of
    one channel keeps the order of its values, whatever the gains and the law of the material.
    """
    like = before.copy()
    for channel, rows, values in _channels(before, now):
        part = weight[rows]
        below = (part.cumsum() - 0.5 * part) / max(part.sum(), np.finfo(float).tiny)
        like[rows, channel] = np.quantile(values, below)
    return like


def distance(before: FloatArray, now: FloatArray, weight: FloatArray) -> float:
    """How far the channels' distributions are apart: Kolmogorov's statistic, median over channels.

    Arguments as for :func:`matched`; a weighted sample counts as (Σ w)² / Σ w² values.
    """
    count = 1 / float(weight @ weight)
    scale = np.sqrt(count * len(now) / (count + len(now)))
    apart = [_apart(before[rows, k], weight[rows], v) for k, rows, v in _channels(before, now)]
    return float(scale * np.median(apart)) if apart else 0.0


def _channels(before: FloatArray, now: FloatArray) -> Iterator[tuple[int, IntArray, FloatArray]]:
    """Number of a channel, rows of ``before`` in the order of its values, and sorted values now."""
    for channel in range(before.shape[1]):
        values = now[np.isfinite(now[:, channel]), channel]
        order = before[:, channel].argsort()
        rows = order[np.isfinite(before[order, channel])]
        if min(len(values), len(rows)) >= _FEWEST_VALUES:
            yield channel, rows, np.sort(values)


def _apart(ours: FloatArray, weight: FloatArray, theirs: FloatArray) -> float:
    """Largest difference of two cumulative distributions of sorted values."""
    both = np.concatenate([ours, theirs])
    share = np.append(0.0, weight.cumsum() / weight.sum())
    first = share[ours.searchsorted(both, side="right")]
    second = theirs.searchsorted(both, side="right") / len(theirs)
    return float(np.abs(first - second).max())
