"""Where touches are: each one with its detection of a frame, or without."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from tomoskin.core import Detection
from tomoskin.sensing.track.association import (
    NOTHING,
    Association,
    ExpectedTouch,
    SeenDetection,
    associate,
)
from tomoskin.sensing.track.clock import TrackClock
from tomoskin.sensing.track.motion import TrackSettings, TrackState, begin, observe, predict, update
from tomoskin.sensing.track.policy import confirmed, missed
from tomoskin.sensing.track.strength import log_content
from tomoskin.sensing.track.trace import Trace, sign_of

_PAUSE = 0.5
"""Seconds without frames, in which touches move; in a longer pause they stand: nobody looked."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameOfTouches:
    """What a finder has seen.

    Attributes
    ----------
    detections
        Of one frame.
    seen
        The same as they are compared.
    strongest
        Their largest ratio to the noise; 0 where none is known.
    clock
        The moment.
    settings
        Of the tracker.
    """

    detections: Sequence[Detection]
    seen: Sequence[SeenDetection]
    strongest: float
    clock: TrackClock
    settings: TrackSettings

    @classmethod
    def of(
        cls, detections: Sequence[Detection], clock: TrackClock, settings: TrackSettings
    ) -> Self:
        """Of detections in any order."""
        seen = [SeenDetection(observe(d, settings), sign_of(d), log_content(d)) for d in detections]
        strongest = max([d.snr for d in detections if not math.isnan(d.snr)], default=0.0)
        return cls(detections, seen, strongest, clock, settings)


def expected(traces: Sequence[Trace], frame: FrameOfTouches) -> list[TrackState]:
    """Where each touch is expected."""
    settings = frame.settings
    moving = 0.0 if settings.still else min(frame.clock.passed, _PAUSE)
    return [predict(trace.state, moving, settings) for trace in traces]


def pairs_of(
    traces: Sequence[Trace], states: Sequence[TrackState], frame: FrameOfTouches
) -> Association:
    """Which detection is of which touch."""
    if not traces or not frame.seen:
        return NOTHING
    touches = [
        ExpectedTouch(state, trace.sign, trace.strength, trace.odds, len(trace.members) > 1)
        for trace, state in zip(traces, states, strict=True)
    ]
    return associate(touches, frame.seen)


def miss(
    traces: Sequence[Trace], states: Sequence[TrackState], found: Association, frame: FrameOfTouches
) -> None:
    """Of those that no detection is of: they are where they are expected."""
    paired, clock = set(found.pairs.values()), frame.clock
    if len(paired) == len(traces):
        return
    now = {t.key: t.alone(clock.now) for t in traces if t.reported}
    for number, (trace, state) in enumerate(zip(traces, states, strict=True)):
        if number in paired:
            continue
        if trace.missing is None:
            trace.missing, trace.beside, trace.met = clock.now, now, {}
        trace.state = state
        trace.odds = missed(trace.odds, trace.detection.snr, frame.settings.least_snr, clock.passed)


def see(
    traces: Sequence[Trace], states: Sequence[TrackState], found: Association, frame: FrameOfTouches
) -> None:
    """Of those that a detection is of."""
    settings, clock = frame.settings, frame.clock
    reported = sum(trace.reported for trace in traces)
    for index, number in found.pairs.items():
        trace, detection = traces[number], frame.detections[index]
        position, jumped = frame.seen[index].position, number in found.jumped
        trace.see(detection, clock.now, clock.passed, still=settings.still)
        if jumped:  # its region has changed: it has not moved
            trace.change(clock.now)
        if jumped or settings.still:
            trace.state = begin(position, settings)
        else:
            trace.state = update(states[number], position)
        strongest = frame.strongest if reported > trace.reported else 0.0
        trace.odds = confirmed(trace.odds, detection, settings.snr, strongest, clock.passed)
