"""What a classifier answers for frames that it was not taught: whole repetitions are left out.

Frames of one repetition are nearly the same, so one that stays in the learning gives away those
that are left out: all that is said of a classifier comes from runs of equal labels left out whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tomoskin.core import FloatArray, IntArray
from tomoskin.extras.classes.examples import Examples
from tomoskin.extras.classes.mixture import Mixture, Subspace, posterior, session_mean, shrunk

_FOLDS = 5

_PARTS = (None, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0)
"""By how much a covariance is drawn to a sphere, as tried; None: as frames would have it that do
not depend on each other."""

_SHARPNESS = np.geomspace(0.003, 1.6, 32)
_TEMPERED = np.geomspace(1e-3, 1.6, 60)

_FEWEST = 3
"""Classes of which one can be taken for one that was not taught."""

_NO_COVARIANCE = np.zeros((0, 0))
"""Of what has no covariance yet."""

_ODD = 0.02
"""Part of the labelled frames that may show anything, when covariances are compared."""

_KNOWN = 0.95
"""Part of the frames of known classes that are not called unknown."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """The newest session's frames, each as learnt from other repetitions.

    Attributes
    ----------
    truth, run
        (n,) number of the combination that a frame shows, and of its run of equal labels.
    residual
        (n, n_meas) of each frame from what the other repetitions say of its combination.
    distances, strange
        (n, k) squared distances to the combinations, (n,) how unlike all of them.
    part
        By how much the covariance of ``residual`` was drawn to a sphere.
    """

    truth: IntArray
    run: IntArray
    residual: FloatArray
    distances: FloatArray
    strange: FloatArray
    part: float | None

    @classmethod
    def of(cls, examples: Examples, run: IntArray) -> HeldOut:
        """With the covariance under which left-out labels are likeliest; ``run`` (n,) of labelled
        examples, see :func:`runs_of`."""
        newest = examples.newest
        truth = examples.codes.numbers(examples.flags[newest])
        fold = folds_of(truth, run[newest])
        folds = list(_folds(examples, fold))
        group = truth if examples.codes.exclusive else fold
        residual = np.zeros((len(truth), examples.dv.shape[1]))
        for one in folds:
            residual[one.out] = one.residual(truth)
        tried = [_answered(folds, residual, group, part) for part in _PARTS]
        best = max(zip(tried, _PARTS, strict=True), key=lambda one: _likely(one[0][0], truth).max())
        return cls(truth, run[newest], residual, *best[0], part=best[1])

    def covariance(self, subspace: Subspace) -> FloatArray:
        """(d, d) of a frame of another repetition about its combination."""
        return shrunk((self.residual / subspace.scale) @ subspace.axes, self.part)

    @property
    def right(self) -> float:
        """Part of the frames whose combination is the nearest one."""
        return float(np.mean(self.distances.argmin(axis=1) == self.truth))

    def noticed(self, width: int) -> float:
        """Part of the frames that would be called unknown had their own class not been taught;
        ``width``: the number of directions. NaN where flags are set together."""
        if len(self.distances[0]) < _FEWEST:
            return math.nan
        others = self.distances.copy()
        others[np.arange(len(others)), self.truth] = np.inf
        beyond = (others.min(axis=1) - self.distances.min(axis=1)) / width
        return float(np.mean(self.strange + beyond > self.limit))

    @property
    def sharpness(self) -> float:
        """Temperature of the probabilities at which their mean is the part that is right: the
        likeliest one (Guo et al. 2017) follows the few frames that are furthest off."""
        return tempered(self.distances, self.right)

    @property
    def limit(self) -> float:
        """Strangeness that one frame in twenty of a new repetition exceeds (log-normal): there are
        as many independent ones as repetitions."""
        log = np.log(self.strange)
        n = len(np.unique(self.run))
        reach = stdtrit(n - 1, _KNOWN) * np.sqrt(1 + 1 / n)
        return float(np.exp(log.mean() + reach * log.std(ddof=1)))


def runs_of(examples: Examples) -> IntArray:
    """(n,) number of the run of equal labels in one session that each frame belongs to."""
    numbers = examples.codes.numbers(examples.flags)
    changed = (numbers[1:] != numbers[:-1]) | (examples.session[1:] != examples.session[:-1])
    return np.concatenate([[0], np.cumsum(changed)])


def folds_of(truth: IntArray, run: IntArray) -> IntArray:
    """(n,) in which of five folds each frame is left out: with all of its run, or where a
    combination has one run only, with the part of it that is next to it in time."""
    fold = np.zeros(len(truth), dtype=np.int64)
    for number in np.unique(truth):
        mine = np.flatnonzero(truth == number)
        runs, place = np.unique(run[mine], return_inverse=True)
        alone = np.arange(len(mine)) * _FOLDS // len(mine)
        fold[mine] = alone if len(runs) == 1 else place.reshape(-1) % _FOLDS
    return fold


def learnt(
    subspace: Subspace, taught: Examples, complete: Examples, covariance: FloatArray | None = None
) -> Mixture:
    """Learnt from labelled frames, each session about the mean of the whole of it; ``covariance``
    (d, d) of a frame about its combination, that of the same frames without it."""
    x = np.empty((len(taught), subspace.axes.shape[1]))
    for number in np.unique(taught.session):
        middle = session_mean(complete.dv[complete.session == number])
        chosen = taught.session == number
        x[chosen] = subspace.whitened(taught.dv[chosen], middle) @ subspace.axes
    group = np.unique(taught.session, return_inverse=True)[1].reshape(-1)
    return Mixture.of(complete.codes.table, x, taught.flags, group, covariance)


def compared(subspace: Subspace, mixture: Mixture, dv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, k) squared distances of frames to the combinations; (n,) their strangeness.

    A frame is strange by how far it is from the nearest combination, inside and beside the
    directions.
    """
    white = subspace.whitened(dv)
    x = white @ subspace.axes
    distances = mixture.distances(x)
    inside = distances.min(axis=1) / x.shape[1]
    return distances, inside + subspace.outside(white, x)


