"""A finger that stands: where, by the mean of its frames, and what shows that it has moved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

from tomoskin.sensing.track.motion import TrackObservation


class Spread(NamedTuple):
    """A covariance (2, 2) of a position, m²."""

    xx: float
    xy: float
    yy: float

    def plus(self, other: Spread, times: float = 1.0) -> Spread:
        """The sum with ``times`` another."""
        return Spread(
            self.xx + times * other.xx, self.xy + times * other.xy, self.yy + times * other.yy
        )

    def widened(self, variance: float) -> Spread:
        """With a ``variance`` more along each axis, m²."""
        return Spread(self.xx + variance, self.xy, self.yy + variance)

    @property
    def area(self) -> float:
        """Its determinant, m⁴; above zero where it is a covariance."""
        return max(self.xx * self.yy - self.xy * self.xy, 1e-24)

    def square(self, x: float, y: float) -> float:
        """Squared Mahalanobis distance of a way, m."""
        return (self.yy * x * x - 2 * self.xy * x * y + self.xx * y * y) / self.area


_WALK = 4e-8
"""Variance along each axis by which a finger that stands moves in a second, m²: 0.2 mm."""

_AWAY = 7e-5
"""Variance along each axis of where a finger is seen that has just moved, m²: as it begins to
slide, the response jumps by 8 to 20 mm on the twin."""

_MOVES = 0.2
"""How often a finger that stands begins to move, per second."""

_AGAIN = 3.0
"""How often a finger that has moved moves on, per second."""

_SURE = 1e3
"""Odds of having moved from which on a finger stands where it has moved to."""

_STOPS = 0.2
"""Seconds in which a finger that was seen to move has come to stand, where frames agree with it."""

_ONE = 8.0
"""What one frame says at the most for having moved, log likelihood ratio: noise is not quite normal
far out, so that it takes several frames to show a slide."""

_HOUR = 3600.0
"""Seconds in which a standing finger is taken once at most for one that has moved."""

_COHERENCE = 0.02
"""Seconds within which frames have the same noise."""


@dataclass(frozen=True, slots=True)
class StandingFinger:
    """Where a finger stands if it has not moved, and how sure it is that it has not.

    A Kalman filter (1960) whose state hardly walks takes the mean of the frames. The odds of having
    moved are those of the first change (Shiryaev 1963); the sum of the logarithms of likelihood
    ratios, begun anew wherever it falls below zero, shows a change that is so sure that noise has
    it once in a stated time (Page 1954; Lorden 1971: the mean time to a false alarm is exp(h)
    frames or more, h the threshold).

    Where it is if it has moved is followed as well: a mixture of having moved before, and standing
    again, and of moving now, whose moments are kept (Blom & Bar-Shalom 1988). So a way that one
    frame cannot tell from noise is told by several that agree on where it ends.

    Attributes
    ----------
    place
        The mean, and its covariance by noise alone.
    other
        The same, if it has moved; None before its second frame.
    moving
        Probability that it still moves, if it has moved.
    odds
        Of having moved against standing, as frames up to now say it.
    evidence
        The sum.
    """

    place: TrackObservation
    other: TrackObservation | None = None
    moving: float = 1.0
    odds: float = 0.0
    evidence: float = 0.0

    @property
    def moved(self) -> float:
        """Probability of having moved."""
        return self.odds / (1.0 + self.odds)

    @property
    def way(self) -> float:
        """How far it has moved, if it has, m."""
        return 0.0 if self.other is None else math.dist(self.place[:2], self.other[:2])

    @property
    def settled(self) -> Self | None:
        """As it stands where it has moved to; None where that is not sure."""
        if self.other is None or self.odds <= _SURE or self.moving > 0.5:
            return None
        return type(self)(self.other, evidence=self.evidence)

    def after(self, seen: TrackObservation, changed: Spread, seconds: float, trust: float) -> Self:
        """With a frame more, ``seconds`` later, that has ``seen`` it and is to be trusted so far.

        What a model errs by has ``changed`` by this covariance since the frame before.
        """
        share = min(seconds / _COHERENCE, 1.0)
        grown = changed.widened(_WALK * seconds)
        stands = _Guess.of(self.place, grown, seen)
        if not math.isfinite(stands.total.area):  # the noise is not known
            return type(self)(seen)
        moves = _Guess.of(self.place, grown.widened(_AWAY), seen)
        again = -math.expm1(-_AGAIN * seconds)
        first = self.odds * again + _MOVES * seconds
        ratio, now = moves.log_density - stands.log_density, moves.updated(trust * share)
        before, moving = ratio, 1.0
        if self.other is not None:
            there = _Guess.of(self.other, grown, seen)
            stay = (self.odds * (1.0 - again), there.log_density - stands.log_density)
            before, part = _mean(stay, (first, ratio))
            now = mixed(now, there.updated(trust * share), part)
            moving = 1.0 - part * (1.0 - self.moving * math.exp(-seconds / _STOPS))
        odds = (self.odds + _MOVES * seconds) * math.exp(trust * share * min(before, _ONE))
        evidence = max(self.evidence + trust * share * min(ratio, _ONE), 0.0)
        place = stands.updated(trust * share / (1.0 + odds))
        return type(self)(place, now, moving, min(odds, math.exp(2.0 * _ONE)), evidence)

    def has_moved(self, seconds: float) -> bool:
        """Whether frames ``seconds`` apart show that it slides: it is no longer there, and one
        need not ask where it ends."""
        return self.evidence > math.log(_HOUR / max(seconds, _COHERENCE))


@dataclass(frozen=True, slots=True)
class _Guess:
    """Where a finger was held to be, what a frame has ``seen`` off it, and their covariances."""

    place: TrackObservation
    before: Spread
    total: Spread
    x: float
    y: float

    @classmethod
    def of(cls, place: TrackObservation, grown: Spread, seen: TrackObservation) -> Self:
        """What is held of a ``place`` that is less sure by so much, and what is seen off it."""
        before = Spread(*place[2:]).plus(grown)
        total = before.plus(Spread(*seen[2:]))
        return cls(place, before, total, seen.x - place.x, seen.y - place.y)

    @property
    def log_density(self) -> float:
        """Logarithm of how likely it was to be seen there, but for a constant."""
        return -0.5 * (self.total.square(self.x, self.y) + math.log(self.total.area))

    def updated(self, part: float) -> TrackObservation:
        """A Kalman filter's step with a ``part`` of its gain."""
        x, y, total, before, area = self.x, self.y, self.total, self.before, self.total.area
        # gain = before · total⁻¹
        g_xx = (before.xx * total.yy - before.xy * total.xy) / area
        g_xy = (before.xy * total.xx - before.xx * total.xy) / area
        g_yx = (before.xy * total.yy - before.yy * total.xy) / area
        g_yy = (before.yy * total.xx - before.xy * total.xy) / area
        return TrackObservation(
            self.place.x + part * (g_xx * x + g_xy * y),
            self.place.y + part * (g_yx * x + g_yy * y),
            before.xx - part * (g_xx * before.xx + g_xy * before.xy),
            before.xy - part * (g_xx * before.xy + g_xy * before.yy),
            before.yy - part * (g_yx * before.xy + g_yy * before.yy),
        )


def mixed(one: TrackObservation, other: TrackObservation, part: float) -> TrackObservation:
    """The mean of two hypotheses, the second of which has a ``part`` of the probability, and the
    covariance of both together."""
    x, y, rest = other.x - one.x, other.y - one.y, 1.0 - part
    return TrackObservation(
        one.x + part * x,
        one.y + part * y,
        rest * one.xx + part * other.xx + rest * part * x * x,
        rest * one.xy + part * other.xy + rest * part * x * y,
        rest * one.yy + part * other.yy + rest * part * y * y,
    )


def _mean(first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
    """Logarithm of the mean of two densities by (weight, logarithm), and the first one's part."""
    (one, a), (other, b) = first, second
    top = max(a, b)
    mine = one * math.exp(max(a - top, -700.0))
    both = mine + other * math.exp(max(b - top, -700.0))
    return top + math.log(both / (one + other)), mine / both
