"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tomoskin.core import Detection, FloatArray, Touch
from tomoskin.touch.tracking import motion
from tomoskin.touch.tracking.merging import carrier_of, merge, origin_of, split
from tomoskin.touch.tracking.motion import TrackSettings, assign
from tomoskin.touch.tracking.residual import ResidualResponses, is_residual
from tomoskin.touch.tracking.trace import Trace, Unmerged

Happening = Literal["onset", "move", "release", "merge", "split"]

_ROUNDING = 1e-9

_MOVED, _BY_DEVIATIONS = 0.003, 3.0
"""A touch moves when it is so many metres, and deviations, from where it was last reported."""


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
        """A sentence for people."""
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


class Tracker:
    """Joins detections to touches; remembers what can come back.

    Attributes
    ----------
    events
        What happened in the newest frame.
    numbered
        The last identity that was given.
    """

    def __init__(self, settings: TrackSettings | None = None) -> None:
        self.settings = settings or TrackSettings()
        self.events: tuple[TouchEvent, ...] = ()
        self._traces: list[Trace] = []
        self._residuals = ResidualResponses(self.settings.least_snr)
        self.numbered = 0
        self._last: float | None = None
        self._now = 0.0
        self._host = 0.0
        self._happened: list[TouchEvent] = []

    def update(
        self, detections: Sequence[Detection], time: float, host_time: float
    ) -> tuple[Touch, ...]:
        """Touches of this frame, in order of their identity.

        ``time`` is the device's, s; where it does not go on, as when a board starts again, the
        host's counts. ``host_time`` is what touches and events carry.
        """
        elapsed = self._elapse(time, host_time)
        self._host = host_time
        if self.settings.still:  # what stood there before says nothing of this frame
            detections = [detection for detection in detections if not detection.weak]
            self._residuals.forget()
        if detections or self._traces:
            self._follow(list(detections), elapsed)
        self._residuals.note(self._now, quiet=not detections)
        self.events, self._happened = tuple(self._happened), []
        shown = [trace.touch for trace in self._traces if trace.number]
        return tuple(sorted(shown, key=lambda touch: touch.id))

    def reset(self) -> None:
        """Release every touch and forget all else; identities go on counting.

        The next frame tells that they were released. Time starts again at zero: what follows is
        to the bit what a new tracker would make of it.
        """
        for trace in [trace for trace in self._traces if trace.number]:
            self._end(trace)
        self._traces = []
        self._residuals.forget()
        self.events = ()
        self._last, self._now, self._host = None, 0.0, 0.0

    def _elapse(self, time: float, host_time: float) -> float:
        elapsed = 0.0
        if self._last is not None:
            elapsed = time - self._last if time > self._last else max(host_time - self._host, 0.0)
        self._last = time
        self._now += elapsed
        return elapsed

    def _follow(self, detections: list[Detection], elapsed: float) -> None:
        traces, settings = self._traces, self.settings
        seen = motion.observe(detections, settings)
        states = _stacked(traces)
        pairs: dict[int, int] = {}
        if traces:
            states = motion.predict(states, elapsed, settings)
        if traces and detections:
            signs = np.array([trace.sign for trace in traces])
            behind = np.array([not t.number or t.missing is not None for t in traces], float)
            pairs, far = assign(states, signs, behind, detections, seen)
            self._note_missing(set(pairs.values()), states)
            self._see(detections, pairs, seen, states, far)
        else:
            self._note_missing(set(), states)
        for index, detection in enumerate(detections):
            if index not in pairs and self._begins(detection):
                state = motion.begin(seen[0][index], seen[1][index], settings)
                traces.append(Trace(detection, state, self._now, self._host))
        self._settle()

    def _note_missing(self, paired: set[int], states: motion.States) -> None:
        """Of those that no detection is of: they are where they are expected."""
        if len(paired) == len(self._traces):
            return
        for trace, state in zip(self._traces, _rows(states), strict=True):
            trace.states = state
        lost = [trace for k, trace in enumerate(self._traces) if k not in paired]
        going = [trace for trace in lost if trace.missing is None]
        if going:
            reported = [trace for trace in self._traces if trace.number]
            now = {t.number: Unmerged(t.detection, t.states, self._now) for t in reported}
            for trace in going:
                trace.missing, trace.beside = self._now, now

    def _see(
        self,
        detections: list[Detection],
        pairs: dict[int, int],
        seen: tuple[FloatArray, FloatArray],
        states: motion.States,
        far: FloatArray,
    ) -> None:
        if not pairs:
            return
        own, which = list(pairs.values()), list(pairs)
        positions, spreads = seen[0][which], seen[1][which]
        before = motion.States(states.mean[own], states.covariance[own])
        after = _rows(motion.update(before, positions, spreads))
        jumped = far[own, which] > motion.GATE
        for row, (trace, index, state) in enumerate(zip(own, which, after, strict=True)):
            followed = self._traces[trace]
            followed.see(detections[index], self._now, still=self.settings.still)
            followed.states = state
            if jumped[row]:  # its region has changed: it has not moved
                followed.states = motion.begin(positions[row], spreads[row], self.settings)

    def _begins(self, detection: Detection) -> bool:
        if detection.weak or detection.snr < self.settings.snr:
            return False
        return not self._residuals.explain(detection, self._now, self._traces)

    def _settle(self) -> None:
        """Report what has stood long enough, end what has been gone long enough."""
        for trace in list(self._traces):
            if not trace.number:
                self._consider(trace)
        for trace in [t for t in self._traces if t.number]:
            if trace.missing is not None and self._lasts(trace.missing, self.settings.release):
                self._lose(trace)
            elif trace.missing is None and is_residual(trace, self._now, self.settings.release):
                self._end(trace)
        for trace in self._traces:
            if trace.number and self._has_moved(trace):
                self._report("move", trace)

    def _consider(self, trace: Trace) -> None:
        """Report a newcomer that has stood, forget one that has not."""
        if trace.missing is not None or trace.detection.snr < self.settings.snr:
            self._traces.remove(trace)
            return
        if not self._lasts(trace.since, self.settings.onset):
            return
        if self._residuals.explain(trace.detection, self._now, self._traces):
            self._traces.remove(trace)
            return
        origin = origin_of(trace, self._traces)
        if origin is None:
            self.numbered += 1
            trace.number = self.numbered
            self._report("onset", trace)
            return
        if origin.missing is not None:  # its region is gone, and this is one of those it was
            self._traces.remove(trace)
            origin.become(trace)
            return
        both = split(origin, trace, self._now)
        self._traces.remove(trace)
        self._traces.remove(origin)
        self._traces += both
        for one in both:
            self._report("split", one)

    def _lasts(self, since: float, seconds: float) -> bool:
        """Whether ``seconds`` have gone by, and a frame at least."""
        return not seconds or (self._now > since and self._now - since >= seconds - _ROUNDING)

    def _lose(self, trace: Trace) -> None:
        carrier = carrier_of(trace, self._traces)
        if carrier is None:
            self._end(trace)
            return
        self._traces.remove(trace)
        merge(carrier, trace)
        self._report("merge", carrier)

    def _end(self, trace: Trace) -> None:
        self._traces.remove(trace)
        for member in trace.members:
            self._residuals.leave(member, self._now)
            ended = replace(trace.touch, id=member.number, since=member.host_since, merged=())
            self._happened.append(TouchEvent("release", ended, self._host))

    def _has_moved(self, trace: Trace) -> bool:
        (x, y), held = trace.reported_at, trace.held
        far = math.hypot(held.x - x, held.y - y)
        return far > _MOVED and not far < _BY_DEVIATIONS * held.wavers

    def _report(self, kind: Happening, trace: Trace) -> None:
        trace.reported_at = (trace.held.x, trace.held.y)
        self._happened.append(TouchEvent(kind, trace.touch, self._host))


def _stacked(traces: Sequence[Trace]) -> motion.States:
    if not traces:
        return motion.States(np.empty((0, 4)), np.empty((0, 4, 4)))
    mean = np.concatenate([trace.states.mean for trace in traces])
    return motion.States(mean, np.concatenate([trace.states.covariance for trace in traces]))


def _rows(states: motion.States) -> Iterator[motion.States]:
    for k in range(len(states.mean)):
        yield motion.States(states.mean[k : k + 1], states.covariance[k : k + 1])
