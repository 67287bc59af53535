"""Response maps of rows that are taken one by one: what few presses can tell of a row's noise, and
what rows that the pattern's table turns into each other tell together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.touch.gaussian_process import LENGTHS, Basis, Likeness
from tomoskin.model.pattern import Pattern

_DECIMALS = 9
"""Of an angle, so that equal ones are equal."""


@dataclass(frozen=True, eq=False)
class Rotations:
    """Which rows are alike on a uniform round skin whose electrodes stand evenly around it.

    ``orbit`` (k,): rows of one number become each other when all electrodes move on by some;
    ``angle`` (k,) rad by which a row is turned against the first of its orbit. Whether a real
    skin is like that, and which way round its electrodes go, is for the presses to tell.
    """

    orbit: IntArray
    angle: FloatArray

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """By the electrodes' numbers alone."""
        table = np.hstack([pattern.drive, pattern.measure])
        row_of = {tuple(electrodes): row for row, electrodes in enumerate(table.tolist())}
        n = pattern.n_electrodes
        orbit, angle = np.arange(len(table)), np.zeros(len(table))
        for steps in range(1, n):
            first = [row_of.get(tuple(e), len(table)) for e in ((table - steps) % n).tolist()]
            earlier = np.array(first) < orbit
            orbit = np.where(earlier, first, orbit)
            angle = np.where(earlier, 2 * np.pi * steps / n, angle)
        return cls(orbit, np.round(angle, _DECIMALS))

    @classmethod
    def none(cls, n_rows: int) -> Self:
        """Where the pattern is not known: one group, nothing turned."""
        return cls(np.zeros(n_rows, dtype=np.int64), np.zeros(n_rows))

    def of_rows(self, rows: IntArray) -> Self:
        """The rotations of these measurements only."""
        return type(self)(self.orbit[rows], self.angle[rows])

    def reversed(self) -> Self:
        """The same with the electrodes the other way round."""
        return replace(self, angle=np.round(-self.angle % (2 * np.pi), _DECIMALS))

    @property
    def any(self) -> bool:
        """Whether there is a turned row at all."""
        return bool(self.angle.any())


