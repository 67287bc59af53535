"""Touches that come too close to separate, and come apart again: what speaks for either."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tomoskin.core import Detection
from tomoskin.sensing.track.position import NOISE, TouchStrength, log_content
from tomoskin.sensing.track.trace import Alone, MergedFinger, Trace

# Chosen on the moving plant, seeds 1 to 3 (docs/theory/tracking.md).

_RESOLUTION = 0.035
"""Two touches so far apart, m, are seen as one with a probability of 0.6 of that when they are in
one place (Koch & van Keuk 1997)."""

_MEETS, _STANDS = 3.0, -1.0
"""Logarithms of how many times as often a touch that goes missing in the midst of another has met
it as it has been lifted: where they come closer, and where they were as near before and seen."""

_CLOSING = 0.01
"""Speed at which two touches come closer, m/s, beside which they stand."""

_CLOSE = 2.0
"""The same of a detection that may be several."""

_PARTS = 3.0
"""Logarithm of how many times as often merged touches part as a new one begins beside them."""

_LEAST, _MOST = -0.75, 3.0
"""What one frame says at the least and the most: its errors are those of the next, and of two that
are too close a fit may find one alone."""

_OFF = 0.006
"""Deviation of the position of what is seen as one, beside its noise, m."""

_COURSE, _BACK, _ANY = 0.6, 0.2, 0.2
"""How often touches go on as they went, come out where they went in, or anywhere."""

_ASIDE, _ANYWHERE = 0.04, 0.08
"""Deviations along each axis of the latter two, m."""

_SWERVE = 0.001
"""Variance by which a course changes its speed along an axis in a second, m²/s²."""


def met(lost: Alone, other: Alone, detection: Detection) -> float:
    """What a ``detection`` of the ``other`` says for its being both, log likelihood ratio."""
    share = 1 / (1 + math.exp(lost.strength.mean - other.strength.mean))
    rest, one, two = 1 - share, other.state, lost.state
    xx, xy, yy = (
        value if math.isfinite(value) else 0.0
        for value in (detection.sd_x**2, detection.cov_xy, detection.sd_y**2)
    )
    xx, yy = xx + _OFF**2, yy + _OFF**2
    spread = [
        share**2 * a + rest**2 * b + noise
        for a, b, noise in ((one.xx, two.xx, xx), (one.xy, two.xy, xy), (one.yy, two.yy, yy))
    ]
    middle = share * one.x + rest * two.x, share * one.y + rest * two.y
    there = _normal(detection.x - middle[0], detection.y - middle[1], *spread)
    alone = _normal(detection.x - one.x, detection.y - one.y, one.xx + xx, one.xy + xy, one.yy + yy)
    content = grown(detection, other.strength, lost.strength)
    return min(max(there - alone + content, _LEAST), _MOST)


def grown(detection: Detection, alone: TouchStrength, more: TouchStrength) -> float:
    """What a content says for being that of two touches, log likelihood ratio against the one."""
    value, both = log_content(detection), alone.plus(more)
    return _log_density(value, both) - _log_density(value, alone)


def meeting(lost: Alone, other: Alone, evidence: float, *, close: bool) -> float:
    """Log odds that two have met, and not one been lifted, after the ``evidence`` of frames."""
    a, b = lost.state, other.state
    x, y = a.x - b.x, a.y - b.y
    square = x * x + y * y
    near = -0.5 * square / _RESOLUTION**2
    closing = -(x * (a.u - b.u) + y * (a.v - b.v))
    comes = closing > _CLOSING * math.sqrt(square)
    return (_MEETS if comes else _STANDS) + near + evidence + _CLOSE * close


def parting(carrier: Detection, branch: Detection, reach: float) -> float:
    """Log odds that a new detection has come out of a merged touch, and has not begun beside it, as
    their positions say; ``reach`` m, how far from each other its members have been."""
    away = math.hypot(carrier.x - branch.x, carrier.y - branch.y)
    return float(_PARTS - 2 * (away / (2 * _RESOLUTION + 0.5 * reach)) ** 2)


def shrunk(before: TouchStrength, left: TouchStrength, branch: TouchStrength) -> float:
    """What contents say for two touches having been one before, log likelihood ratio."""
    both = left.plus(branch)
    odds = before.log_likelihood(both) - before.log_likelihood(left)
    return min(max(odds, 2 * _LEAST), _MOST)


def crossing(
    one: MergedFinger, other: MergedFinger, apart: tuple[float, float], time: float
) -> float:
    """Log odds that two members have come out the other way round than ``apart`` m, the way from
    the other to the one, at a ``time`` s."""
    if one.alone is None or other.alone is None:
        return 0.0
    x, y = apart
    turned = _way(one.alone, other.alone, (-x, -y), time)
    return turned - _way(one.alone, other.alone, apart, time)


def _way(one: Alone, other: Alone, apart: tuple[float, float], time: float) -> float:
    """Log likelihood of two that went in being so far apart by now."""
    xx = yy = 2 * _OFF**2
    offset_x = offset_y = xy = 0.0
    for alone, sign in ((one, 1.0), (other, -1.0)):
        since, state = max(time - alone.time, 0.0), alone.state
        offset_x += sign * (state.x + since * state.u)
        offset_y += sign * (state.y + since * state.v)
        swerve = _SWERVE * since**3 / 3
        xx += state.xx + 2 * since * state.xu + since**2 * state.uu + swerve
        yy += state.yy + 2 * since * state.yv + since**2 * state.vv + swerve
        xy += state.xy + since * (state.xv + state.yu) + since**2 * state.uv
    x, y = apart
    went_x, went_y = one.state.x - other.state.x, one.state.y - other.state.y
    aside, anywhere = 2 * _ASIDE**2, 2 * _ANYWHERE**2
    return math.log(
        _COURSE * math.exp(_normal(x - offset_x, y - offset_y, xx, xy, yy))
        + _BACK * math.exp(_normal(x - went_x, y - went_y, aside, 0.0, aside))
        + _ANY * math.exp(_normal(x, y, anywhere, 0.0, anywhere))
    )


def reach_of(members: Sequence[MergedFinger]) -> float:
    """The largest distance between members when they were last alone, m."""
    states = [m.alone.state for m in members if m.alone]
    return max((math.hypot(a.x - b.x, a.y - b.y) for a in states for b in states), default=0.0)


def _normal(x: float, y: float, xx: float, xy: float, yy: float) -> float:
    """Log density, 1/m², so far from the middle."""
    area = xx * yy - xy * xy
    return -0.5 * ((yy * x * x - 2 * xy * x * y + xx * y * y) / area + math.log(area))


def _log_density(value: float, strength: TouchStrength) -> float:
    variance = strength.variance + NOISE**2
    return -0.5 * ((value - strength.mean) ** 2 / variance + math.log(variance))


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
