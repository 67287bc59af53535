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

_MOVES = 0.1
"""How often a finger that stands begins to move, per second."""

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

    Attributes
    ----------
    place
        The mean, and its covariance by noise alone.
    odds
        Of having moved against standing, as frames up to now say it.
    evidence
        The sum.
    """

    place: TrackObservation
    odds: float = 0.0
    evidence: float = 0.0

    @property
    def moved(self) -> float:
        """Probability of having moved."""
        return self.odds / (1.0 + self.odds)

    def after(self, seen: TrackObservation, changed: Spread, seconds: float, trust: float) -> Self:
        """With a frame more, ``seconds`` later, that has ``seen`` it and is to be trusted so far.

        What a model errs by has ``changed`` by this covariance since the frame before.
        """
        share = min(seconds / _COHERENCE, 1.0)
        noise = Spread(seen.xx, seen.xy, seen.yy)
        before = Spread(self.place.xx, self.place.xy, self.place.yy)
        before = before.plus(changed).widened(_WALK * seconds)
        total = before.plus(noise)
        if not math.isfinite(total.area):  # the noise is not known
            return type(self)(seen)
        away = total.widened(_AWAY)
        x, y = seen.x - self.place.x, seen.y - self.place.y
        ratio = 0.5 * (total.square(x, y) - away.square(x, y) + math.log(total.area / away.area))
        ratio = trust * share * min(ratio, _ONE)
        odds = min((self.odds + _MOVES * seconds) * math.exp(ratio), math.exp(2.0 * _ONE))
        evidence = max(self.evidence + ratio, 0.0)
        stays = trust * share / (1.0 + odds)
        return type(self)(_updated(self.place, before, total, (x, y), stays), odds, evidence)

    def has_moved(self, seconds: float) -> bool:
        """Whether frames ``seconds`` apart show that it no longer stands there."""
        return self.evidence > math.log(_HOUR / max(seconds, _COHERENCE))


def _updated(
    place: TrackObservation, before: Spread, total: Spread, off: tuple[float, float], part: float
) -> TrackObservation:
    """A Kalman filter's step with a ``part`` of its gain."""
    (x, y), area = off, total.area
    # gain = before · total⁻¹
    g_xx = (before.xx * total.yy - before.xy * total.xy) / area
    g_xy = (before.xy * total.xx - before.xx * total.xy) / area
    g_yx = (before.xy * total.yy - before.yy * total.xy) / area
    g_yy = (before.yy * total.xx - before.xy * total.xy) / area
    return TrackObservation(
        place.x + part * (g_xx * x + g_xy * y),
        place.y + part * (g_yx * x + g_yy * y),
        before.xx - part * (g_xx * before.xx + g_xy * before.xy),
        before.xy - part * (g_xx * before.xy + g_xy * before.yy),
        before.yy - part * (g_yx * before.xy + g_yy * before.yy),
    )
