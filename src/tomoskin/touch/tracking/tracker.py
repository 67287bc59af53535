"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tomoskin.core import Detection, FloatArray, Touch
from tomoskin.touch.tracking import existence, identity, motion
from tomoskin.touch.tracking.association import NOTHING, Association, ExpectedTouches, associate
from tomoskin.touch.tracking.event import Happening, TouchEvent
from tomoskin.touch.tracking.identity import NOBODY, SURE, IdentityHypothesis
from tomoskin.touch.tracking.merging import (
    Alone,
    MergedFinger,
    crossing,
    meeting,
    met,
    parting,
    reach_of,
    shrunk,
)
from tomoskin.touch.tracking.motion import TrackSettings
from tomoskin.touch.tracking.residual import ResidualResponses, is_residual
from tomoskin.touch.tracking.strength import TouchStrength
from tomoskin.touch.tracking.trace import Trace

_MOVED, _BY_DEVIATIONS = 0.003, 3.0
"""A touch moves when it is so many metres, and deviations, from where it was last reported."""

_PAUSE = 0.5
"""Seconds without frames, in which touches move; in a longer pause they stand: nobody looked."""

_POSSIBLE = 0.05
"""Probability from which another identity is said beside the likeliest."""


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
        self.numbered = 0
        self._residuals = ResidualResponses(self.settings.least_snr)
        self._last: float | None = None
        self._now = self._host = self._passed = 0.0
        self._happened: list[TouchEvent] = []
        self._keys = 0
        self._forget()

    def _forget(self) -> None:
        self._traces: list[Trace] = []
        self._namings = NOBODY
        self._numbers: dict[int, int] = {}
        self._began: dict[int, float] = {}
        self._strengths: dict[int, TouchStrength] = {}
        self._reported_at: dict[int, tuple[float, float]] = {}

    def update(
        self, detections: Sequence[Detection], time: float, host_time: float
    ) -> tuple[Touch, ...]:
        """Touches of this frame, in order of their identity.

        ``time`` is the device's, s; where it does not go on, as when a board starts again, the
        host's counts. ``host_time`` is what touches and events carry.
        """
        self._passed = self._elapse(time, host_time)
        self._host = host_time
        if self.settings.still:  # what stood there before says nothing of this frame
            detections = [detection for detection in detections if not detection.weak]
            self._residuals.forget()
        if detections or self._traces:
            self._follow(list(detections))
        self._residuals.note(self._now, quiet=not detections)
        touches = self._touches()
        self.events, self._happened = tuple(self._happened), []
        return touches

    def reset(self) -> None:
        """Release every touch and forget all else; identities go on counting.

        The next frame tells that they were released. Time starts again at zero: what follows is
        to the bit what a new tracker would make of it.
        """
        for trace in [trace for trace in self._traces if trace.reported]:
            self._end(trace)
        self._forget()
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

    def _follow(self, detections: list[Detection]) -> None:
        """One frame: who is where, who has begun, ended, met and parted."""
        traces = list(self._traces)
        seen = motion.observe(detections, self.settings)
        found, states = NOTHING, _stacked(traces)
        if traces:
            moving = 0.0 if self.settings.still else min(self._passed, _PAUSE)
            states = motion.predict(states, moving, self.settings)
            if detections:
                found = associate(_followed(traces, states), detections, seen)
        groups = [trace for trace in traces if len(trace.members) > 1]
        merged = {m.key: t.alone(self._now) for t in groups for m in t.members}
        strongest = max((d.snr for d in detections if not math.isnan(d.snr)), default=0.0)
        self._miss(set(found.pairs.values()), states)
        self._see(detections, found, seen, states, strongest)
        self._weigh_meetings()
        for index, detection in enumerate(detections):
            if index not in found.pairs and self._begins(detection):
                state = motion.begin(seen[0][index], seen[1][index], self.settings)
                self._begin(detection, state, strongest, merged)
        self._exchange(traces, found)
        self._settle()
        self._know()

    def _begin(
        self,
        detection: Detection,
        state: motion.States,
        strongest: float,
        merged: dict[int, Alone],
    ) -> None:
        self._keys += 1
        others = any(trace.reported for trace in self._traces)
        odds = existence.first(detection, self.settings.snr, strongest if others else 0.0)
        member = MergedFinger(self._keys)
        trace = Trace(detection, state, self._now, self._host, odds, [member])
        trace.beside = merged
        self._traces.append(trace)

    def _begins(self, detection: Detection) -> bool:
        if detection.weak or detection.snr < self.settings.snr:
            return False
        return not self._residuals.explain(detection, self._now, self._traces)

    def _miss(self, paired: set[int], states: motion.States) -> None:
        """Of those that no detection is of: they are where they are expected."""
        if len(paired) == len(self._traces):
            return
        now = {t.key: t.alone(self._now) for t in self._traces if t.reported}
        for number, (trace, state) in enumerate(zip(self._traces, _rows(states), strict=True)):
            if number in paired:
                continue
            if trace.missing is None:
                trace.missing, trace.beside, trace.met = self._now, now, {}
            trace.states = state
            trace.odds = existence.missed(
                trace.odds, trace.detection.snr, self.settings.least_snr, self._passed
            )

    def _see(
        self,
        detections: list[Detection],
        found: Association,
        seen: tuple[FloatArray, FloatArray],
        states: motion.States,
        strongest: float,
    ) -> None:
        if not found.pairs:
            return
        own, which = list(found.pairs.values()), list(found.pairs)
        positions, spreads = seen[0][which], seen[1][which]
        before = motion.States(states.mean[own], states.covariance[own])
        after = _rows(motion.update(before, positions, spreads))
        for row, (number, index, state) in enumerate(zip(own, which, after, strict=True)):
            trace, detection = self._traces[number], detections[index]
            trace.see(detection, self._now, self._passed, still=self.settings.still)
            trace.states = state
            if number in found.jumped:  # its region has changed: it has not moved
                trace.change(self._now)
            if number in found.jumped or self.settings.still:
                trace.states = motion.begin(positions[row], spreads[row], self.settings)
            others = any(t.reported and t is not trace for t in self._traces)
            trace.odds = existence.seen(
                trace.odds,
                detection,
                self.settings.snr,
                strongest if others else 0.0,
                self._passed,
            )

    def _weigh_meetings(self) -> None:
        for lost in self._traces:
            if not lost.reported or lost.missing is None:
                continue
            alone = lost.beside.get(lost.key)
            for trace in self._traces:
                other = lost.beside.get(trace.key)
                if alone is None or other is None or trace.missing is not None:
                    continue
                if trace is not lost and trace.sign == lost.sign:
                    said = met(alone, other, trace.detection)
                    lost.met[trace.key] = lost.met.get(trace.key, 0.0) + said

    def _exchange(self, traces: Sequence[Trace], found: Association) -> None:
        """Note who may have changed places with whom while both were seen."""
        for i, k, odds in found.exchanges:
            one, other = traces[i], traces[k]
            both = one in self._traces and other in self._traces
            if both and one.reported and other.reported and not self.settings.still:
                for trace in (one, other):
                    if len(self._namings) == 1:
                        trace.change(self._now)
                self._namings = identity.exchanged(self._namings, one.key, other.key, odds)

    def _settle(self) -> None:
        """Report what is there, end what is gone."""
        for trace in [t for t in self._traces if not t.reported]:
            self._consider(trace)
        for trace in [t for t in self._traces if t.reported]:
            if trace.missing is not None:
                self._lose(trace)
            elif is_residual(trace, self._now):
                self._end(trace)
        self._namings = identity.judged(self._namings, self._evidence)

    def _consider(self, trace: Trace) -> None:
        """Report a newcomer that is sure to be there, forget one that is not."""
        if self.settings.still and trace.missing is None:
            self._report_onset(trace)
            return
        if trace.missing is not None or trace.detection.snr < self.settings.snr:
            self._traces.remove(trace)
            return
        if trace.odds < existence.BEGUN:
            return
        if self._residuals.explain(trace.detection, self._now, self._traces):
            self._traces.remove(trace)
            return
        origin = self._origin_of(trace)
        if origin is None:
            self._report_onset(trace)
        elif origin.missing is not None:  # its region is gone, and this is one of those it was
            self._traces.remove(trace)
            origin.become(trace)
        else:
            self._split(origin, trace)

    def _report_onset(self, trace: Trace) -> None:
        trace.reported = True
        self.numbered += 1
        self._numbers[trace.key] = self.numbered
        self._began[trace.key] = trace.host_since
        self._namings = identity.begun(self._namings, trace.key)
        self._report("onset", trace)

    def _origin_of(self, branch: Trace) -> Trace | None:
        """The merged touch that a new one has come out of, or None."""
        best: tuple[float, Trace | None] = (0.0, None)
        for trace in self._traces:
            before = branch.beside.get(trace.key)
            if before and len(trace.members) > 1 and trace.sign == branch.sign:
                reach = reach_of(trace.members)
                odds = parting(trace.detection, branch.detection, reach)
                if trace.missing is None:
                    odds += shrunk(
                        before.strength,
                        TouchStrength.of(trace.detection),
                        TouchStrength.of(branch.detection),
                    )
                if odds > best[0]:
                    best = odds, trace
        return best[1]

    def _split(self, carrier: Trace, branch: Trace) -> None:
        """Divide the fingers of ``carrier``: who is who now, motion and strength will say."""
        ends = [np.array([t.detection.x, t.detection.y]) for t in (carrier, branch)]
        members = carrier.members
        leaves = min(members, key=lambda m: _unlike(m, branch))
        carrier.members = [m for m in members if m is not leaves]
        branch.members, branch.reported = [leaves], True
        for stays in carrier.members:
            odds = crossing(stays, leaves, ends[0] - ends[1], self._now)
            self._namings = identity.exchanged(self._namings, stays.key, leaves.key, odds)
        for trace in (carrier, branch):
            trace.change(self._now)
        names = self._namings[0].names
        for trace in sorted((carrier, branch), key=lambda t: names[t.key]):
            self._report("split", trace)

    def _lose(self, trace: Trace) -> None:
        """Of one that is missing: it has met another, or has been lifted, or is waited for."""
        odds, carrier = self._met_by(trace)
        over = self.settings.still or trace.odds < existence.ENDED
        if carrier is not None and (odds > existence.MET or (over and odds > 0)):
            self._merge(carrier, trace)
        elif over:
            self._end(trace)

    def _merge(self, carrier: Trace, lost: Trace) -> None:
        self._traces.remove(lost)
        for one in (carrier, lost):
            if len(one.members) == 1:
                one.members[0].alone = lost.beside[one.key]
        carrier.absorb(lost)
        carrier.change(self._now)
        self._report("merge", carrier)

    def _met_by(self, lost: Trace) -> tuple[float, Trace | None]:
        """The touch that the ``lost`` one is too close to be told from, with the log odds of it."""
        alone = lost.beside.get(lost.key)
        best: tuple[float, Trace | None] = (-math.inf, None)
        for trace in self._traces:
            other = lost.beside.get(trace.key)
            if alone and other and trace.key in lost.met and trace.missing is None:
                said = meeting(alone, other, lost.met[trace.key], close=trace.detection.close)
                if said > best[0]:
                    best = said, trace
        return best

    def _end(self, trace: Trace) -> None:
        self._traces.remove(trace)
        self._residuals.leave(trace, self._now)
        keys = [member.key for member in trace.members]
        names = sorted(self._namings[0].names[key] for key in keys)
        for name in names:  # nobody else can be it any more, and a run may last for weeks
            number, began = self._numbers.pop(name), self._began.pop(name)
            self._strengths.pop(name, None)
            self._reported_at.pop(number, None)
            ended = Touch(number, trace.kind, began, trace.shown)
            self._happened.append(TouchEvent("release", ended, self._host))
        self._namings = identity.ended(self._namings, keys)

    def _know(self) -> None:
        """Remember how strong each finger is of which it is sure who it is."""
        for trace in self._traces:
            if trace.reported and trace.missing is None and len(trace.members) == 1:
                names = {naming.names[trace.key] for naming in self._namings}
                if len(names) == 1:
                    self._strengths[names.pop()] = trace.strength

    def _evidence(self, naming: IdentityHypothesis) -> float:
        """What strengths say for it."""
        said = 0.0
        for trace in self._traces:
            if trace.reported and len(trace.members) == 1:
                before = self._strengths.get(naming.names[trace.key])
                if before is not None:
                    said += trace.fresh.log_likelihood(before)
        return said

    def _touches(self) -> tuple[Touch, ...]:
        parts = identity.probabilities(self._namings, self._evidence)
        shown = [(t, self._touch(t, parts)) for t in self._traces if t.reported]
        for trace, touch in sorted(shown, key=lambda pair: pair[1].id):
            self._note_move(trace, touch)
        return tuple(sorted((touch for _, touch in shown), key=lambda touch: touch.id))

    def _touch(self, trace: Trace, parts: Sequence[float]) -> Touch:
        """As it is reported: a merged one by the oldest of its numbers."""
        keys = [member.key for member in trace.members]
        weights: dict[tuple[int, ...], float] = {}
        for naming, part in zip(self._namings, parts, strict=True):
            names = tuple(sorted(naming.names[key] for key in keys))
            weights[names] = weights.get(names, 0.0) + part
        names = tuple(sorted(self._namings[0].names[key] for key in keys))
        possible: set[int] = set()
        if weights[names] < SURE:
            possible = {n for group, part in weights.items() if part > _POSSIBLE for n in group}
        numbers = tuple(sorted(self._numbers[name] for name in names))
        return Touch(
            numbers[0],
            trace.kind,
            self._began[names[0]],
            trace.shown,
            numbers if len(numbers) > 1 else (),
            tuple(sorted(self._numbers[name] for name in possible)),
        )

    def _note_move(self, trace: Trace, touch: Touch) -> None:
        now = touch.detection.x, touch.detection.y
        before = self._reported_at.setdefault(touch.id, now)
        far = math.hypot(now[0] - before[0], now[1] - before[1])
        if far > _MOVED and not far < _BY_DEVIATIONS * trace.held.wavers:
            self._happened.append(TouchEvent("move", touch, self._host))
            self._reported_at[touch.id] = now

    def _report(self, kind: Happening, trace: Trace) -> None:
        touch = self._touch(trace, identity.probabilities(self._namings, self._evidence))
        self._reported_at[touch.id] = touch.detection.x, touch.detection.y
        self._happened.append(TouchEvent(kind, touch, self._host))


def _followed(traces: Sequence[Trace], states: motion.States) -> ExpectedTouches:
    signs = np.array([trace.sign for trace in traces])
    odds = np.array([trace.odds for trace in traces])
    several = np.array([len(trace.members) > 1 for trace in traces])
    return ExpectedTouches(states, signs, [trace.strength for trace in traces], odds, several)


def _unlike(member: MergedFinger, branch: Trace) -> float:
    """How much less than the others it seems to be the ``branch``."""
    if member.alone is None:
        return 0.0
    return -branch.strength.log_likelihood(member.alone.strength)


def _stacked(traces: Sequence[Trace]) -> motion.States:
    if not traces:
        return motion.States(np.empty((0, 4)), np.empty((0, 4, 4)))
    mean = np.concatenate([trace.states.mean for trace in traces])
    return motion.States(mean, np.concatenate([trace.states.covariance for trace in traces]))


def _rows(states: motion.States) -> Iterator[motion.States]:
    for k in range(len(states.mean)):
        yield motion.States(states.mean[k : k + 1], states.covariance[k : k + 1])
