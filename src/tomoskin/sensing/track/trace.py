"""One spot in the tracker's memory, from its first detection to its release: when a frame is, and
what happens to a touch in it. And which detections are only what touches left behind
in the sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track.motion import TrackState, region_radius
from tomoskin.sensing.track.policy import RESIDUAL
from tomoskin.sensing.track.position import Position, TouchStrength, content_of


@dataclass(frozen=True, slots=True)
class TrackClock:
    """The moment of a frame.

    Attributes
    ----------
    now
        Seconds since the first frame.
    passed
        Seconds since the frame before.
    host
        The host's, s.
    device
        The device's, s; None before the first frame.
    """

    now: float = 0.0
    passed: float = 0.0
    host: float = 0.0
    device: float | None = None

    def at(self, device: float, host: float) -> TrackClock:
        """The moment of the next frame: where the device's time does not go on, as when a board
        starts again, the host's counts."""
        passed = 0.0
        if self.device is not None:
            passed = device - self.device if device > self.device else max(host - self.host, 0.0)
        return TrackClock(self.now + passed, passed, host, device)


Happening = Literal["onset", "move", "release", "merge", "split"]


@dataclass(frozen=True, slots=True, eq=False)
class TouchEvent:
    """One thing that happened to one touch.

    Attributes
    ----------
    kind
        "onset"; "move", by more than noise since the last event; "release"; "merge", where it
        can no longer be separated from others; "split", where it can again.
    touch
        As it is after it; at a release, as it was last.
    host_time
        Of the frame in which it was noticed, host monotonic s.
    """

    kind: Happening
    touch: Touch
    host_time: float

    @property
    def text(self) -> str:
        """The event in a sentence for people."""
        r = self.touch.detection
        position = f"{1e3 * r.x:.0f}, {1e3 * r.y:.0f} mm"
        others = [str(number) for number in self.touch.merged if number != self.touch.id]
        return (
            f"touch {self.touch.id}: "
            + {
                "onset": f"begins at {position}",
                "move": f"is at {position}",
                "release": f"ends at {position}",
                "merge": f"and {' and '.join(others)} are too close to separate, at {position}",
                "split": f"is apart again, at {position}",
            }[self.kind]
        )


_STRONG = 0.5
_FRESH = 1.0
"""Seconds for which the strength of a touch that has come out of a merged one tells who it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Alone:
    """A touch as it was when last seen by itself, at the device's ``time`` s."""

    state: TrackState
    strength: TouchStrength
    time: float


@dataclass(eq=False, slots=True)
class MergedFinger:
    """One finger, as far as frames told it from others: its number, and how it was ``alone``."""

    key: int
    alone: Alone | None = None


@dataclass(slots=True)
class Footprint:
    """Where a touch was, m, and how large at most."""

    x: float
    y: float
    top: float


@dataclass(eq=False)
class Trace:
    """One spot, or what may become one, as the tracker remembers it.

    Attributes
    ----------
    detection, state, strength
        Newest detection; position and velocity; how strong it is.
    since, host_since
        Device and host time of its first frame, s.
    odds
        Logarithm of those that it is there.
    members
        The fingers that it stands for.
    reported
        Whether anyone has heard of it.
    missing
        Device time of the first frame without a detection since the last one, or None.
    beside, met
        The other spots as they were before this one came, or went missing, and what frames since
        then say for its having met them.
    parted, fresh
        Device time at which it came out of a merged one, and its strength shortly after that.
    strong, low, least
        Device times at which it was last strong for its position, and since which it has been
        so weak that it may be a residual response, or None; least size of its peak since then.
    full
        Its content when it was last strong.
    footprints, top
        Where it has been, the newest last; and how large it has been where its detection is now,
        for a press that slid leaves a residual response anywhere along its way.
    held
        Where it is held to be.
    ahead
        Where it is expected in the frame that comes.
    """

    detection: Detection
    state: TrackState
    since: float
    host_since: float
    odds: float
    members: list[MergedFinger]
    reported: bool = False
    missing: float | None = None
    beside: dict[int, Alone] = field(default_factory=dict)
    met: dict[int, float] = field(default_factory=dict)
    parted: float = -math.inf
    strong: float = 0.0
    full: float = 0.0
    low: float | None = None
    least: float = 0.0
    footprints: list[Footprint] = field(default_factory=list)
    top: float = 0.0
    strength: TouchStrength = field(init=False)
    fresh: TouchStrength = field(init=False)
    held: Position = field(init=False)
    ahead: TrackState = field(init=False)

    def __post_init__(self) -> None:
        """Begin with what the first detection shows."""
        self.strong, self.full = self.since, content_of(self.detection)
        self.strength = self.fresh = TouchStrength.of(self.detection)
        self.held = Position.of(self.detection, content_of(self.detection), self.since)
        self._step()

    @property
    def key(self) -> int:
        """Of the first of its members."""
        return self.members[0].key

    @property
    def kind(self) -> str:
        """Whether it lowers the conductivity or raises it."""
        return "decrease" if self.sign < 0 else "increase"

    @property
    def sign(self) -> float:
        """The sign of its peak: 1 or −1."""
        return sign_of(self.detection)

    @property
    def shown(self) -> Detection:
        """Its newest detection, where it is held to be."""
        return self.held.of_detection(self.detection)

    def alone(self, time: float) -> Alone:
        """The touch as it is now, by itself."""
        return Alone(self.state, self.strength, time)

    def take(self, detection: Detection, time: float, seconds: float, *, still: bool) -> None:
        """Take the detection of this frame, ``seconds`` after the frame before; ``still``: the last
        ones say nothing of it."""
        self.detection = detection
        held = Position.of if still else self.held.after
        self.held = held(detection, content_of(detection), time)
        self.strength = self.strength.after(detection, seconds)
        if time - self.parted < _FRESH:
            self.fresh = self.fresh.after(detection, seconds)
        self.missing = None
        self._step()
        if size_of(detection) >= _STRONG * self.top:
            self.strong, self.full = time, content_of(detection)

    def change(self, time: float) -> None:
        """It stands for other fingers from now on: what it was says nothing of them."""
        self.parted = time
        self.strength = self.fresh = TouchStrength.of(self.detection)
        self.held = Position.of(self.detection, content_of(self.detection), time, self.held.slid)

    def become(self, other: Trace) -> None:
        """Go on from where ``other`` is."""
        self.detection, self.state = other.detection, other.state
        self.strong, self.full = other.strong, other.full
        self.held, self.strength, self.odds = other.held, other.strength, other.odds
        self.missing, self.low = other.missing, None
        self._step()

    def absorb(self, other: Trace) -> None:
        """Stand for the fingers of ``other`` too."""
        self.members += other.members
        self.footprints = [*other.footprints, *self.footprints][-RESIDUAL.most :]

    def _step(self) -> None:
        x, y, size = self.detection.x, self.detection.y, size_of(self.detection)
        feet = self.footprints
        if not feet or (x - feet[-1].x) ** 2 + (y - feet[-1].y) ** 2 >= RESIDUAL.spacing**2:
            feet.append(Footprint(x, y, size))
            del feet[: -RESIDUAL.most]
        elif size > feet[-1].top:
            feet[-1].top = size
        reach = max(region_radius(self.detection), RESIDUAL.spacing) ** 2
        near = [foot.top for foot in feet if (foot.x - x) ** 2 + (foot.y - y) ** 2 <= reach]
        self.top = max(near, default=feet[-1].top)


