"""Touches that come too close to separate, and come apart again: what speaks for either."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tomoskin.core import Detection, FloatArray
from tomoskin.touch.tracking.motion import States
from tomoskin.touch.tracking.strength import NOISE, TouchStrength, log_content

# Chosen on the moving plant, seeds 1 to 3 (docs/touch.md).

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


@dataclass(frozen=True, slots=True, eq=False)
class Alone:
    """A touch as it was when last seen by itself, at the device's ``time`` s: one row of states."""

    states: States
    strength: TouchStrength
    time: float


@dataclass(eq=False, slots=True)
class MergedFinger:
    """One finger, as far as frames told it from others: its number, and how it was ``alone``."""

    key: int
    alone: Alone | None = None


def met(lost: Alone, other: Alone, detection: Detection) -> float:
    """What a ``detection`` of the ``other`` says for its being both, log likelihood ratio."""
    share = 1 / (1 + math.exp(lost.strength.mean - other.strength.mean))
    one, two = other.states, lost.states
    middle = share * one.mean[0, :2] + (1 - share) * two.mean[0, :2]
    spread = share**2 * one.covariance[0] + (1 - share) ** 2 * two.covariance[0]
    position = np.array([detection.x, detection.y])
    noise = np.array([[detection.sd_x**2, detection.cov_xy], [detection.cov_xy, detection.sd_y**2]])
    noise = np.where(np.isfinite(noise), noise, 0.0) + _OFF**2 * np.eye(2)
    there = _normal(position - middle, spread[:2, :2] + noise)
    alone = _normal(position - one.mean[0, :2], one.covariance[0, :2, :2] + noise)
    content = grown(detection, other.strength, lost.strength)
    return min(max(there - alone + content, _LEAST), _MOST)


def grown(detection: Detection, alone: TouchStrength, more: TouchStrength) -> float:
    """What a content says for being that of two touches, log likelihood ratio against the one."""
    value, both = log_content(detection), alone.plus(more)
    return _log_density(value, both) - _log_density(value, alone)


def meeting(lost: Alone, other: Alone, evidence: float, *, close: bool) -> float:
    """Log odds that two have met, and not one been lifted, after the ``evidence`` of frames."""
    away = lost.states.mean[0, :2] - other.states.mean[0, :2]
    near = -0.5 * float(away @ away) / _RESOLUTION**2
    closing = -float(away @ (lost.states.mean[0, 2:] - other.states.mean[0, 2:]))
    comes = closing > _CLOSING * math.sqrt(float(away @ away))
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


def crossing(one: MergedFinger, other: MergedFinger, apart: FloatArray, time: float) -> float:
    """Log odds that two members have come out the other way round than ``apart`` (2,) m, the way
    from the other to the one, at a ``time`` s."""
    if one.alone is None or other.alone is None:
        return 0.0
    return _way(one.alone, other.alone, -apart, time) - _way(one.alone, other.alone, apart, time)


def _way(one: Alone, other: Alone, apart: FloatArray, time: float) -> float:
    """Log likelihood of two that went in being so far apart by now."""
    offset = np.zeros(4)
    spread = np.zeros((4, 4))
    for alone, sign in ((one, 1.0), (other, -1.0)):
        since = max(time - alone.time, 0.0)
        step = np.eye(4)
        step[[0, 1], [2, 3]] = since
        offset += sign * step @ alone.states.mean[0]
        spread += step @ alone.states.covariance[0] @ step.T
        spread[[0, 1], [0, 1]] += _SWERVE * since**3 / 3
    went_in = one.states.mean[0, :2] - other.states.mean[0, :2]
    ways = (
        (_COURSE, apart - offset[:2], spread[:2, :2] + 2 * _OFF**2 * np.eye(2)),
        (_BACK, apart - went_in, 2 * _ASIDE**2 * np.eye(2)),
        (_ANY, apart, 2 * _ANYWHERE**2 * np.eye(2)),
    )
    return math.log(sum(part * math.exp(_normal(away, wide)) for part, away, wide in ways))


def reach_of(members: Sequence[MergedFinger]) -> float:
    """The largest distance between members when they were last alone, m."""
    places = np.array([m.alone.states.mean[0, :2] for m in members if m.alone]).reshape(-1, 2)
    return float(np.linalg.norm(places[:, None] - places, axis=2).max(initial=0.0))


def _normal(away: FloatArray, spread: FloatArray) -> float:
    """Log density, 1/m²."""
    (xx, xy), (_, yy) = spread.tolist()
    x, y = away.tolist()
    area = xx * yy - xy * xy
    return float(-0.5 * ((yy * x * x - 2 * xy * x * y + xx * y * y) / area + math.log(area)))


def _log_density(value: float, strength: TouchStrength) -> float:
    variance = strength.variance + NOISE**2
    return -0.5 * ((value - strength.mean) ** 2 / variance + math.log(variance))