@dataclass(frozen=True, eq=False)
class _Fold:
    """Frames ``out`` (n,) of the newest session, left out; what the others have taught."""

    out: NDArray[np.bool_]
    dv: FloatArray
    subspace: Subspace
    means: FloatArray
    mixture: Mixture

    def residual(self, truth: IntArray) -> FloatArray:
        """(n_out, n_meas) of the left-out frames, ``truth`` (n,) the number of each one's class."""
        white = self.subspace.whitened(self.dv) - self.means[truth[self.out]]
        return np.asarray(np.where(np.isfinite(self.dv), white, 0.0) * self.subspace.scale)

    def answered(
        self, inside: FloatArray, own: NDArray[np.bool_], part: float | None
    ) -> tuple[FloatArray, FloatArray]:
        """Distances and strangeness of its ``own`` frames (n_out,), by residuals ``inside`` (m, d)
        the directions that do not speak of them."""
        mixture = replace(self.mixture, covariance=shrunk(inside, part))
        return compared(self.subspace, mixture, self.dv[own])


def _folds(examples: Examples, fold: IntArray) -> Iterator[_Fold]:
    newest = examples.newest
    asked = examples.dv[newest]
    for number in np.unique(fold):
        kept = ~newest
        kept[newest] = fold != number
        rest = examples.part(kept)
        subspace = Subspace.of(rest)
        rows = replace(subspace, axes=np.eye(len(subspace.scale)))
        means = learnt(rows, rest, rest, _NO_COVARIANCE).means
        mixture = learnt(subspace, rest, rest, _NO_COVARIANCE)
        yield _Fold(fold == number, asked[fold == number], subspace, means, mixture)


def _answered(
    folds: Sequence[_Fold], residual: FloatArray, group: IntArray, part: float | None
) -> tuple[FloatArray, FloatArray]:
    """Distances and strangeness of all left-out frames, each by the residuals of other groups."""
    distances = np.zeros((len(residual), len(folds[0].mixture.table)))
    strange = np.zeros(len(residual))
    for one in folds:
        inside = (residual / one.subspace.scale) @ one.subspace.axes
        for number in np.unique(group[one.out]):
            own = one.out & (group == number)
            answers = one.answered(inside[group != number], group[one.out] == number, part)
            distances[own], strange[own] = answers
    return distances, strange


def _likely(distances: FloatArray, truth: IntArray) -> FloatArray:
    """Mean log probability of the labels at each temperature, where some frames are anything."""
    rows, odd = np.arange(len(truth)), _ODD / distances.shape[1]
    likely = [(1 - _ODD) * posterior(distances, s)[rows, truth] + odd for s in _SHARPNESS]
    return np.asarray(np.log(np.array(likely)).mean(axis=1))


def tempered(distances: FloatArray, reliability: float) -> float:
    """Temperature of the probabilities at which their mean is at most ``reliability``."""
    said = np.array([posterior(distances, s).max(axis=1).mean() for s in _TEMPERED])
    return float(_TEMPERED[max(int((said <= reliability).sum()) - 1, 0)])
