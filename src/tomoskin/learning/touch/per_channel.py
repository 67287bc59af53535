"""Response maps of rows that are taken one by one, each strongest where its electrodes are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.touch import gaussian_process as gp
from tomoskin.model.pattern import Pattern

_TURNS = 32
"""Positions of the first electrode that are tried, evenly along the rim, for both ways round."""

_OUTSIDE = 1.1
"""Where the electrodes stand, in parts of the way to the rim: a response is finite there."""

_FALL = 0.5
"""Power of the fields' product by which responses vary. This and the number before were chosen on
noPattern, radial and cam09_05, 10, 25 and 60 presses."""

_TRIED_ON, _NOISE = 30, 0.1
"""Presses by which the ring is found, and noise over signal of a row there."""

SURE = float(np.log(2 * _TURNS))
"""Log marginal likelihood by which a ring must explain the presses better than none does: so many
are tried."""


@dataclass(frozen=True, eq=False)
class Envelope:
    """How strongly each row may answer over the sheet, in parts of its answer in the middle.

    The field of two electrodes on an even sheet is largest near them: |a − b| / |x − a| |x − b|. A
    row answers as the product of that of its drive and of its measurement, to a power.
    ``electrodes`` (k, 4, 2) of the rows, in radii; None where they are not known.
    """

    electrodes: FloatArray | None = None

    @classmethod
    def of(cls, pattern: Pattern, rim: FloatArray) -> Self:
        """Of the rows of a pattern whose electrodes are at ``rim`` (n, 2), in radii."""
        return cls(_OUTSIDE * rim[np.hstack([pattern.drive, pattern.measure])])

    def __call__(self, positions: FloatArray) -> FloatArray:
        """(n, k) at ``positions`` (n, 2); (n, 1) of ones where nothing is known."""
        if self.electrodes is None:
            return np.ones((len(positions), 1))
        k = len(self.electrodes)
        points = self.electrodes.reshape(-1, 2)
        away = gp.squared_distances(positions, points) / (points**2).sum(axis=1)
        return np.asarray(
            np.exp(-0.5 * _FALL * np.log(away).reshape(len(positions), k, 4).sum(axis=2))
        )

    def of_rows(self, rows: IntArray) -> Self:
        """The same record for some rows only."""
        return self if self.electrodes is None else type(self)(self.electrodes[rows])


def rings(pattern: Pattern, rim: FloatArray) -> Iterator[Envelope]:
    """Envelopes with the electrodes evenly along the ``rim`` (c, 2), from everywhere both ways.

    Where the first electrode stands, and which way round the others go, is for the presses to tell.
    """
    closed = np.vstack([rim, rim[:1]])
    along = np.append(0.0, np.linalg.norm(np.diff(closed, axis=0), axis=1).cumsum())
    for first in np.arange(_TURNS) / _TURNS:
        for way in (1, -1):
            at = (first + way * np.arange(pattern.n_electrodes) / pattern.n_electrodes) % 1.0
            ring = [np.interp(at * along[-1], along, axis) for axis in closed.T]
            yield Envelope.of(pattern, np.column_stack(ring))


def likeliest_envelope(
    envelopes: Iterator[Envelope], positions: FloatArray, features: FloatArray
) -> Envelope:
    """The envelope of the largest marginal likelihood; none, unless one explains much more.

    Some rows tell which are likely, all of them which one is likeliest.
    """
    some = gp.telling(features.shape[1], _TELL)
    by_some = {
        one: evidence_of(one.of_rows(some), positions, features[:, some]) for one in envelopes
    }
    likely = sorted(by_some, key=lambda envelope: by_some[envelope])[-_LIKELY:]
    none = Envelope()
    by_all = {one: evidence_of(one, positions, features) for one in (none, *likely)}
    best = max(by_all, key=lambda envelope: by_all[envelope])
    return best if by_all[best] > by_all[none] + SURE else none


def evidence_of(envelope: Envelope, positions: FloatArray, features: FloatArray) -> float:
    """Log marginal likelihood of some presses at ``positions`` (n, 2), up to a constant of their
    ``features`` (n, k)."""
    some = gp.telling(len(positions), _TRIED_ON)
    near = gp.Likeness(gp.LENGTHS[len(gp.LENGTHS) // 2])(positions[some], positions[some])
    about = (features[some] - features[some].mean(axis=0)).T
    size = envelope(positions[some]).T
    prior = size[:, :, None] * near * size[:, None, :] + _NOISE * np.eye(len(some))
    root = np.linalg.cholesky(prior)
    white = np.linalg.solve(root, about[:, :, None])[:, :, 0]
    logs = np.log((white**2).mean(axis=1) + _FLOOR) * len(some)
    determinant = 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    return -0.5 * float((logs + determinant).sum())


_RATIOS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0])
"""Noise over signal of a row, as tried."""

_FLOOR = 1e-9

_TELL, _FUNCTIONS = 48, 48
"""Rows that tell the length scale and the likely envelopes, and functions in the basis of a row's
map at most: the work grows with their cube."""

_LIKELY = 6
"""Envelopes that some rows find likeliest are compared by all."""

_FREEDOM = 4.0
"""Degrees of freedom of one row's error: a press may be told wrong by a few rows."""

_TOGETHER, _FARTHEST = 8, np.float32(1e4)
"""Rows whose densities are multiplied before one logarithm is taken, each of at most so much."""

_SINGLE = np.float32


