"""The device's clock against the host's, from the frames themselves, in memory of fixed size."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, field

from tomoskin.core import DriveSamples, Event, Frame

TICK_RATES = (100.0, 100e6)
"""Hz, between which the clock of a board can run. Any other rate is a mistake of its firmware."""

_FEWEST = 20
"""Fewer frames say more of the line's jitter than of the clock."""

_MOST_CORNERS = 256

_WATCHED = 5.0
"""s after which the rate of a clock is known well enough to be doubted."""

_TURN = 60.0
"""s after which a newer fit of the clock takes over."""

_LATEST = 1.0
"""s by which a frame can be late, or its board's clock be ahead of it; beyond, the clock has been
set."""

_MOST_DRIFT = 0.05
"""Crystals and resonators are off by less than 1 %."""


@dataclass(frozen=True, slots=True)
class ClockFit:
    """ticks = tick_rate · (host time − offset), over ``frames`` frames.

    ``tick_rate`` Hz by the host's clock; ``offset`` host time of tick 0, s, as early as any frame
    came; ``residual`` root mean square of what host times are later, s.
    """

    tick_rate: float
    offset: float
    residual: float
    frames: int

    def drift(self, nominal: float) -> float:
        """By how much the device's clock is fast, as a fraction of its ``nominal`` rate in Hz."""
        return self.tick_rate / nominal - 1.0


@dataclass(slots=True)
class _Run:
    """Frames between two starts of the device: sums of x, ticks since the first, and of y, host
    time since the first, s; and corners of the lower hull."""

    first: int
    first_time: float
    last: int
    n: int = 0
    x: float = 0.0
    y: float = 0.0
    xx: float = 0.0
    xy: float = 0.0
    yy: float = 0.0
    corners: list[tuple[float, float]] = field(default_factory=list)


class ClockFitter:
    """Takes ticks and host times of frames one by one; begins again when the device does.

    A frame is never early, and late by whatever line, USB and scheduler like: in batches, by
    chance, now and then for long. So the line runs below all frames, as close to them as it can:
    along the edge of their lower convex hull over their mean tick (Zhang, Liu and Xia 2002,
    "Clock synchronization algorithms for network measurements", section IV).
    """

    def __init__(self) -> None:
        self._run: _Run | None = None

    def add(self, ticks: int, host_time: float) -> None:
        """Take the counter and the arrival of one frame into the fit."""
        run = self._run
        if run is None or ticks < run.last:
            run = self._run = _Run(ticks, host_time, ticks)
        run.last = ticks
        x, y = float(ticks - run.first), host_time - run.first_time
        run.n += 1
        run.x, run.y = run.x + x, run.y + y
        run.xx, run.xy, run.yy = run.xx + x * x, run.xy + x * y, run.yy + y * y
        corners = run.corners  # of the lower convex hull (Andrew 1979), in O(1) on average
        if corners and x <= corners[-1][0]:
            return  # the same tick again
        while len(corners) > 1:
            (x0, y0), (x1, y1) = corners[-2:]
            if (y1 - y0) * (x - x0) < (y - y0) * (x1 - x0):  # the last one is below
                break
            corners.pop()
        corners.append((x, y))
        if len(corners) > _MOST_CORNERS:
            del corners[1:-1:2]

    @property
    def fit(self) -> ClockFit | None:
        """The fit so far; None before there are enough frames."""
        run = self._run
        if run is None or run.n < _FEWEST or len(run.corners) < 2:
            return None
        mean = run.x / run.n
        right = bisect_left(run.corners, (mean,), 1)
        (x0, y0), (x1, y1) = run.corners[right - 1], run.corners[right]
        b = (y1 - y0) / (x1 - x0)
        a = y0 - b * x0
        if not b > 0:
            return None
        square = run.yy - 2 * (a * run.y + b * run.xy) + b * (2 * a * run.x + b * run.xx)
        late = math.sqrt(max(square / run.n + a * a, 0.0))  # root mean square of y − a − b x
        return ClockFit(1 / b, run.first_time + a - b * run.first, late, run.n)


class ScanTimer:
    """When scans were, by the host's clock: frames come late by chance, scans do not.

    Two fits take turns, so that a clock that wanders is followed.
    """

    def __init__(self) -> None:
        self._now, self._next, self._until = ClockFitter(), ClockFitter(), -math.inf
        self._before: Frame | None = None
        self._shortest = (math.inf, math.inf)

    def middle(self, frame: Frame, longest: float, tick_rate: float) -> tuple[float, float]:
        """Host time of the middle of the frame's scan, and the scan's duration, s.

        A scan takes ``longest`` s at most, and no longer than from one frame to the next by a
        clock of ``tick_rate`` Hz; but for one time, since a clock can stumble.
        """
        before, self._before = self._before, frame
        ticked = (frame.ticks - before.ticks) / tick_rate if before else 0.0
        if before and ticked - (frame.host_time - before.host_time) > _LATEST:
            self._now, self._next = ClockFitter(), ClockFitter()
        if ticked > 0:
            second, first = sorted((*self._shortest, ticked), reverse=True)[1:]
            self._shortest = second, first
        if frame.host_time > self._until:
            self._now, self._next = self._next, ClockFitter()
            self._until = frame.host_time + _TURN
        for fitter in (self._now, self._next):
            fitter.add(frame.ticks, frame.host_time)
        duration, fit, came = min(longest, self._shortest[0]), self._now.fit, frame.host_time
        if fit is not None:
            came = min(came, fit.offset + frame.ticks / fit.tick_rate)
        if came < frame.host_time - _LATEST:
            self._now, self._next, came = ClockFitter(), ClockFitter(), frame.host_time
        return came - duration / 2, duration

    def drive(self, part: DriveSamples, n_drives: int) -> tuple[float, float]:
        """Host time of the middle of one of the ``n_drives`` of a scan, and its duration, s."""
        fit, scan = self._now.fit, self._shortest[0]
        if fit is None or not math.isfinite(scan):
            return part.host_time, 0.0
        half = scan / n_drives / 2
        last = fit.offset + part.ticks / fit.tick_rate  # when a scan that began with it would come
        begun = last - scan
        return min(begun, part.host_time - 2 * half) + half, 2 * half


class ClockWatch:
    """Says once that a board's clock runs at another rate than the board states."""

    def __init__(self) -> None:
        self._fitter, self._begun, self._said = ClockFitter(), math.inf, False

    def push(self, frame: Frame, stated: float) -> Event | None:
        """Take a frame of a board that states a tick rate of ``stated`` Hz."""
        self._fitter.add(frame.ticks, frame.host_time)
        self._begun = min(self._begun, frame.host_time)
        if self._said or frame.host_time - self._begun < _WATCHED:
            return None
        fit = self._fitter.fit
        if fit is None or abs(fit.drift(stated)) < _MOST_DRIFT:
            return None
        self._said = True
        text = (
            f"the board states a clock of {stated:,.0f} Hz, but it runs at {fit.tick_rate:,.0f} Hz "
            "by this computer: times and speeds of touches are wrong by as much"
        )
        return Event(frame.host_time, "clock", text)
