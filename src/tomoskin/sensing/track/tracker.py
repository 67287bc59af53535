"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from tomoskin.core import Detection, Touch, show
from tomoskin.sensing.track import merging, policy
from tomoskin.sensing.track.association import FrameOfTouches, ObservedDetection, associate, follow
from tomoskin.sensing.track.decision import STEP, TrackDecision
from tomoskin.sensing.track.identity import IdentityLedger
from tomoskin.sensing.track.motion import TrackSettings, begin
from tomoskin.sensing.track.rim import Rim
from tomoskin.sensing.track.sliding import SlideCorrection
from tomoskin.sensing.track.trace import (
    Alone,
    Happening,
    MergedFinger,
    ResidualResponses,
    TouchEvent,
    Trace,
    TrackClock,
    is_residual,
)


class Tracker:
    """Joins detections to touches; remembers what can come back.

    Attributes
    ----------
    events
        What happened in the newest frame.
    traces
        Touches, and what may become one.
    residuals
        Where touches were, of which something may still show.
    slides
        Moves touches that slide to the finger; what is held still is not moved.
    rim
        Of the sheet, beyond which no touch is told; None where it is not known.
    responses
        The touches of the newest frame where the sheet's response is, not moved.
    ledger
        Who is who.
    """

    def __init__(self, settings: TrackSettings | None = None) -> None:
        self.settings = settings or TrackSettings()
        self.events: tuple[TouchEvent, ...] = ()
        self.responses: tuple[Touch, ...] = ()
        self.traces: list[Trace] = []
        self.residuals = ResidualResponses()
        self.slides, self.ledger = SlideCorrection(0.0), IdentityLedger()
        self.rim: Rim | None = None
        self._clock = TrackClock()
        self._happened: list[TouchEvent] = []
        self._keys = 0

    def update(
        self, detections: Sequence[Detection], time: float, host_time: float
    ) -> tuple[Touch, ...]:
        """Touches of this frame, in order of their identity.

        ``time`` is the device's, s; where it does not go on, as when a board starts again, the
        host's counts. ``host_time`` is what touches and events carry.
        """
        self._clock = self._clock.at(time, host_time)
        if self.settings.still:  # what stood there before says nothing of this frame
            detections = [detection for detection in detections if not detection.weak]
            self.residuals.forget()
        if detections or self.traces:
            self._follow(FrameOfTouches.of(detections, self._clock, self.settings))
        self.residuals.note(self._clock.now, quiet=not detections)
        touches = self.responses = self._touches() if self.traces else ()
        happened, self._happened = self._happened, []
        if not self.settings.still:
            self.slides = self.slides.after(touches, time)
        finger = self.finger
        self.events = tuple([replace(event, touch=finger(event.touch)) for event in happened])
        return tuple(map(finger, touches))

    def finger(self, touch: Touch) -> Touch:
        """``touch`` of the newest frame as it is told: where the finger is, and on the sheet."""
        moved = self.slides.of_finger(touch)
        return moved if self.rim is None else self.rim.on_sheet(moved)

    def reset(self) -> None:
        """Release every touch and forget all else; identities go on counting.

        The next frame tells that they were released. Time starts again at zero: what follows is
        to the bit what a new tracker would make of it.
        """
        for trace in [trace for trace in self.traces if trace.reported]:
            self._end(trace)
        self.traces = []
        self.ledger.forget()
        self.residuals.forget()
        self.events = ()
        self._clock = TrackClock()

    def _follow(self, frame: FrameOfTouches) -> None:
        """One frame: who is where, who has begun, ended, met and parted."""
        traces, now = list(self.traces), self._clock.now
        found = associate(traces, frame)
        fresh = len(found.pairs) < len(frame.observed)
        beside = {m.key: t.alone(now) for t in traces if fresh and t.reported for m in t.members}
        follow(traces, found, frame)
        for trace in traces:
            if trace.reported:
                number = self.ledger.number(trace.key)
                show(STEP, partial(TrackDecision.followed, trace, number, frame))
        merging.weigh_meetings(traces)
        for index, observed in enumerate(frame.observed):
            detection = observed.detection
            if index in found.pairs:
                continue
            if not policy.may_begin(detection, self.settings.snr):
                show(STEP, partial(TrackDecision.refused, detection, self.settings.snr))
            elif self.residuals.explain(detection, now, self.traces):
                show(STEP, partial(TrackDecision.residual, detection))
            else:
                self._begin(observed, frame, beside)
        for i, k, odds in found.exchanges:  # while both were seen
            one, other = traces[i], traces[k]
            if one.reported and other.reported and not self.settings.still:
                for trace in (one, other):
                    if self.ledger.sure:
                        trace.change(now)
                self.ledger.exchange(one.key, other.key, odds)
        self._settle(alone=len(frame.observed) == 1)
        self.ledger.judge(self.traces)

    def _begin(
        self, observed: ObservedDetection, frame: FrameOfTouches, beside: dict[int, Alone]
    ) -> None:
        self._keys += 1
        detection = observed.detection
        stands = any(trace.reported and trace.missing is None for trace in self.traces)
        strongest = frame.strongest if stands or detection.snr < frame.strongest else 0.0
        odds = policy.initiated(detection, self.settings.snr, strongest, stands=stands)
        state = begin(observed.position, self.settings)
        clock = self._clock
        trace = Trace(detection, state, clock.now, clock.host, odds, [MergedFinger(self._keys)])
        trace.beside = beside
        sibling = merging.sibling_of(trace, self.traces)
        if sibling is not None:  # its strength has not faded: some of it was the newcomer's
            sibling.change(clock.now)
        self.traces.append(trace)

    def _settle(self, *, alone: bool) -> None:
        """Report what is there, end what is gone; ``alone``: one detection was all."""
        for trace in [t for t in self.traces if not t.reported]:
            self._consider(trace)
        for trace in [t for t in self.traces if t.reported]:
            if trace.missing is not None:
                self._lose(trace)
            elif is_residual(trace, self._clock.now, alone=alone):
                self._end(trace)

    def _consider(self, trace: Trace) -> None:
        """Report a newcomer that is sure to be there, forget one that is not."""
        if self.settings.still and trace.missing is None:
            self._report_onset(trace)
            return
        if trace.missing is not None or not policy.may_begin(trace.detection, self.settings.snr):
            self.traces.remove(trace)
            return
        seconds = self._clock.now - trace.since
        if not policy.is_reported(trace.odds, trace.detection, seconds):
            show(STEP, partial(TrackDecision.waiting, trace))
            return
        if self.residuals.explain(trace.detection, self._clock.now, self.traces):
            show(STEP, partial(TrackDecision.residual, trace.detection))
            self.traces.remove(trace)
            return
        origin = merging.origin_of(trace, self.traces)
        if origin is None:
            self._report_onset(trace)
        elif origin.missing is not None:  # its region is gone, and this is one of those it was
            self.traces.remove(trace)
            origin.become(trace)
        else:
            self._split(origin, trace)

    def _report_onset(self, trace: Trace) -> None:
        trace.reported = True
        self.ledger.begin(trace.key, trace.host_since)
        show(STEP, partial(TrackDecision.initiated, trace, self.ledger.number(trace.key)))
        self._report("onset", trace)

    def _split(self, carrier: Trace, branch: Trace) -> None:
        """Divide the fingers of ``carrier``."""
        for one, other, odds in merging.divide(carrier, branch, self._clock.now):
            self.ledger.exchange(one, other, odds)
        branch.reported = True
        for trace in (carrier, branch):
            trace.change(self._clock.now)
        for trace in sorted((carrier, branch), key=lambda t: self.ledger.name(t.key)):
            self._report("split", trace)

    def _lose(self, trace: Trace) -> None:
        """Of one that is missing: it has met another, or has been lifted, or is waited for."""
        odds, carrier = merging.met_by(trace, self.traces)
        over = self.settings.still or policy.is_deleted(trace.odds)
        if carrier is not None and policy.has_met(odds, deleted=over):
            self.traces.remove(trace)
            merging.merge(carrier, trace, self._clock.now)
            self._report("merge", carrier)
        elif over:
            self._end(trace)

    def _end(self, trace: Trace) -> None:
        show(STEP, partial(TrackDecision.deleted, trace, self.ledger.number(trace.key)))
        self.traces.remove(trace)
        self.residuals.leave(trace, self._clock.now)
        for touch in self.ledger.end(trace):
            self._happened.append(TouchEvent("release", touch, self._clock.host))

    def _touches(self) -> tuple[Touch, ...]:
        shown = [trace for trace in self.traces if trace.reported]
        touches = self.ledger.touches(shown, self.traces)
        pairs = sorted(zip(touches, shown, strict=True), key=lambda pair: pair[0].id)
        for touch, trace in pairs:
            if self.ledger.moved(touch, trace.held.wavers):
                self._happened.append(TouchEvent("move", touch, self._clock.host))
                self.ledger.place(touch)
        return tuple([touch for touch, _ in pairs])

    def _report(self, kind: Happening, trace: Trace) -> None:
        (touch,) = self.ledger.touches([trace], self.traces)
        self.ledger.place(touch)
        self._happened.append(TouchEvent(kind, touch, self._clock.host))