def size_of(detection: Detection) -> float:
    """By how many deviations it stands out, or its peak where the noise is unknown: a fit knows
    the depth of a faint touch badly, but well what it does to the voltages."""
    return detection.snr if 0 < detection.snr < math.inf else abs(detection.peak)


def sign_of(detection: Detection) -> float:
    """1 where it raises the conductivity, else −1."""
    return -1.0 if detection.peak < 0 else 1.0


_CREEP = 10.0
"""A level that rises slower than over so many seconds is the sheet's drift."""

_FALLS = 0.5
"""Part by which the level follows what is lower: the least of many frames would be their noise."""

_MOST = 64


@dataclass(slots=True, eq=False)
class Residual:
    """What is left at a ``foot`` of a touch of this sign and ``radius``, and its ``level``."""

    foot: Footprint
    sign: float
    radius: float
    level: float
    time: float

    def explains(self, detection: Detection, time: float) -> bool:
        """Whether the detection has not grown; follow its level."""
        size = size_of(detection)
        noise = size / detection.snr if detection.snr > 0 else 0.0
        grown = RESIDUAL.has_grown(size, self.level, noise)
        if not grown:
            creeps = -np.expm1((self.time - time) / _CREEP)
            self.level += (size - self.level) * (creeps if size > self.level else _FALLS)
        self.time = time
        return not grown


class ResidualResponses:
    """Memory of where touches were."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget all: nothing of them shows in detections any more."""
        self._residuals: list[Residual] = []
        self._shown = -math.inf

    def leave(self, trace: Trace, time: float) -> None:
        """Remember where a touch was that has ended."""
        radius = region_radius(trace.detection)
        self._residuals += [
            Residual(foot, trace.sign, radius, RESIDUAL.part * foot.top, time)
            for foot in trace.footprints
        ]
        del self._residuals[:-_MOST]

    def note(self, time: float, *, quiet: bool) -> None:
        """Follow whether frames are ``quiet``, without any detection: where they stay so, the
        residual responses are below the noise."""
        if not quiet:
            self._shown = time
        elif time - self._shown >= RESIDUAL.gone:
            self._residuals.clear()

    def explain(self, detection: Detection, time: float, traces: Iterable[Trace]) -> bool:
        """Whether the detection is the residual response of an earlier touch.

        Or of one of ``traces``, behind or beside it while it still stands.
        """
        for trace in traces:
            radius = region_radius(trace.detection)
            if trace.reported and any(
                _is_under(detection, foot, trace.sign, radius) for foot in trace.footprints
            ):
                return True
        answers = [
            residual.explains(detection, time)
            for residual in self._residuals
            if _is_under(detection, residual.foot, residual.sign, residual.radius)
        ]
        return any(answers)  # each of them follows the level


def _is_under(detection: Detection, foot: Footprint, sign: float, radius: float) -> bool:
    """Whether it lies where something was, with this sign, and no larger than a residual."""
    reach = RESIDUAL.reach * max(radius, region_radius(detection))
    near = (detection.x - foot.x) ** 2 + (detection.y - foot.y) ** 2 <= reach**2
    return near and sign_of(detection) == sign and RESIDUAL.holds(size_of(detection), foot.top)


def is_residual(trace: Trace, time: float, *, alone: bool) -> bool:
    """Whether a touch has ended and only its residual response is seen.

    It must have fallen fast and not grown since. Not ``alone`` it may stand out little only since
    others are given, and then it is what it changes that must have fallen.
    """
    size, top = size_of(trace.detection), trace.top
    slow = trace.low is None and time - trace.strong > RESIDUAL.recovery
    full = not alone and content_of(trace.detection) > _STRONG * trace.full
    if slow or full or not RESIDUAL.holds(size, top):
        trace.low = None
        return False
    if trace.low is None or RESIDUAL.has_grown(size, trace.least, 0.0):
        trace.low, trace.least = time, size
    trace.least = min(trace.least, size)
    return time - trace.low >= RESIDUAL.lasts and time > trace.low
