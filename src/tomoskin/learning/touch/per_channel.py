"""Response maps of rows that are taken one by one: what few presses can tell of a row's noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.touch.process import LENGTHS, Likeness
from tomoskin.learning.touch.rotations import LikenessModes, OrbitMaps, Rotations

_SHARES = (0.0, 0.3, 0.6, 0.85)
"""Part of a row's variance that its turned copies have in common, as tried."""

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

        Of each group of rows the length scale and the share, and the way round of all, are those
        of the largest marginal likelihood.
        """
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
        shares = _SHARES if rotations.any else (0.0,)
        orbits = (
            max(
                (
                    OrbitMaps.of(m, m.alone(features[:, rows]), rotations.angle[rows], share)
                    for m in modes
                    for share in shares
                ),
                key=lambda maps: maps.evidence,
            )
            for rows in groups
        )
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
