"""Noise beyond what was learnt: seen in what the touches of a frame leave, and believed at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.pattern import Pattern, Scan
from tomoskin.touch.fit.noise import Whitener

_LIMIT = 6.0
"""Deviations by which the mean square of a channel's residual must exceed 1 to be more noise."""

_MARGIN = 1.5
"""What one frame shows of a variance is taken times this: it is a rough estimate."""

_CALM = 8
"""Frames without more noise after which no more is believed than they have shown."""

_UNEVEN = 0.15
"""Part of what touches change that they may leave, though the noise is as it was."""

_SAID = 3.0
"""Times the usual noise, in deviations, from which it is said."""

_FEWEST = 3
_GONE = 0.2


@dataclass(frozen=True, eq=False)
class Channels:
    """What may turn noisy by itself: an electrode's samples, or a measuring pair's rows.

    Attributes
    ----------
    parts
        (n_parts, n_meas): what one sample, or one row, does to the rows.
    channel
        (n_parts,) that each is of: electrodes first, then pairs.
    names
        Of the channels, for people.
    """

    parts: FloatArray
    channel: IntArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """Of the rows of a pattern."""
        scan, rows = Scan.of(pattern), np.arange(pattern.n_meas)
        samples = np.zeros((scan.n_samples, pattern.n_meas))
        samples[scan.plus, rows], samples[scan.minus, rows] = 1.0, -1.0
        pairs, pair = np.unique(np.sort(pattern.measure, axis=1), axis=0, return_inverse=True)
        n = pattern.n_electrodes
        names = [f"E{e + 1}" for e in range(n)]
        names += [f"E{a + 1} to E{b + 1}" for a, b in pairs.tolist()]
        channel = np.concatenate([scan.sample_electrode, n + pair.reshape(-1)])
        return cls(np.concatenate([samples, np.eye(pattern.n_meas)]), channel, tuple(names))


@dataclass(frozen=True, eq=False)
class Gauge:
    """Channels as one whitening shows them.

    Attributes
    ----------
    directions
        (n_parts, r) of length 1.
    means
        (n_channels, n_parts) averages over the parts that can be seen.
    variance
        (n_channels,) V² of noise in a part that shows as much as all other noise in its direction.
    limit
        (n_channels,) mean squares beyond which a channel is noisier; infinite where too few of its
        parts can be seen.
    """

    directions: FloatArray
    means: FloatArray
    variance: FloatArray
    limit: FloatArray

    @classmethod
    def of(cls, channels: Channels, whiten: Whitener) -> Self:
        """Of the ``channels`` in data made white by ``whiten``."""
        seen = whiten(channels.parts)
        squares = np.einsum("pr,pr->p", seen, seen)
        shows = squares > 1e-6 * np.median(squares)
        directions = seen / np.sqrt(np.where(shows, squares, 1.0))[:, None] * shows[:, None]
        members = (channels.channel == np.arange(len(channels.names))[:, None]) & shows
        count = members.sum(axis=1)
        means = members / np.maximum(count, 1)[:, None]
        variance = means @ (1 / np.where(shows, squares, np.inf))
        spread = np.array([
            np.linalg.norm(directions[own] @ directions[own].T) / max(len(own), 1)
            for own in map(np.flatnonzero, members)
        ])  # fmt: skip
        limit = np.where(count >= _FEWEST, 1 + _LIMIT * np.sqrt(2) * spread, np.inf)
        return cls(directions, means, variance, limit)

    def squares(self, residual: FloatArray, predicted: FloatArray) -> FloatArray:
        """(n_channels,) mean squares of a ``residual`` (r,); 1 where the noise is as it should be.

        What touches that change ``predicted`` (r,) may leave is no noise.
        """
        left = self.means @ (self.directions @ residual) ** 2
        if not predicted.any():
            return np.asarray(left)
        told = self.means @ (self.directions @ predicted) ** 2
        return np.asarray(left - _UNEVEN**2 * (told + told.mean()))


