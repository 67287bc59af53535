"""Where a touch is held to be and how strong it is, each detection as far as it bears it out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

from tomoskin.core import Detection
from tomoskin.sensing.track.motion import TrackObservation, region_radius
from tomoskin.sensing.track.policy import RESIDUAL
from tomoskin.sensing.track.standing import Spread, StandingFinger, mixed

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
"""Squared distance, in variances in the plane of both positions, up to which a press that has slid
is where it stood."""

_OVER = 0.05
"""Part of the drag below which a slide is over and done with."""

_NONE = Spread(0.0, 0.0, 0.0)

_SHOWS = 1.0
"""Seconds after a move in which a finger is shown where the newest frame sees it, since it may go
on; after them it stands until frames show otherwise."""


@dataclass(frozen=True, slots=True)
class Position:
    """A position and its covariance.

    Attributes
    ----------
    place
        Where the newest frames see it, and the covariance of what differs between frames.
    lasting
        Covariance of what does not, the mean of about a second; None where that is not known.
    stands
        Where it is if it has not moved.
    unseen
        Variance along each axis by which the touch may have moved meanwhile, m².
    bias
        Deviation along each axis of what is off all the time, m.
    strength
        As the sheet remembers it.
    stood
        Where it stood before it slid, but no farther off than the sheet is dragged; None where
        nothing has shown that it slid.
    slid
        Deviation in the plane of a press that has slid, m.
    time, moved
        Device times of the newest detection, and of the newest frame that showed a move, s.
    """

    place: TrackObservation
    lasting: Spread | None
    stands: StandingFinger
    unseen: float
    bias: float
    strength: float
    stood: TrackObservation | None
    slid: float
    time: float
    moved: float = -math.inf

    @classmethod
    def of(cls, detection: Detection, size: float, time: float, slid: float = 0.0) -> Self:
        """Of one detection, ``size`` strong, of a touch that has ``slid``."""
        place, lasting = _place(detection)
        stood = place if slid else None
        stands = StandingFinger(place)
        return cls(place, lasting, stands, 0.0, detection.bias, size, stood, slid, time)

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
        seen, lasting = _place(detection)
        if lasting is not None and self.lasting is not None:  # noise moves where it is asked for
            share = min(since / RESIDUAL.recovery, 0.5)
            lasting = self.lasting.plus(lasting.plus(self.lasting, -1.0), share)
        both = zip(self.place, seen, strict=True)
        place = TrackObservation(*[old + trust * (new - old) for old, new in both])
        changed = _changed(lasting, self.strength, strength)
        stands = self.stands.after(seen, changed, since, trust)
        stood, slid, moved = (
            self.stood,
            self.slid * math.exp(-since / RESIDUAL.recovery),
            self.moved,
        )
        settled = stands.settled
        if stands.has_moved(since):
            stood, slid, moved = stood or self.stands.place, _DRAG, time
            stands = StandingFinger(place)
        elif settled is not None:
            stood, slid = stood or self.stands.place, max(slid, min(stands.way, _DRAG))
            stands = settled
        left = (1.0 - trust) * unseen
        now = type(self)(
            place, lasting, stands, left, detection.bias, strength, stood, slid, time, moved
        )
        return now if stood is None else now._dragged(stood)

    def _dragged(self, stood: TrackObservation) -> Self:
        """With what is left of a slide that began where it ``stood``.

        A slide is remembered for as long as a sheet recovers: as it begins, the response jumps
        back, and passes where the press stood again. It is over where the press is back there.
        """
        place = self.shown
        x, y = place.x - stood.x, place.y - stood.y
        away = math.hypot(x, y)
        if not away**2 > _STANDS * (place.xx + place.yy + stood.xx + stood.yy):
            over = self.slid < _OVER * _DRAG
            return replace(self, stood=None if over else stood, slid=0.0 if over else self.slid)
        part = max(1.0 - _DRAG / away, 0.0)
        stood = stood._replace(x=stood.x + part * x, y=stood.y + part * y)
        return replace(self, stood=stood, slid=max(self.slid, min(away, _DRAG)))

    @property
    def shown(self) -> TrackObservation:
        """Where it is, and the covariance of what differs from frame to frame: the mean of the
        frames as far as it stands, else the newest, and so where no mean is known to be surer."""
        if self.lasting is None:
            return self.place
        if self.time - self.moved < _SHOWS:
            return self.place
        stands = self.stands
        return mixed(stands.place, stands.other or self.place, stands.moved)

    def _chance(self, detection: Detection, unseen: float, region: float) -> float:
        """Probability that this is noise elsewhere (data association: Bar-Shalom & Tse 1975).

        Noise is larger than the touch with a probability of ½ erfc(snr / 2), in each place of the
        size of its ``region`` m²; near by it cannot be told from the touch.
        """
        x, y, xx, _, yy = self.place  # of the newest, as a finger may have moved there
        spread = unseen + 0.5 * (xx + yy + detection.sd_x**2 + detection.sd_y**2)
        if not (spread > 0 and region > 0 and math.isfinite(detection.snr)):
            return 0.0
        square = (detection.x - x) ** 2 + (detection.y - y) ** 2
        noise = _ELSEWHERE * 0.5 * math.erfc(detection.snr / 2.0) * spread / region
        return noise / (noise + math.exp(max(-0.5 * square / spread, -700.0)))

    @property
    def _dragging(self) -> float:
        """Variance in the plane of a press that has moved: the sheet drags behind as it moves, and
        where it stands again, by no more than it has moved."""
        stands = self.stands
        way = min(stands.way, _DRAG)
        return stands.moving * _DRAG**2 + (1.0 - stands.moving) * way**2

    @property
    def wavers(self) -> float:
        """Deviation in the plane of what differs from frame to frame, m."""
        shown = self.shown
        return math.sqrt(shown.xx + shown.yy + 2.0 * self.unseen)

    def of_detection(self, detection: Detection) -> Detection:
        """The ``detection`` at this position, with all that may be off."""
        x, y, *noise = self.shown
        xx, xy, yy = Spread(*noise).plus(self.lasting or _NONE)
        drag = max(self.slid**2, self.stands.moved * self._dragging)
        more = self.unseen + self.bias**2 + 0.5 * drag
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


def _place(d: Detection) -> tuple[TrackObservation, Spread | None]:
    """Where one frame shows a touch, with the covariance of its own noise; and that of the rest,
    None where they are not told apart."""
    xx, xy, yy = d.sd_x**2, d.cov_xy, d.sd_y**2
    if d.lasting is None:
        return TrackObservation(d.x, d.y, xx, xy, yy), None
    lasting = Spread(*d.lasting)
    return TrackObservation(d.x, d.y, *Spread(xx, xy, yy).plus(lasting, -1.0)), lasting


def _changed(lasting: Spread | None, before: float, now: float) -> Spread:
    """By what a model errs otherwise of a touch that was so strong: it is its error by half where
    the strength is another one by half."""
    if lasting is None or not (before > 0 and now > 0):
        return _NONE
    return _NONE.plus(lasting, min(math.log(now / before) ** 2, 1.0))
