"""Posterior of a position, and estimates of presses that were held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.learning.touch import gaussian_process as gp
from tomoskin.learning.touch.maps import ResponseMaps, principal
from tomoskin.learning.touch.per_channel import ChannelLikelihood, ChannelMaps, Envelope

BoolArray = NDArray[np.bool_]

POWERS = 1 / np.array([1, 1.5, 2, 3, 4, 6, 9, 14, 20, 30, 45, 70])
"""To which a likelihood may be raised: rows err together in ways that maps do not know."""

_LEAST = 1e-6

_SHAPE, _ALIKE = 0.01, 0.1
"""Part of the features' squares that presses may always differ by in their shape, and the least
correlation of two shapes that is told from none."""


@dataclass(frozen=True, eq=False)
class GridLikelihood:
    """Maps read at the positions of a grid, ready for frames.

    A feature vector of k values has a Student density of k degrees of freedom about each place's
    answer: the covariances were learnt from few presses, and a frame far from every map must
    not be called certain.
    """

    maps: ResponseMaps
    precision: FloatArray
    answer: FloatArray
    offset: FloatArray
    volume: FloatArray
    shapes: FloatArray

    @classmethod
    def of(cls, maps: ResponseMaps, positions: FloatArray) -> Self:
        """For the grid ``positions`` (g, 2)."""
        mean, variance = maps.at(positions)
        answer = mean / variance
        offset = (mean * answer).sum(axis=1)
        volume = np.log(variance).sum(axis=1)
        precision = np.ascontiguousarray(1 / variance.T)
        shapes = _of_length_one(maps.features_at(positions))
        return cls(maps, precision, answer.T.copy(), offset, 0.5 * volume, shapes)

    def misfit(self, features: FloatArray) -> FloatArray:
        """(n, g) mean square of what frames (n, k) differ by from each place's answer, in units
        of the noise."""
        f = self.maps.whitened(features)
        total = (f * f) @ self.precision - 2 * (f @ self.answer) + self.offset
        return np.asarray(np.maximum(total, 0.0) / f.shape[1])

    def unlike(self, features: FloatArray, misfit: FloatArray) -> FloatArray:
        """(n, 2) how unlike any press frames (n, k) of this ``misfit`` are.

        The least misfit, and what no answer explains of the features' squares over what one does,
        however hard the press: weak frames of another skin fit within the noise, but not in their
        shape.
        """
        alike = (_of_length_one(features) @ self.shapes.T).max(axis=1)
        explained = np.maximum(alike, _ALIKE) ** 2
        return np.column_stack([misfit.min(axis=1), (1 - explained) / explained])

    def of_misfit(self, misfit: FloatArray) -> FloatArray:
        """(n, g) log-likelihood of each place, up to a constant of the frame."""
        return np.asarray(-len(self.precision) * np.log1p(misfit) - self.volume)


def _of_length_one(features: FloatArray) -> FloatArray:
    return np.asarray(features / (np.linalg.norm(features, axis=1, keepdims=True) + _LEAST))


def pooled(log_likelihoods: Sequence[FloatArray], powers: FloatArray) -> FloatArray:
    """(n, g) probabilities of the grid's positions: the product of powers of each likelihood.

    A logarithmic opinion pool (Genest & Zidek 1986); a single one is tempered by its power.
    """
    scaled = sum(power * part for power, part in zip(powers, log_likelihoods, strict=False))
    weight = np.exp(scaled - scaled.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def powers_of(
    log_likelihoods: Sequence[FloatArray], grid: FloatArray, xy: FloatArray
) -> FloatArray:
    """The power of each likelihood at which held-out presses at ``xy`` are likeliest.

    ``log_likelihoods`` two (n, g), of presses that the maps have not seen. A pool's sum over the
    grid is a product of what each power makes of both.
    """
    nearest = gp.squared_distances(xy, grid).argmin(axis=1)[:, None, None]
    tried = np.append(0.0, POWERS)
    logs = [
        tried[:, None] * (part - part.max(axis=1, keepdims=True))[:, None]
        for part in log_likelihoods
    ]
    first, second = (np.exp(part) for part in logs)
    there = [np.take_along_axis(part, nearest, axis=2) for part in logs]
    own = np.exp(there[0] + there[1].transpose(0, 2, 1))
    total = np.maximum(first @ second.transpose(0, 2, 1), np.finfo(float).tiny)
    score = np.log(own / total + _LEAST).sum(axis=0)
    best = np.unravel_index(score.argmax(), score.shape)
    return tried[list(best)]


_TELL = 96
"""Rows that tell the length scale of the maps: half as many chose worse on radial."""

_MOST = 200
"""Presses that maps of single rows are learnt from: more tell a row little more of its noise, and
the work grows with their cube."""

_SCARCE = 20
_FOLDS = (8, 5)
"""In which presses are left out, when they are scarce and when they are not."""

_NEAR = 0.5
"""Mean squared step, in parts of that between any two presses, below which they are in an order."""

_LESS = 2
"""Presses by which left-out ones are less like the maps of the others than presses to come are
like all: chosen on cam09_05, 25 presses."""

_USUAL, _OWN, _DOUBTS = 1.25, 0.75, 1.5
"""Strangeness from which a frame's position is doubted, or that of this part of the left-out
presses where that is more; and by how much more a deviation of one radius is added. The first and
last were chosen on noPattern, radial and cam09_05, learnt from 25, 100 and 400 presses of one and
asked on the last presses of it and on the others; the second so that what is learnt in many
months, of a skin that ages, is not doubted."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """Posterior mean and covariance of a place.

    ``powers`` weigh the log-likelihoods of ``likelihood``, and of ``per_channel`` where that
    stands. ``usual`` (2,) is how unlike the others half of the left-out presses are, ``strange``
    the strangeness from which a frame is doubted. ``left_out`` (n, 2) and ``left_out_spread``
    (n, 2, 2) are those of the presses themselves, each from maps learnt without it and some others.
    """

    grid: FloatArray
    likelihood: GridLikelihood
    per_channel: ChannelLikelihood | None
    powers: FloatArray
    usual: FloatArray
    strange: float
    left_out: FloatArray
    left_out_spread: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        positions: FloatArray,
        grid: FloatArray,
        envelope: Envelope,
    ) -> Self:
        """Learn the maps; length scales by evidence, powers by left-out presses."""
        n, few = len(positions), gp.telling(len(positions), _MOST)
        likeness = _likeliest(positions, features)
        maps = ResponseMaps.of(likeness, positions, features, principal(features))
        channels = ChannelMaps.of(positions[few], features[few], envelope)
        misfit, alone, folds = np.empty((n, len(grid))), np.empty((n, len(grid))), []
        unlike = np.empty((n, 2))
        for out in _folds(positions):
            some, theirs = positions[~out], features[~out]
            learnt = ResponseMaps.of(likeness, some, theirs, principal(theirs))
            folds.append(GridLikelihood.of(learnt, grid))
            spread = gp.telling(len(some), _MOST)
            single = ChannelLikelihood.of(channels.again(some[spread], theirs[spread]), grid)
            misfit[out], alone[out] = folds[-1].misfit(features[out]), single(features[out])
            unlike[out] = folds[-1].unlike(features[out], misfit[out])
        parts = [folds[0].of_misfit(misfit), alone]
        powers = powers_of([part[few] for part in parts], grid, positions[few])
        left_out = gp.moments(pooled(parts, powers), grid)
        per_channel = ChannelLikelihood.of(channels, grid) if powers[1] else None
        usual = np.maximum(np.median(unlike, axis=0), (_LEAST, _SHAPE))
        fewer = (n - _LESS) / (n + _LESS)
        usual *= np.median((unlike / usual).max(axis=1)) * fewer
        own = fewer**3 * float(np.quantile((unlike / usual).max(axis=1), _OWN))  # tails grow more
        likelihood = GridLikelihood.of(maps, grid)
        return cls(grid, likelihood, per_channel, powers, usual, max(_USUAL, own), *left_out)

    def __call__(self, features: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean (n, 2), covariance (n, 2, 2) and strangeness (n,) of frames (n, k).

        A frame is strange by how unlike the presses it is, in parts of what is usual.
        """
        misfit = self.likelihood.misfit(features)
        parts = [self.likelihood.of_misfit(misfit)]
        if self.per_channel is not None:
            parts.append(self.per_channel(features))
        mean, covariance = gp.moments(pooled(parts, self.powers), self.grid)
        unlike = self.likelihood.unlike(features, misfit)
        return mean, covariance, (unlike / self.usual).max(axis=1)

    def doubt(self, strangeness: FloatArray) -> FloatArray:
        """(n,) deviation, in radii of the region, that strange frames have beyond their covariance.

        Such frames are of a skin that has changed, of another skin, or of no single touch.
        """
        return np.asarray(np.maximum(strangeness - self.strange, 0.0) / _DOUBTS)

    @cached_property
    def least_known(self) -> FloatArray:
        """(2,) place of the grid at which a press would change the maps most.

        Its answers have the largest prior variance over the noise: the expected information
        ½ Σ log(1 + signal / noise) (MacKay 1992).
        """
        return np.asarray(self.grid[int(self.likelihood.volume.argmax())])


def _likeliest(positions: FloatArray, features: FloatArray) -> gp.Likeness:
    """The likeness of the maps' largest evidence, as some of the rows tell."""
    some = gp.telling(features.shape[1], _TELL)
    alone = np.eye(len(some))
    return gp.climbed(
        lambda length: (
            ResponseMaps.of(gp.Likeness(length), positions, features[:, some], alone).evidence
        )
    )


def _folds(positions: FloatArray) -> list[BoolArray]:
    """(n,) which presses are left out together.

    Folds are stretches of time, so that they are as strange to each other as presses to come; but
    where presses follow each other over the skin, a stretch of time is a part of the skin.
    """
    n = len(positions)
    folds = min(_FOLDS[n >= _SCARCE], n)
    order = np.arange(n)
    fold = order * folds // n if _in_any_order(positions) else order % folds
    return [fold == k for k in range(folds)]


def _in_any_order(positions: FloatArray) -> bool:
    """Whether presses that follow each other are about as far apart as any two."""
    step = float((np.diff(positions, axis=0) ** 2).sum(axis=1).mean())
    return step > _NEAR * 2 * float(positions.var(axis=0).sum())
