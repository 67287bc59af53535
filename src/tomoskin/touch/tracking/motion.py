"""How a touch may move, and the settings of a tracker."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tomoskin.core import Detection, FloatArray

HELD = 0.6
"""Part of the signal-to-noise ratio of an onset above which a touch goes on: between the two it
neither begins nor ends."""


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

    @property
    def least_snr(self) -> float:
        """Below which there is no detection."""
        return HELD * self.snr


STILL = TrackSettings(still=True)
"""For frames that do not follow each other in time: each shows what it holds."""


GATE = 16.0
"""Squared Mahalanobis distance beyond which a detection is of another touch: one in 3,000."""

_UNKNOWN = 0.004
"""Deviation of a detection whose noise is unknown, m."""


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """``mean`` (n, 4) m and m/s, ``covariance`` (n, 4, 4)."""

    mean: FloatArray
    covariance: FloatArray


def predict(states: States, seconds: float, settings: TrackSettings) -> States:
    """States after some seconds without a detection."""
    if not seconds > 0:
        return states
    step, noise = _step(seconds, settings)
    return States(states.mean @ step.T, step @ states.covariance @ step.T + noise)


def begin(detection: FloatArray, spread: FloatArray, settings: TrackSettings) -> States:
    """State of a touch that is seen for the first time: ``detection`` (2,), ``spread`` (2, 2)."""
    covariance = np.zeros((1, 4, 4))
    covariance[0, :2, :2] = spread
    covariance[0, (2, 3), (2, 3)] = settings.speed**2
    return States(np.concatenate([detection, [0.0, 0.0]])[None], covariance)


def update(states: States, positions: FloatArray, spreads: FloatArray) -> States:
    """States after one detection each: ``positions`` (n, 2) with covariances (n, 2, 2)."""
    cross = states.covariance[:, :, :2]
    gain = cross @ _inverse(cross[:, :2] + spreads)
    away = (positions - states.mean[:, :2])[:, :, None]
    mean = states.mean + (gain @ away)[:, :, 0]
    covariance = states.covariance - gain @ cross.transpose(0, 2, 1)
    return States(mean, 0.5 * (covariance + covariance.transpose(0, 2, 1)))


def distances(states: States, positions: FloatArray, spreads: FloatArray) -> FloatArray:
    """(n, m) squared Mahalanobis distances of m detections from n states."""
    away = positions - states.mean[:, None, :2]
    both = states.covariance[:, None, :2, :2] + spreads
    xx, xy, yy = both[..., 0, 0], both[..., 0, 1], both[..., 1, 1]
    dx, dy = away[..., 0], away[..., 1]
    return np.asarray((yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy))


def observe(
    detections: Sequence[Detection], settings: TrackSettings
) -> tuple[FloatArray, FloatArray]:
    """Positions (m, 2) of detections and their covariances (m, 2, 2), wandering included."""
    positions = np.array([(r.x, r.y) for r in detections]).reshape(-1, 2)
    spreads = np.array([_spread(r, settings) for r in detections]).reshape(-1, 2, 2)
    return positions, spreads


def _spread(detection: Detection, settings: TrackSettings) -> tuple[float, float, float, float]:
    more, unknown = settings.wander**2, _UNKNOWN**2
    xx, yy, xy = detection.sd_x**2, detection.sd_y**2, detection.cov_xy
    if not (math.isfinite(xx + yy + xy) and xx * yy > xy * xy):
        xx, yy, xy = unknown, unknown, 0.0
    return xx + more, xy, xy, yy + more


def _inverse(pairs: FloatArray) -> FloatArray:
    """Of symmetric (n, 2, 2): ten times as fast as a library's for a handful of them."""
    xx, xy, yy = pairs[:, 0, 0], pairs[:, 0, 1], pairs[:, 1, 1]
    turned = np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy)
    return np.asarray(turned.transpose(2, 0, 1))


@lru_cache(maxsize=8)
def _step(seconds: float, settings: TrackSettings) -> tuple[FloatArray, FloatArray]:
    """Transition and noise (4, 4) each over some ``seconds``."""
    tau, power = settings.turning, settings.speed**2
    u = seconds / tau
    a = math.exp(-u)
    there = power * tau**2 * (2 * u - 3 + 4 * a - a * a)
    cross, moving = power * tau * (1 - a) ** 2, power * (1 - a * a)
    step, noise = np.zeros((4, 4)), np.zeros((4, 4))
    for axis in (0, 1):
        step[axis, axis], step[axis, axis + 2], step[axis + 2, axis + 2] = 1.0, tau * (1 - a), a
        noise[axis, axis], noise[axis + 2, axis + 2] = there, moving
        noise[axis, axis + 2] = noise[axis + 2, axis] = cross
    return step, noise


def region_radius(detection: Detection) -> float:
    """Radius of the disc of the detection's area, m; 0 where it has none."""
    return math.sqrt(detection.area / math.pi) if detection.area > 0 else 0.0