@dataclass(frozen=True, eq=False)
class ChannelMaps:
    """A Gaussian process for each row, with a noise of its own: size · (envelope · map + noise).

    The matrix-variate process knows more, but must learn two covariances of all rows: from some
    twenty presses it learns the noise of a single row less well than the row alone does.

    ``mean``, ``size`` and ``ratio`` (k,) are each row's, the last that of noise over signal;
    ``weights`` (k, m) are those of the functions of the ``basis``, whose covariance over the noise
    has the ``axes`` (k or 1, m, m) with the inverse of ``spread`` (k, m); ``evidence`` is the log
    marginal likelihood up to a constant.
    """

    envelope: Envelope
    basis: gp.Basis
    mean: FloatArray
    size: FloatArray
    ratio: FloatArray
    weights: FloatArray
    axes: FloatArray
    spread: FloatArray
    evidence: float

    @classmethod
    def of(cls, positions: FloatArray, features: FloatArray, envelope: Envelope) -> Self:
        """Maps for ``features`` (n, k) of presses at ``positions`` (n, 2).

        The length scale, of some rows for all, and the noise of each are those of the largest
        evidence.
        """
        some = gp.telling(features.shape[1], _TELL)

        def evidence(length: float) -> float:
            likeness, their = gp.Likeness(length), envelope.of_rows(some)
            return cls._of(likeness, positions, features[:, some], their).evidence

        return cls._of(gp.climbed(evidence), positions, features, envelope)

    @classmethod
    def _of(
        cls,
        likeness: gp.Likeness,
        positions: FloatArray,
        features: FloatArray,
        envelope: Envelope,
        ratio: FloatArray | None = None,
    ) -> Self:
        basis = gp.Basis.of(likeness, positions, _FUNCTIONS)
        n, mean = len(features), features.mean(axis=0)
        about = (features - mean).T
        design = envelope(positions).T[:, :, None] * basis(positions)
        pull = (about[:, None] @ design)[:, 0]
        gram = design.transpose(0, 2, 1) @ design
        ratios = _RATIOS[:, None] if ratio is None else ratio[None]
        if ratio is None or len(gram) == 1:
            weights, axes = np.linalg.eigh(gram)
            along = (pull[:, None] @ axes)[:, 0]
            spread = np.broadcast_to(np.maximum(weights, 0.0), along.shape) + ratios[:, :, None]
        else:  # nothing is chosen: the root of the inverse is found much sooner
            noisy = gram + ratio[:, None, None] * np.eye(gram.shape[1])
            axes = np.linalg.inv(np.linalg.cholesky(noisy)).transpose(0, 2, 1)
            along = (pull[:, None] @ axes)[:, 0]
            spread = np.ones((1, *along.shape))
        total = (about**2).sum(axis=1)
        square = (total - (along**2 / spread).sum(axis=2)) / ratios
        size = np.maximum(square, 0.0) / n + _FLOOR
        logs = np.log(spread / ratios[:, :, None]).sum(axis=2) + n * np.log(ratios * size)
        best, rows = logs.argmin(axis=0), np.arange(len(mean))
        ratio, spread = np.broadcast_to(ratios, logs.shape)[best, rows], spread[best, rows]
        solved = (axes @ (along / spread)[:, :, None])[:, :, 0]
        evidence = -0.5 * float(logs[best, rows].sum())
        return cls(envelope, basis, mean, size[best, rows], ratio, solved, axes, spread, evidence)

    def again(self, positions: FloatArray, features: FloatArray) -> Self:
        """Maps of other presses with the same settings."""
        return self._of(self.basis.likeness, positions, features, self.envelope, self.ratio)

    def at(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (g, k), of the features of a press at ``positions`` (g, 2)."""
        values, envelope = self.basis(positions), self.envelope(positions)
        mean = self.mean + envelope * (values @ self.weights.T)
        along = values.astype(_SINGLE) @ self.axes.astype(_SINGLE)
        known = (along**2 @ (1 / self.spread.astype(_SINGLE))[:, :, None])[:, :, 0].T
        unknown = self.basis.likeness.variance - (values**2).sum(axis=1, keepdims=True)
        prior = np.maximum(unknown, 0.0) + self.ratio * known
        return mean, self.size * np.maximum(envelope**2 * prior + self.ratio, _FLOOR)


@dataclass(frozen=True, eq=False)
class ChannelLikelihood:
    """The maps read at the positions of a grid: a Student density for each row, so that a row that
    is told wrong costs little.

    ``mean``, ``steep`` (k, g): the answer, and one over its deviation; ``volume`` (g,).
    """

    mean: NDArray[np.float32]
    steep: NDArray[np.float32]
    volume: FloatArray

    @classmethod
    def of(cls, maps: ChannelMaps, grid: FloatArray) -> Self:
        """For the places ``grid`` (g, 2)."""
        mean, variance = maps.at(grid)
        short = -mean.shape[1] % _TOGETHER
        wide = ((0, 0), (0, short))
        steep = np.pad(1 / np.sqrt(_FREEDOM * variance), wide)
        return cls(
            np.pad(mean, wide).astype(_SINGLE).T.copy(),
            steep.astype(_SINGLE).T.copy(),
            0.5 * np.log(variance).sum(axis=1),
        )

    def __call__(self, features: FloatArray) -> FloatArray:
        """(n, g) log-likelihood of each place, up to a constant of the frame."""
        wide = np.zeros((len(features), len(self.mean)), _SINGLE)
        wide[:, : features.shape[1]] = features
        return np.stack([self._of_one(frame) for frame in wide])

    def _of_one(self, frame: NDArray[np.float32]) -> FloatArray:
        misfit = (frame[:, None] - self.mean) * self.steep
        misfit *= misfit
        misfit += 1
        np.minimum(misfit, _FARTHEST, out=misfit)
        product = misfit.reshape(_TOGETHER, -1, misfit.shape[1]).prod(axis=0)
        logs = np.log(product).sum(axis=0, dtype=np.float64)
        return np.asarray(-0.5 * (_FREEDOM + 1) * logs - self.volume)