@dataclass(frozen=True, eq=False)
class Excess:
    """Noise beyond what was learnt.

    Attributes
    ----------
    level
        Variance of all rows, in parts of what was learnt; 1 at the least.
    variance
        (n_channels,) V² that each part of a channel has beside, before it is taken so many times.
    calm
        Frames since it rose, or was looked at anew.
    seen
        (n_channels,) largest mean squares in these, of noise with the excess.
    """

    level: float
    variance: FloatArray
    calm: int
    seen: FloatArray

    @classmethod
    def none(cls, channels: Channels) -> Self:
        """As it was learnt."""
        none = np.zeros(len(channels.names))
        return cls(1.0, none, 0, none)

    @property
    def any(self) -> bool:
        """Whether there is some."""
        return self.level > 1.0 or bool(self.variance.any())

    @property
    def key(self) -> bytes:
        """The same for the same excess."""
        return self.variance.tobytes() + np.float64(self.level).tobytes()

    def directions(self, channels: Channels) -> FloatArray:
        """(n_meas, k) V: what noisy channels do, each as long as its deviation."""
        size = np.sqrt(self.variance)[channels.channel]
        return np.asarray((channels.parts[size > 0] * size[size > 0][:, None]).T)

    def exceeds(self, other: Excess) -> bool:
        """Whether there is more of it than of the ``other``."""
        return self.level > other.level or bool((self.variance > other.variance).any())

    def text(self, channels: Channels, usual: FloatArray) -> str | None:
        """What someone should see to, or None; ``usual`` (n_channels,) V² without the excess."""
        if self.level > _SAID**2:
            return (
                f"the voltages change by {np.sqrt(self.level):.0f} times the noise of the idle "
                "skin in a way that no touch explains: look at cables and supply, or take a new "
                "reference"
            )
        times = np.sqrt(1 + self.variance / np.maximum(usual, np.finfo(float).tiny))
        worst = int(times.argmax())
        if times[worst] < _SAID:
            return None
        return (
            f"{channels.names[worst]} wavers by {times[worst]:.0f} times the noise of the idle "
            "skin, and counts for less: look at its cable and contact"
        )

    def risen(self, squares: FloatArray, gauge: Gauge) -> Excess:
        """With what a frame shows, (n_channels,) mean squares; itself where that is no more."""
        common = _common(squares, gauge)
        if common <= 1 + (_common(gauge.limit, gauge) - 1) / 2:
            common = 1.0
        louder = squares > gauge.limit * common
        if common == 1.0 and not louder.any():
            return self
        more = np.where(louder, _MARGIN * (squares - common) * gauge.variance / self.level, 0.0)
        level = self.level if common == 1.0 else _MARGIN * common * self.level
        return Excess(level, self.variance + more, 0, np.zeros_like(squares))

    def passed(self, squares: FloatArray, gauge: Gauge) -> Excess:
        """After a frame that showed no more: what ``_CALM`` of them do not show is forgotten."""
        if not self.any:
            return self
        seen, calm = np.maximum(self.seen, squares), self.calm + 1
        if calm < _CALM:
            return replace(self, calm=calm, seen=seen)
        common = min(1.0, max(_common(seen, gauge), 0.0))
        own = np.clip(seen, 0.0, 1.0) if common == 1.0 else np.ones_like(seen)
        variance = self.variance * own
        variance = np.where(variance > _GONE * gauge.variance / self.level, variance, 0.0)
        level = self.level * common
        level = level if level > 1 + _GONE else 1.0
        return Excess(level, variance, 0, np.zeros_like(seen))


def _common(squares: FloatArray, gauge: Gauge) -> float:
    """The median channel's, of those that can be judged."""
    known = np.isfinite(gauge.limit)
    return float(np.median(squares[known])) if known.any() else 1.0