def turned(positions: FloatArray, angle: float) -> FloatArray:
    """``positions`` (n, 2) as a row that is turned by ``angle`` sees them: turned back."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(positions @ np.array([[c, -s], [s, c]]))


_RATIOS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0])
"""Noise over signal of a row, as tried."""

_FLOOR = 1e-9


@dataclass(frozen=True, eq=False)
class PerChannelFeatures:
    """Features in the modes of the presses: ``rows`` (n, k) about their ``mean`` (k,), and the
    ``size`` (k,) of each row's signal and its ``noise`` over that, likeliest for the row alone.
    """

    mean: FloatArray
    rows: FloatArray
    size: FloatArray
    noise: FloatArray


@dataclass(frozen=True, eq=False)
class LikenessModes:
    """Presses at ``positions`` (n, 2) in the ``axes`` (n, n) of their likeness.

    ``weights`` (n,) are those of the axes. ``common`` holds what a row and its turned copies share:
    functions of the turned position, whose values at the presses are ``values`` for each angle.
    """

    likeness: Likeness
    positions: FloatArray
    weights: FloatArray
    axes: FloatArray
    common: Basis
    values: dict[float, FloatArray]

    @classmethod
    def of(cls, likeness: Likeness, positions: FloatArray, angles: FloatArray) -> Self:
        """For rows that are turned by one of ``angles``."""
        weights, axes = np.linalg.eigh(likeness(positions, positions))
        copies = {angle: turned(positions, angle) for angle in np.unique(angles).tolist()}
        common = Basis.of(likeness, np.concatenate([*copies.values()]))
        values = {angle: axes.T @ common(copy) for angle, copy in copies.items()}
        return cls(likeness, positions, np.maximum(weights, 0.0), axes, common, values)

    def alone(self, features: FloatArray) -> PerChannelFeatures:
        """What each row of ``features`` (n, k) tells by itself (Rasmussen & Williams 2006, 5.8)."""
        n, mean = features.shape[0], features.mean(axis=0)
        rows = self.axes.T @ (features - mean)
        spread = self.weights[:, None] + _RATIOS
        size = (1 / spread).T @ rows**2 / n + _FLOOR
        log = -0.5 * n * np.log(size) - 0.5 * np.log(spread).sum(axis=0)[:, None]
        best = log.argmax(axis=0)
        return PerChannelFeatures(mean, rows, size[best, np.arange(len(mean))], _RATIOS[best])

    def at(self, positions: FloatArray) -> tuple[FloatArray, dict[float, FloatArray]]:
        """(g, n) of the likeness and, for each angle, (g, m) of what is common."""
        near = self.likeness(positions, self.positions) @ self.axes
        return near, {angle: self.common(turned(positions, angle)) for angle in self.values}


@dataclass(frozen=True, eq=False)
class OrbitMaps:
    """Maps of rows that are turned copies of each other: √size (√share g(turned x) + h(x) + noise).

    g is the same for all, h is each row's own with the rest of the variance: two Gaussian processes
    of one likeness. Without a ``share`` each row stands for itself. ``angles`` (r,) of the rows;
    ``residual`` (n, r), ``spread`` (n, r): what g leaves over its variance, and that; ``pull``
    (m,) and ``root`` (m, m): mean of g's coefficients and a root of their covariance.
    """

    modes: LikenessModes
    angles: FloatArray
    share: float
    mean: FloatArray
    size: FloatArray
    noise: FloatArray
    residual: FloatArray
    spread: FloatArray
    pull: FloatArray
    root: FloatArray
    evidence: float

    @classmethod
    def of(
        cls, modes: LikenessModes, alone: PerChannelFeatures, angles: FloatArray, share: float
    ) -> Self:
        """From rows that have been looked at alone, turned by ``angles``."""
        rows = alone.rows / np.sqrt(alone.size)
        spread = (1 - share) * modes.weights[:, None] + alone.noise
        functions = len(modes.common.root.T) if share else 0
        values = np.stack([modes.values[angle][:, :functions] for angle in angles.tolist()])
        weighed = (values / np.sqrt(spread.T)[:, :, None]).reshape(spread.size, functions)
        precision = np.eye(functions) / (share or 1.0) + weighed.T @ weighed
        root = np.linalg.inv(np.linalg.cholesky(precision))
        weighted = root @ (weighed.T @ (rows / np.sqrt(spread)).T.ravel())
        pull = root.T @ weighted
        residual = (rows - (values @ pull).T) / spread
        evidence = (
            0.5 * float(weighted @ weighted)
            + float(np.log(np.diag(root)).sum())
            - 0.5 * functions * float(np.log(share or 1.0))
            - 0.5 * float((rows**2 / spread + np.log(spread) + np.log(alone.size)).sum())
        )
        numbers = alone.mean, alone.size, alone.noise, residual, spread, pull, root, evidence
        return cls(modes, angles, share, *numbers)

    def at(
        self, near: FloatArray, common: dict[float, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (g, r); ``near`` and ``common`` of :meth:`LikenessModes.at`."""
        own = 1 - self.share
        mean = own * near @ self.residual
        variance = own * self.modes.likeness.variance + self.noise
        variance = variance - own**2 * near**2 @ (1 / self.spread)
        for row, angle in enumerate(self.angles.tolist() if self.share else ()):
            there, values = common[angle], self.modes.values[angle]
            mean[:, row] += there @ self.pull
            rest = there - own * near @ (values / self.spread[:, row, None])
            variance[:, row] += ((rest @ self.root.T) ** 2).sum(axis=1)
        return self.mean + np.sqrt(self.size) * mean, self.size * np.maximum(variance, _FLOOR)


_SHARED = 256
"""Rows above which turned copies share nothing: it takes long, and so many rows tell enough."""

_SHARES = (0.3, 0.6, 0.85)
"""Part of a row's variance that its turned copies have in common, as tried beside none with the
length scale that is likeliest then."""

_FREEDOM = 4.0
"""Degrees of freedom of one row's error: a press may be told wrong by a few rows."""

_TOGETHER, _FARTHEST = 8, np.float32(1e4)
"""Rows whose densities are multiplied before one logarithm is taken, each of at most so much."""

