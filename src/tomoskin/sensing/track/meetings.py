"""Which of the traces have met, and which has come out of which."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tomoskin.sensing.track.merging import (
    MergedFinger,
    crossing,
    meeting,
    met,
    parting,
    reach_of,
    shrunk,
)
from tomoskin.sensing.track.strength import TouchStrength
from tomoskin.sensing.track.trace import Trace


def weigh_meetings(traces: Sequence[Trace]) -> None:
    """Note of each that is missing what this frame says for its having met another one."""
    for lost in traces:
        if not lost.reported or lost.missing is None:
            continue
        alone = lost.beside.get(lost.key)
        for trace in traces:
            other = lost.beside.get(trace.key)
            if alone is None or other is None or trace.missing is not None:
                continue
            if trace is not lost and trace.sign == lost.sign:
                said = met(alone, other, trace.detection)
                lost.met[trace.key] = lost.met.get(trace.key, 0.0) + said


def met_by(lost: Trace, traces: Sequence[Trace]) -> tuple[float, Trace | None]:
    """The touch that the ``lost`` one is too close to be told from, with the log odds of it."""
    alone = lost.beside.get(lost.key)
    best: tuple[float, Trace | None] = (-math.inf, None)
    for trace in traces:
        other = lost.beside.get(trace.key)
        if alone and other and trace.key in lost.met and trace.missing is None:
            said = meeting(alone, other, lost.met[trace.key], close=trace.detection.close)
            if said > best[0]:
                best = said, trace
    return best


def origin_of(branch: Trace, traces: Sequence[Trace]) -> Trace | None:
    """The merged touch that a new one has come out of, or None."""
    return _likeliest(branch, [trace for trace in traces if len(trace.members) > 1])


def _likeliest(branch: Trace, traces: Sequence[Trace]) -> Trace | None:
    """That of the ``traces`` which has most likely been one with the ``branch``, or None."""
    best: tuple[float, Trace | None] = (0.0, None)
    for trace in traces:
        before = branch.beside.get(trace.key)
        if before and trace.sign == branch.sign:
            odds = parting(trace.detection, branch.detection, reach_of(trace.members))
            if trace.missing is None:
                left, gone = TouchStrength.of(trace.detection), TouchStrength.of(branch.detection)
                odds += shrunk(before.strength, left, gone)
            if odds > best[0]:
                best = odds, trace
    return best[1]


def sibling_of(branch: Trace, traces: Sequence[Trace]) -> Trace | None:
    """The touch that a new one has been seen as one with since it began, or None."""
    alone = [trace for trace in traces if len(trace.members) == 1 and trace.missing is None]
    return _likeliest(branch, alone)


def divide(carrier: Trace, branch: Trace, time: float) -> list[tuple[int, int, float]]:
    """Give the ``branch`` the finger of the ``carrier`` that it is most like.

    Who is who now, motion and strength will say: (key, key, log odds) of fingers that may have
    come out the other way round.
    """
    one, other = carrier.detection, branch.detection
    apart = one.x - other.x, one.y - other.y
    leaves = min(carrier.members, key=lambda member: _unlike(member, branch))
    carrier.members = [member for member in carrier.members if member is not leaves]
    branch.members = [leaves]
    return [
        (stays.key, leaves.key, crossing(stays, leaves, apart, time)) for stays in carrier.members
    ]


def merge(carrier: Trace, lost: Trace, time: float) -> None:
    """Let the ``carrier`` stand for the ``lost`` one too."""
    for one in (carrier, lost):
        if len(one.members) == 1:
            one.members[0].alone = lost.beside[one.key]
    carrier.absorb(lost)
    carrier.change(time)


def _unlike(member: MergedFinger, branch: Trace) -> float:
    """How much less than the others it seems to be the ``branch``."""
    if member.alone is None:
        return 0.0
    return -branch.strength.log_likelihood(member.alone.strength)
