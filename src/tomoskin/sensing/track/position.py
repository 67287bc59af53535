"""Where a touch is held to be and how strong it is, each detection as far as it bears it out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from tomoskin.core import Detection
from tomoskin.sensing.track.motion import TrackObservation, region_radius
from tomoskin.sensing.track.policy import RESIDUAL

# Deviations are those of fits to the moving plant, seeds 1 to 3 (docs/theory/tracking.md).

NOISE = 0.15
"""Of the logarithm of a content from frame to frame."""

ELSEWHERE = 0.10
"""Of the difference that another position makes: the sheet is uneven."""

_WALK = 0.03
"""Variance by which a finger's force changes it in a second."""


@dataclass(frozen=True, slots=True)
class TouchStrength:
    """``mean`` of the logarithm of a touch's content, and its ``variance``."""

    mean: float
    variance: float

    @classmethod
    def of(cls, detection: Detection) -> Self:
        """The strength as one frame shows it."""
        return cls(log_content(detection), NOISE**2)

    def after(self, detection: Detection, seconds: float) -> Self:
        """With one frame more, some ``seconds`` later (Kalman 1960)."""
        before = self.variance + _WALK * seconds
        gain = before / (before + NOISE**2)
        mean = self.mean + gain * (log_content(detection) - self.mean)
        return type(self)(mean, (1 - gain) * before)

    def log_likelihood(self, other: TouchStrength) -> float:
        """Of being that of the same touch as ``other``, elsewhere."""
        variance = self.variance + other.variance + ELSEWHERE**2
        return -0.5 * ((self.mean - other.mean) ** 2 / variance + math.log(variance))

    def plus(self, other: TouchStrength) -> TouchStrength:
        """Of two touches that are seen as one: contents add up."""
        mean = math.log(math.exp(self.mean) + math.exp(other.mean))
        share = 1 / (1 + math.exp(other.mean - self.mean))
        variance = share**2 * self.variance + (1 - share) ** 2 * other.variance
        return TouchStrength(mean, variance)


def content_of(detection: Detection) -> float:
    """Its peak times its area: what it changes, whatever stands beside it."""
    return abs(detection.peak) * detection.area


def log_content(detection: Detection) -> float:
    """Logarithm of the size of the peak times the area; 0 where it has none."""
    content = content_of(detection)
    return math.log(content) if content > 0 else 0.0


# Chosen on the twin's seeds 101 to 103 (docs/theory/tracking.md).

_DIFFUSION = 5e-4
"""Variance along each axis by which a touch may move in a second that tells nothing of it, m²."""

_ELSEWHERE = 200.0
"""Places on a sheet where noise and drift may look like a touch."""

_DRAG = 0.012
"""How far behind a sliding press the sheet responds, m: play (Prandtl 1928), which does not depend
on the speed or the way, and stays when the press stops. It is not quite along the course."""

_STANDS = 2.0
"""Squared distance, in variances in the plane of both positions, up to which a touch stands."""

_BETTER = 0.5
"""Part of the variance of a position, from which on a later one says better where it stands."""


