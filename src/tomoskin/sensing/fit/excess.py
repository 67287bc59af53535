"""Noise beyond what was learnt: seen in what no touch can do, and believed at once."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.signal import Reciprocity

_LIMIT = 6.0
"""Deviations by which the mean square of a channel's residual must exceed 1 to be more noise."""

_MARGIN = 2.0
"""What one frame shows of a variance is taken times this: it is a rough estimate."""

_CALM = 8
"""Frames without more noise after which no more is believed than they have shown. One is enough
where noise has risen from nothing: what came down within a scan looks like noise in that scan
only."""

_MOVES = 0.5
"""Part of what has changed since the frame before that may stand between two reciprocal rows."""

_GAINS = 0.03
"""Part by which channels may differ in gain, and so reciprocal rows in what a touch does."""

_SAID = 4.0
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
    pairs
        Rows that exchange driven and measuring pair.
    apart
        (n_pairs, n_meas): the difference of each two.
    """

    parts: FloatArray
    channel: IntArray
    names: tuple[str, ...]
    pairs: Reciprocity
    apart: FloatArray

    @cached_property
    def seen(self) -> FloatArray:
        """(n_parts, n_pairs): what each part does to the differences."""
        return self.parts @ self.apart.T

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """The channels that the rows of a pattern are read by."""
        scan = Scan.of(pattern)
        pairs, pair = np.unique(np.sort(pattern.measure, axis=1), axis=0, return_inverse=True)
        n = pattern.n_electrodes
        names = [f"E{e + 1}" for e in range(n)]
        names += [f"E{a + 1} to E{b + 1}" for a, b in pairs.tolist()]
        channel = np.concatenate([scan.sample_electrode, n + pair.reshape(-1)])
        reciprocal, single = Reciprocity.of(pattern), np.eye(pattern.n_meas)
        parts = np.concatenate([scan.makes.T, single])
        apart = single[reciprocal.first] - reciprocal.sign[:, None] * single[reciprocal.second]
        return cls(parts, channel, tuple(names), reciprocal, apart)


@dataclass(frozen=True, eq=False)
class Gauge:
    """Channels as they show in what no touch can do, for one covariance of the noise.

    Rows that exchange the driven and the measuring pair change alike, whatever is pressed
    (Geselowitz 1971): their differences are noise, but for what moves while they are read.

    Attributes
    ----------
    pairs
        Of the rows.
    shows
        (n_seen, n_pairs) 1/V: how the parts that can be seen, one channel's after the other, show
        in the pairs' differences where these are white; as one deviation of noise does. In single
        precision: it is read through in each frame.
    channels, starts, count
        Numbers of the channels that have parts; of each its first part, and how many it has.
    variance
        (n_channels,) V² of noise in a part that shows as much as all other noise in its direction.
    limit
        (n_channels,) mean squares beyond which a channel is noisier; infinite where too few of its
        parts can be seen.
    judged
        Numbers of the channels that can be judged.
    """

    pairs: Reciprocity
    shows: NDArray[np.float32]
    channels: IntArray
    starts: IntArray
    count: IntArray
    variance: FloatArray
    limit: FloatArray
    judged: IntArray

    @classmethod
    def making(
        cls, channels: Channels, covariance: FloatArray, nuisance: FloatArray
    ) -> Generator[None, None, Self]:
        """For a ``covariance`` (n_meas, n_meas) V² of the data, and a ``nuisance`` subspace
        (n_meas, k) V; a piece of work between two yields."""
        apart = channels.apart
        whiten = _white(apart @ covariance @ apart.T, apart @ nuisance)
        yield
        directions = whiten(channels.seen)
        squares = np.einsum("pr,pr->p", directions, directions)
        shows = squares > 1e-12 * squares.max(initial=0.0)
        squares = np.where(shows, squares, np.inf)
        directions = directions / np.sqrt(squares)[:, None]
        order = np.argsort(channels.channel, kind="stable")
        order = order[shows[order]]
        yield
        count = np.bincount(channels.channel[order], minlength=len(channels.names))
        ends, some = np.cumsum(count), np.flatnonzero(count)
        own = [directions[order[b - n : b]] for b, n in zip(ends, count, strict=True)]
        spread = np.array([np.linalg.norm(d @ d.T) / max(len(d), 1) for d in own])
        limit = np.where(count >= _FEWEST, 1 + _LIMIT * np.sqrt(2) * spread, np.inf)
        gauge = cls(
            pairs=channels.pairs,
            shows=(directions[order] @ whiten.matrix).astype(np.float32),
            channels=some,
            starts=(ends - count)[some],
            count=count[some],
            variance=np.zeros(len(count)),
            limit=limit,
            judged=np.flatnonzero(np.isfinite(limit)),
        )
        return replace(gauge, variance=gauge.means(1 / squares[order]))

    def means(self, values: FloatArray) -> FloatArray:
        """(…, n_channels) means of ``values`` (…, n) over each channel's parts; 0 where it has
        none."""
        out = np.zeros((*values.shape[:-1], len(self.variance)))
        if len(self.channels):
            out[..., self.channels] = np.add.reduceat(values, self.starts, axis=-1) / self.count
        return out

    def squares(self, dv: FloatArray, moved: FloatArray) -> FloatArray:
        """(n_channels,) mean squares of data (n_meas,) V; 1 where the noise is as it should be.

        ``moved`` (n_meas,) V since the frame before: of that a part may stand between two rows,
        since one is read after the other; and of all data as much as channels differ in gain.
        """
        pairs, rows = self.pairs, np.array([dv, moved])
        one = rows.take(pairs.first, axis=1)
        other = rows.take(pairs.second, axis=1) * pairs.sign
        seen = np.empty((3, len(pairs.sign)), np.float32)
        seen[0], seen[1:] = one[0] - other[0], one + other
        # one by one: a product with so few columns takes three times as long
        along = np.array([self.shows @ column for column in seen], np.float64)
        differs, gains, changes = self.means(along * along)
        allowed = _MOVES**2 * changes + _GAINS**2 * gains
        return np.asarray(differs - (allowed + allowed.sum() / len(allowed)) / 2)

    @cached_property
    def loudest(self) -> float:
        """The median channel's mean square up to which all channels may be as they should."""
        return 1 + (_common(self.limit, self) - 1) / 2


