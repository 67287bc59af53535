"""One touch in the tracker's memory, from its first detection to its release."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from tomoskin.core import Detection, FloatArray, Touch
from tomoskin.touch.tracking.motion import States, region_radius
from tomoskin.touch.tracking.position import Position

_STEP = 0.012
"""A touch that slides leaves a footprint every so many metres."""

_MOST_FOOTPRINTS = 40
_STRONG = 0.5


@dataclass(slots=True)
class Footprint:
    """Where a touch was, m, and how large at most."""

    x: float
    y: float
    top: float


@dataclass(frozen=True, slots=True, eq=False)
class Unmerged:
    """A touch as it was last seen by itself, and expected in the frame thereafter, device s."""

    detection: Detection
    states: States
    time: float


@dataclass(eq=False)
class Trace:
    """One touch, or what may become one, as the tracker remembers it.

    Attributes
    ----------
    detection, states
        Newest detection; position and velocity, one row.
    since, host_since
        Device and host time of its first frame, s.
    number
        Its identity; 0 until it is reported.
    frames
        Readings so far.
    missing
        Device time of the first frame without a detection since the last one, or None.
    strong, low, least
        Device times at which it was last strong for its position, and since which it has been
        so weak that it may be a residual response, or None; least size of its peak since then.
    footprints, top
        Where it has been, the newest last; and how large it has been where its detection is now,
        for a press that slid leaves a residual response anywhere along its way.
    alone
        As it was before it merged with others, or None.
    others
        Touches that have merged into it.
    beside
        The other touches as they were when this one went missing, by number.
    held
        Where it is held to be.
    reported_at
        (2,) m, its position in the last event.
    """

    detection: Detection
    states: States
    since: float
    host_since: float
    number: int = 0
    frames: int = 1
    missing: float | None = None
    strong: float = 0.0
    low: float | None = None
    least: float = 0.0
    footprints: list[Footprint] = field(default_factory=list)
    top: float = 0.0
    alone: Unmerged | None = None
    others: list[Trace] = field(default_factory=list)
    beside: Mapping[int, Unmerged] = field(default_factory=dict)
    reported_at: tuple[float, float] = (0.0, 0.0)
    held: Position = field(init=False)

    def __post_init__(self) -> None:
        """Leave the first footprint."""
        self.strong = self.since
        self.held = Position.of(self.detection, size_of(self.detection), self.since)
        self._step()

    @property
    def position(self) -> FloatArray:
        """(2,) m where it is expected."""
        expected: FloatArray = self.states.mean[0, :2]
        return expected

    @property
    def sign(self) -> float:
        """Of its peak."""
        return sign_of(self.detection)

    @property
    def shown(self) -> Detection:
        """Its newest detection, where it is held to be."""
        return self.held.of_detection(self.detection)

    @property
    def members(self) -> tuple[Trace, ...]:
        """Itself and those that have merged into it, in the order of their numbers."""
        return tuple(sorted((self, *self.others), key=lambda trace: trace.number))

    @property
    def touch(self) -> Touch:
        """As it is reported: a merged one by the oldest of its numbers."""
        first = self.members[0]
        merged = tuple(t.number for t in self.members) if self.others else ()
        kind = "decrease" if self.sign < 0 else "increase"
        return Touch(first.number, kind, first.host_since, self.shown, merged)

    def see(self, detection: Detection, time: float, *, still: bool) -> None:
        """Take the detection of this frame; ``still``: the last ones say nothing of it."""
        self.detection = detection
        held = Position.of if still else self.held.after
        self.held = held(detection, size_of(detection), time)
        self.frames += 1
        self.missing = None
        self._step()
        if size_of(detection) >= _STRONG * self.top:
            self.strong = time

    def become(self, other: Trace) -> None:
        """Go on from where ``other`` is."""
        self.detection, self.states, self.strong = other.detection, other.states, other.strong
        self.held = other.held
        self.missing, self.low = other.missing, None
        self._step()

    def _step(self) -> None:
        x, y, size = self.detection.x, self.detection.y, size_of(self.detection)
        last = self.footprints[-1] if self.footprints else None
        if last is None or (x - last.x) ** 2 + (y - last.y) ** 2 >= _STEP**2:
            last = Footprint(x, y, size)
            self.footprints.append(last)
            del self.footprints[:-_MOST_FOOTPRINTS]
        elif size > last.top:
            last.top = size
        self.top = last.top
        if len(self.footprints) > 1:
            reach = max(region_radius(self.detection), _STEP) ** 2
            near = (f.top for f in self.footprints if (f.x - x) ** 2 + (f.y - y) ** 2 <= reach)
            self.top = max(near, default=last.top)


def size_of(detection: Detection) -> float:
    """By how many deviations it stands out, or its peak where the noise is unknown: a fit knows
    the depth of a faint touch badly, but well what it does to the voltages."""
    return detection.snr if 0 < detection.snr < math.inf else abs(detection.peak)


def content(detection: Detection) -> float:
    """Size of the peak times the region's area: two regions that become one add them up."""
    return abs(detection.peak) * detection.area


def sign_of(detection: Detection) -> float:
    """1 or −1."""
    return -1.0 if detection.peak < 0 else 1.0