_SINGLE = np.float32


@dataclass(frozen=True, eq=False)
class ChannelMaps:
    """A Gaussian process for each row, with a noise of its own and a share in its turned copies.

    The matrix-variate process knows more, but must learn two covariances of all rows: from some
    twenty presses it learns the noise of a single row less well than the row alone does.

    ``groups`` are the rows of each group, whose maps are ``orbits``.
    """

    rotations: Rotations
    groups: tuple[IntArray, ...]
    orbits: tuple[OrbitMaps, ...]

    @classmethod
    def of(cls, positions: FloatArray, features: FloatArray, rotations: Rotations) -> Self:
        """Maps for ``features`` (n, k) of presses at ``positions`` (n, 2).

        Of each group of rows the length scale, then the share, and the way round of all, are those
        of the largest marginal likelihood.
        """
        if features.shape[1] > _SHARED:
            rotations = Rotations.none(features.shape[1])
        ways = (rotations, rotations.reversed()) if rotations.any else (rotations,)
        angles = np.concatenate([way.angle for way in ways])
        modes = [LikenessModes.of(Likeness(length), positions, angles) for length in LENGTHS]
        return max((cls._of(modes, features, way) for way in ways), key=lambda m: m.evidence)

    @classmethod
    def _of(
        cls, modes: Sequence[LikenessModes], features: FloatArray, rotations: Rotations
    ) -> Self:
        groups = tuple(
            np.flatnonzero(rotations.orbit == orbit) for orbit in np.unique(rotations.orbit)
        )
        orbits = []
        for rows in groups:
            angles, some = rotations.angle[rows], features[:, rows]
            alone = [OrbitMaps.of(m, m.alone(some), angles, 0.0) for m in modes]
            best = max(alone, key=lambda maps: maps.evidence)
            for share in _SHARES if rotations.any else ():
                shared = OrbitMaps.of(best.modes, best.modes.alone(some), angles, share)
                best = max(best, shared, key=lambda maps: maps.evidence)
            orbits.append(best)
        return cls(rotations, groups, tuple(orbits))

    def again(self, positions: FloatArray, features: FloatArray) -> Self:
        """Maps of other presses with the same settings."""
        angle, lengths = self.rotations.angle, {maps.modes.likeness for maps in self.orbits}
        modes = {likeness: LikenessModes.of(likeness, positions, angle) for likeness in lengths}
        orbits = []
        for rows, maps in zip(self.groups, self.orbits, strict=True):
            theirs = modes[maps.modes.likeness]
            alone = theirs.alone(features[:, rows])
            orbits.append(OrbitMaps.of(theirs, alone, angle[rows], maps.share))
        return replace(self, orbits=tuple(orbits))

    @property
    def evidence(self) -> float:
        """Log marginal likelihood, up to a constant of the features."""
        return sum(maps.evidence for maps in self.orbits)

    def at(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (g, k), of the features of a press at ``positions`` (g, 2)."""
        mean, variance = np.empty((2, len(positions), len(self.rotations.angle)))
        modes = {maps.modes.likeness: maps.modes for maps in self.orbits}
        values = {likeness: m.at(positions) for likeness, m in modes.items()}
        for rows, maps in zip(self.groups, self.orbits, strict=True):
            mean[:, rows], variance[:, rows] = maps.at(*values[maps.modes.likeness])
        return mean, variance


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
        short = len(self.mean) - features.shape[1]
        wide = np.pad(features, ((0, 0), (0, short))).astype(_SINGLE)
        return np.stack([self._of_one(frame) for frame in wide])

    def _of_one(self, frame: NDArray[np.float32]) -> FloatArray:
        misfit = (frame[:, None] - self.mean) * self.steep
        misfit *= misfit
        misfit += 1
        np.minimum(misfit, _FARTHEST, out=misfit)
        product = misfit.reshape(_TOGETHER, -1, misfit.shape[1]).prod(axis=0)
        logs = np.log(product).sum(axis=0, dtype=np.float64)
        return np.asarray(-0.5 * (_FREEDOM + 1) * logs - self.volume)