def _white(covariance: FloatArray, nuisance: FloatArray) -> Whitener:
    if not len(covariance):
        return Whitener(np.zeros((0, 0)))
    size = np.linalg.norm(nuisance, axis=0)
    counts = size > 1e-6 * size.max(initial=0.0)
    return Whitener.of(covariance).without(nuisance[:, counts] / size[counts])


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
    fresh
        Whether it has risen from nothing, in this frame or in frames without a pause.
    """

    level: float
    variance: FloatArray
    calm: int
    seen: FloatArray
    fresh: bool = False

    @classmethod
    def none(cls, channels: Channels) -> Self:
        """The noise is as it was learnt."""
        none = np.zeros(len(channels.names))
        return cls(1.0, none, 0, none)

    @cached_property
    def any(self) -> bool:
        """Whether there is more noise than was learnt."""
        return self.level > 1.0 or bool(self.variance.any())

    @property
    def key(self) -> bytes:
        """The same for the same excess."""
        return self.variance.tobytes() + np.float64(self.level).tobytes()

    def added(self, noise: FloatArray, channels: Channels) -> FloatArray:
        """(n_meas, n_meas) V²: ``noise`` with the excess."""
        if not self.any:
            return noise
        own = self.variance[channels.channel]
        parts = channels.parts[own > 0]
        return np.asarray(self.level * (noise + (parts.T * own[own > 0]) @ parts))

    def text(self, channels: Channels, usual: FloatArray, louder: float = 1.0) -> str | None:
        """What someone should see to, or None; ``usual`` (n_channels,) V² without the excess, and
        in the newest frame so many times the noise's variance, ``louder``."""
        if (level := max(self.level, louder)) > _SAID**2:
            return (
                f"the voltages change by {np.sqrt(level):.0f} times the noise of the idle "
                "skin, and no touch explains it: check cables and supply, or take a new reference"
            )
        if not self.any:
            return None
        times = np.sqrt(1 + self.variance / np.maximum(usual, np.finfo(float).tiny))
        worst = int(times.argmax())
        if times[worst] < _SAID:
            return None
        return (
            f"{channels.names[worst]} fluctuates by {times[worst]:.0f} times the noise of the "
            "idle skin and gets less weight: check its cable and contact"
        )

    def after(self, squares: FloatArray, gauge: Gauge) -> Excess:
        """With what a frame shows, (n_channels,) mean squares."""
        common = _common(squares, gauge)
        if common <= gauge.loudest:
            common = 1.0
        louder = squares > gauge.limit * common
        if common == 1.0 and not np.count_nonzero(louder):  # any takes five times as long
            return self._passed(squares, gauge)
        more = np.where(louder, _MARGIN * (squares - common) * gauge.variance / self.level, 0.0)
        level = self.level if common == 1.0 else _MARGIN * common * self.level
        fresh = not self.any or self.fresh
        return Excess(level, self.variance + more, 0, np.zeros_like(squares), fresh)

    def _passed(self, squares: FloatArray, gauge: Gauge) -> Excess:
        """After a frame that showed no more: what ``_CALM`` of them do not show is forgotten, and
        what one does not show of that which is fresh."""
        if not self.any:
            return self
        seen, calm = np.maximum(self.seen, squares), self.calm + 1
        if self.fresh:
            seen = _MARGIN * seen
        elif calm < _CALM:
            return replace(self, calm=calm, seen=seen)
        common = float(np.clip(_common(seen, gauge), 1e-12, 1.0))
        variance = self.variance * np.clip(seen / common, 0.0, 1.0)
        variance = np.where(variance > _GONE * gauge.variance / self.level, variance, 0.0)
        level = self.level * common
        level = level if level > 1 + _GONE else 1.0
        return Excess(level, variance, 0, np.zeros_like(seen))


def _common(squares: FloatArray, gauge: Gauge) -> float:
    """The median channel's, of those that can be judged."""
    ordered = sorted(squares[gauge.judged].tolist())
    n = len(ordered)
    return (ordered[(n - 1) // 2] + ordered[n // 2]) / 2 if n else 1.0
