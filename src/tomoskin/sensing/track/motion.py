"""How a touch may move, and the settings of a tracker."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from tomoskin.core import Detection


@dataclass(frozen=True, slots=True)
class TrackSettings:
    """Times are seconds of the device, so that 10 and 1,000 frames/s are treated alike.

    Attributes
    ----------
    snr
        Signal-to-noise ratio at which a touch begins; at :data:`HELD` of it, it ends.
    still
        Whether frames do not follow each other in time: each shows what it holds.
    speed, turning
        Standard deviation of a finger's speed along each axis, m/s, and the time after which it
        moves otherwise, s.
    wander
        What the position of a detection wanders beside its noise, m.
    """

    snr: float = 5.0
    still: bool = False
    speed: float = 0.1
    turning: float = 1.0
    wander: float = 0.004


_UNKNOWN = 0.004
"""Deviation of a detection whose noise is unknown, m."""


class TrackState(NamedTuple):
    """Position ``x``, ``y`` m and velocity ``u``, ``v`` m/s of a touch, and their covariances.

    Plain numbers: a handful of touches is quicker without arrays.
    """

    x: float
    y: float
    u: float
    v: float
    xx: float
    xy: float
    yy: float
    xu: float
    xv: float
    yu: float
    yv: float
    uu: float
    uv: float
    vv: float


class TrackObservation(NamedTuple):
    """A position, m, and its covariance, m²."""

    x: float
    y: float
    xx: float
    xy: float
    yy: float


def predict(state: TrackState, seconds: float, settings: TrackSettings) -> TrackState:
    """The state after some seconds without a detection."""
    if not seconds > 0:
        return state
    b, a, there, cross, moving = motion_step(seconds, settings)
    x, y, u, v, xx, xy, yy, xu, xv, yu, yv, uu, uv, vv = state
    bb, aa = b * b, a * a
    return TrackState(
        x + b * u,
        y + b * v,
        a * u,
        a * v,
        xx + 2 * b * xu + bb * uu + there,
        xy + b * (xv + yu) + bb * uv,
        yy + 2 * b * yv + bb * vv + there,
        a * (xu + b * uu) + cross,
        a * (xv + b * uv),
        a * (yu + b * uv),
        a * (yv + b * vv) + cross,
        aa * uu + moving,
        aa * uv,
        aa * vv + moving,
    )


def begin(seen: TrackObservation, settings: TrackSettings) -> TrackState:
    """State of a touch that is seen for the first time."""
    power = settings.speed**2
    x, y, xx, xy, yy = seen
    return TrackState(x, y, 0.0, 0.0, xx, xy, yy, 0.0, 0.0, 0.0, 0.0, power, 0.0, power)


def update(state: TrackState, seen: TrackObservation) -> TrackState:
    """The state after one detection."""
    x, y, u, v, xx, xy, yy, xu, xv, yu, yv, uu, uv, vv = state
    sxx, sxy, syy = xx + seen.xx, xy + seen.xy, yy + seen.yy
    area = sxx * syy - sxy * sxy
    ixx, ixy, iyy = syy / area, -sxy / area, sxx / area
    # of each number, how much it follows the detection along x and along y
    x_x, x_y = xx * ixx + xy * ixy, xx * ixy + xy * iyy
    y_x, y_y = xy * ixx + yy * ixy, xy * ixy + yy * iyy
    u_x, u_y = xu * ixx + yu * ixy, xu * ixy + yu * iyy
    v_x, v_y = xv * ixx + yv * ixy, xv * ixy + yv * iyy
    dx, dy = seen.x - x, seen.y - y
    return TrackState(
        x + x_x * dx + x_y * dy,
        y + y_x * dx + y_y * dy,
        u + u_x * dx + u_y * dy,
        v + v_x * dx + v_y * dy,
        xx - x_x * xx - x_y * xy,
        xy - x_x * xy - x_y * yy,
        yy - y_x * xy - y_y * yy,
        xu - x_x * xu - x_y * yu,
        xv - x_x * xv - x_y * yv,
        yu - y_x * xu - y_y * yu,
        yv - y_x * xv - y_y * yv,
        uu - u_x * xu - u_y * yu,
        uv - u_x * xv - u_y * yv,
        vv - v_x * xv - v_y * yv,
    )


def distance(state: TrackState, seen: TrackObservation) -> tuple[float, float]:
    """Squared Mahalanobis distance of a detection from a state, and the determinant of the
    covariance of both, m⁴."""
    xx, xy, yy = state.xx + seen.xx, state.xy + seen.xy, state.yy + seen.yy
    dx, dy = seen.x - state.x, seen.y - state.y
    area = xx * yy - xy * xy
    return (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / area, area


def observe(detection: Detection, settings: TrackSettings) -> TrackObservation:
    """Position of a detection and its covariance, wandering included."""
    more, unknown = settings.wander**2, _UNKNOWN**2
    xx, yy, xy = detection.sd_x**2, detection.sd_y**2, detection.cov_xy
    if not (math.isfinite(xx + yy + xy) and xx * yy > xy * xy):
        xx, yy, xy = unknown, unknown, 0.0
    return TrackObservation(detection.x, detection.y, xx + more, xy, yy + more)


@lru_cache(maxsize=8)
def motion_step(
    seconds: float, settings: TrackSettings
) -> tuple[float, float, float, float, float]:
    """Over some ``seconds``: how far a speed leads, and what is left of it; variance of the
    position along each axis, its covariance with the speed, and the speed's variance."""
    tau, power = settings.turning, settings.speed**2
    u = seconds / tau
    a = math.exp(-u)
    there = power * tau**2 * (2 * u - 3 + 4 * a - a * a)
    cross, moving = power * tau * (1 - a) ** 2, power * (1 - a * a)
    return tau * (1 - a), a, there, cross, moving


def region_radius(detection: Detection) -> float:
    """Radius of the disc of the detection's area, m; 0 where it has none."""
    return math.sqrt(detection.area / math.pi) if detection.area > 0 else 0.0