@dataclass(frozen=True, slots=True)
class Position:
    """A position and its covariance.

    Attributes
    ----------
    place
        Mean of the detections that it rests on, and of their covariances.
    unseen
        Variance along each axis by which the touch may have moved meanwhile, m².
    bias
        Deviation along each axis of what is off all the time, m.
    strength
        As the sheet remembers it.
    stood
        Where it stood before it slid, but no farther off than the sheet is dragged.
    slid
        Deviation in the plane of a press that has slid, m.
    time
        Device time of the newest detection, s.
    """

    place: TrackObservation
    unseen: float
    bias: float
    strength: float
    stood: TrackObservation
    slid: float
    time: float

    @classmethod
    def of(cls, detection: Detection, size: float, time: float, slid: float = 0.0) -> Self:
        """Of one detection, ``size`` strong, of a touch that has ``slid``."""
        place = _place(detection)
        return cls(place, 0.0, detection.bias, size, place, slid, time)

    def after(self, detection: Detection, size: float, time: float) -> Self:
        """With a further detection, ``size`` strong.

        Where it is as strong as before, it is the position. What is missing of the strength may be
        the press, and what is left the sheet's residual response: then it lies anywhere in its
        region, and moves the position as far as a Kalman filter (1960) lets it.
        """
        since = max(time - self.time, 0.0)
        strength = max(size, self.strength * math.exp(-since / RESIDUAL.recovery))
        unseen, region = self.unseen + _DIFFUSION * since, region_radius(detection) ** 2
        astray = region * (strength / size - 1.0) ** 2 if size > 0 else math.inf
        trust = unseen / (unseen + astray) if astray > 0 else 1.0
        trust *= 1.0 - self._chance(detection, unseen, region)
        both = zip(self.place, _place(detection), strict=True)
        place = TrackObservation(*[old + trust * (new - old) for old, new in both])
        left, (stood, slid) = (1.0 - trust) * unseen, self._slide(place, since)
        return type(self)(place, left, detection.bias, strength, stood, slid, time)

    def _slide(self, place: TrackObservation, since: float) -> tuple[TrackObservation, float]:
        """Where it ``stood``, and how far it has ``slid``, once it is at a ``place``.

        A press that comes down is first seen faintly. As long as it may have stood still, where it
        stood is said by the frames that see it well. A slide is remembered for as long as a sheet
        recovers: as it begins, the response jumps back, and passes where the press stood again.
        """
        x, y = place.x - self.stood.x, place.y - self.stood.y
        away, now = math.hypot(x, y), place.xx + place.yy
        before = self.stood.xx + self.stood.yy
        if not away**2 > _STANDS * (before + now):
            slid = self.slid * math.exp(-since / RESIDUAL.recovery)
            return (place if now < _BETTER * before else self.stood), slid
        part = max(1.0 - _DRAG / away, 0.0)
        return self.stood._replace(x=self.stood.x + part * x, y=self.stood.y + part * y), _DRAG

    def _chance(self, detection: Detection, unseen: float, region: float) -> float:
        """Probability that this is noise elsewhere (data association: Bar-Shalom & Tse 1975).

        Noise is larger than the touch with a probability of ½ erfc(snr / 2), in each place of the
        size of its ``region`` m²; near by it cannot be told from the touch.
        """
        x, y, xx, _, yy = self.place
        spread = unseen + 0.5 * (xx + yy + detection.sd_x**2 + detection.sd_y**2)
        if not (spread > 0 and region > 0 and math.isfinite(detection.snr)):
            return 0.0
        square = (detection.x - x) ** 2 + (detection.y - y) ** 2
        noise = _ELSEWHERE * 0.5 * math.erfc(detection.snr / 2.0) * spread / region
        return noise / (noise + math.exp(max(-0.5 * square / spread, -700.0)))

    @property
    def wavers(self) -> float:
        """Deviation in the plane of what differs from frame to frame, m."""
        return math.sqrt(self.place.xx + self.place.yy + 2.0 * self.unseen)

    def of_detection(self, detection: Detection) -> Detection:
        """The ``detection`` at this position, with all that may be off."""
        x, y, xx, xy, yy = self.place
        more = self.unseen + self.bias**2 + 0.5 * self.slid**2
        return Detection(  # of all fields: dataclasses.replace takes several times as long
            x=x,
            y=y,
            sd_x=math.sqrt(xx + more),
            sd_y=math.sqrt(yy + more),
            area=detection.area,
            peak=detection.peak,
            cells=detection.cells,
            cov_xy=xy,
            snr=detection.snr,
            close=detection.close,
            weak=detection.weak,
            bias=0.0,
            force=detection.force,
            depth=detection.depth,
        )


def _place(d: Detection) -> TrackObservation:
    """Where one frame shows a touch."""
    return TrackObservation(d.x, d.y, d.sd_x**2, d.cov_xy, d.sd_y**2)
