"""Touches that slide: where the finger is, not where the sheet responds.

Friction drags the sheet along with a finger that slides: it is stretched behind the finger and
compressed ahead of it, so that the middle of its response lies behind the finger. How far depends
hardly on the speed, and nothing is left of it once the finger stands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track.trace import TouchEvent
from tomoskin.sensing.track.tracker import Tracker

# Chosen on the twin's seeds 1 to 3 (docs/theory/tracking.md).

_WINDOW = 0.35
"""Seconds of a touch's course that tell its direction: as it begins to slide, it jumps back."""

_RECENT = 0.1
"""A touch that has not gone on for so many seconds stands."""

_FEWEST = 3
"""Frames within the window that make a course."""

_STANDS, _SLIDES = 0.02, 0.04
"""Speeds up to which a touch stands, and from which it slides, m/s."""

Course = tuple[tuple[float, float, float], ...]
"""Where a touch was seen of late: rows of s, x and y m."""


@dataclass(frozen=True, slots=True, eq=False)
class SlideCorrection:
    """Moves touches ahead by what the sheet lags behind them, from frame to frame.

    Attributes
    ----------
    lag
        Of the sheet behind a finger that slides, m; 0: no touch is moved.
    courses
        Of the touches that are there, by identity.
    """

    lag: float
    courses: Mapping[int, Course] = field(default_factory=dict)

    def after(self, touches: Sequence[Touch], time: float) -> Self:
        """With a frame at ``time`` s of the device, in which ``touches`` were."""
        if not self.lag or not (touches or self.courses):
            return self
        courses = {touch.id: self._gone_on(touch, time) for touch in touches}
        return type(self)(self.lag, courses)

    def of_finger(self, touch: Touch) -> Touch:
        """``touch`` of the newest frame where the finger is; itself where it stands."""
        course = self.courses.get(touch.id, ())
        if len(course) < _FEWEST:
            return touch
        u, v = _heading(course)
        if not (u or v):
            return touch
        d = touch.detection
        return replace(touch, detection=replace(d, x=d.x + self.lag * u, y=d.y + self.lag * v))

    def _gone_on(self, touch: Touch, time: float) -> Course:
        before = self.courses.get(touch.id, ())
        if before and not before[-1][0] < time < before[-1][0] + _WINDOW:
            before = ()  # another clock, or a pause in which nobody looked
        since = time - _WINDOW
        kept = tuple(row for row in before if row[0] >= since)
        return (*kept, (time, touch.detection.x, touch.detection.y))


class FingerTracker:
    """A tracker whose touches are where the fingers are; what is held still is not moved."""

    def __init__(self, tracker: Tracker, lag: float) -> None:
        self.tracker, self._slides = tracker, SlideCorrection(lag)

    @property
    def events(self) -> tuple[TouchEvent, ...]:
        """What happened in the newest frame."""
        finger = self._slides.of_finger
        return tuple(replace(e, touch=finger(e.touch)) for e in self.tracker.events)

    def update(
        self, detections: Sequence[Detection], time: float, host_time: float
    ) -> tuple[Touch, ...]:
        """Touches of the next frame; see :meth:`Tracker.update`."""
        tracked = self.tracker.update(detections, time, host_time)
        if not self.tracker.settings.still:
            self._slides = self._slides.after(tracked, time)
        return tuple(map(self._slides.of_finger, tracked))


def _heading(course: Course) -> tuple[float, float]:
    """Direction in which a touch slides, as long as it is sure that it does: from 0 to 1.

    Plain numbers: a course of some rows is quicker without arrays.
    """
    times = [row[0] - course[-1][0] for row in course]
    mean = math.fsum(times) / len(times)
    square = math.fsum([(time - mean) ** 2 for time in times])
    u, v = (
        math.fsum([(time - mean) * row[axis] for time, row in zip(times, course, strict=True)])
        / square
        for axis in (1, 2)
    )
    speed = math.hypot(u, v)
    if not speed > _STANDS:
        return 0.0, 0.0
    last = max(sum(time <= -_RECENT for time in times) - 1, 0)
    x, y = (course[-1][axis] - course[last][axis] for axis in (1, 2))
    of_late = (x * u + y * v) / speed / -times[last]
    part = min(max((min(speed, of_late) - _STANDS) / (_SLIDES - _STANDS), 0.0), 1.0)
    return part * u / speed, part * v / speed
