"""The common mode of an untouched skin: all voltages in proportion, as a gain moves them."""

from __future__ import annotations

import math

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.signal.health import Mask
from tomoskin.sensing.signal.idle import Idle

_CUT = 4.0
"""Deviations beyond which a frame's common mode has jumped, and is not followed at once."""

_STANDS = 8
"""Frames for which a jump must stand to be taken for the new level."""

_SLOWEST = 5.0
"""Time constant with which it is followed where no drift has been seen, s."""

_WALKS, _WORTH = 3e-4, 2
"""Part of itself by which the level walks in the root of a second under a touch, before touches
have told; and so many touches that this is worth."""

_NOBODY = np.zeros(1, bool)


class CommonMode:
    """A scalar Kalman filter of a random walk (Kalman 1960) that also takes jumps which stand.

    Parameters
    ----------
    mean
        (n_meas,) V of the untouched skin: its direction.
    noise
        (n_meas,) V, of one of ``frames`` frames.
    """

    def __init__(self, mean: FloatArray, noise: FloatArray, frames: int) -> None:
        deviation = 1 / float(np.linalg.norm(mean / noise))
        self._idle = Idle(np.array([deviation]), frames, _SLOWEST)
        self._level, self._variance = 1.0, deviation**2 / frames
        self._held, self._walks = 0.0, [_WORTH * _WALKS**2, float(_WORTH)]
        self._apart: list[float] = []
        self._mean = mean
        self._weights: tuple[FloatArray, Mask | None, FloatArray] = noise, None, mean

    def of(self, change: FloatArray, noise: FloatArray, lost: Mask) -> float:
        """Part of the mean that a ``change`` (n_meas,) V has, least squares in ``noise`` (n_meas,)
        V without the ``lost`` rows."""
        known, mask, weights = self._weights
        if known is not noise or mask is not lost:
            weights = np.where(lost, 0.0, self._mean / noise**2)
            weights = weights / max(float(weights @ self._mean), 1e-300)
            self._weights = noise, lost, weights
        return float(weights @ change) / self._level

    def push(self, part: float, time: float, step: float) -> float:
        """By what part the level has moved, after a further idle frame at ``time`` s, ``step`` s
        after the one before, that is apart from it by such a ``part``."""
        self._idle.push(np.array([self._level * (1 + part)]), time, _NOBODY)
        noise = float(self._idle.noise[0]) ** 2
        self._variance += float(self._idle.drift[0]) * step
        if self._held:
            self._walked(part**2 - self._variance - noise)
        total = self._variance + noise
        if part**2 > _CUT**2 * total:
            return self._moved(self._jumped(part, noise))
        self._apart.clear()
        gain = self._variance / total
        self._variance *= 1 - gain
        return self._moved(gain * part)

    @property
    def deviation(self) -> float:
        """What the level may have walked by since it was followed, as a part of it."""
        return math.sqrt(self._variance + self._walk * self._held)

    @property
    def _walk(self) -> float:
        """1/s, variance of the level under a touch."""
        total, count = self._walks
        return total / count

    def _walked(self, square: float) -> None:
        """Take by how much beyond the noise, squared, the level is elsewhere after a touch."""
        total, count = self._walks
        self._walks = [total + max(square, 0.0) / self._held, count + 1]
        self._variance += self._walk * self._held
        self._held = 0.0

    def interrupt(self, step: float) -> None:
        """Something touches, for a further ``step`` s."""
        self._held += step
        self._apart.clear()
        self._idle.interrupt()

    def _jumped(self, part: float, noise: float) -> float:
        """To where the last frames are, once they agree."""
        self._apart.append(part)
        if len(self._apart) < _STANDS:
            return 0.0
        middle = float(np.median(self._apart))
        if max(abs(value - middle) for value in self._apart) ** 2 > _CUT**2 * noise:
            del self._apart[0]
            return 0.0
        self._apart.clear()
        self._variance = noise / _STANDS
        return middle

    def _moved(self, part: float) -> float:
        self._level *= 1 + part
        return part
