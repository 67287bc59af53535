"""The device's clock against the host's, from the frames themselves, in memory of fixed size."""

from __future__ import annotations

import math
from dataclasses import dataclass

_FEWEST = 20
"""Fewer frames say more of the line's jitter than of the clock."""


@dataclass(frozen=True, slots=True)
class ClockFit:
    """ticks = tick_rate · (host time − offset), by least squares over ``frames`` frames.

    ``tick_rate`` Hz by the host's clock; ``offset`` host time of tick 0, s; ``residual`` root mean
    square of what a host time differs from it, s.
    """

    tick_rate: float
    offset: float
    residual: float
    frames: int


class ClockFitter:
    """Takes ticks and host times of frames one by one; begins anew when the device does."""

    def __init__(self) -> None:
        self._n = self._first = self._last = 0
        self._first_time = 0.0
        self._x = self._y = self._xx = self._xy = self._yy = 0.0

    def add(self, ticks: int, host_time: float) -> None:
        """Take one frame."""
        if not self._n or ticks < self._last:
            self._begin(ticks, host_time)
        self._last = ticks
        x, y = host_time - self._first_time, float(ticks - self._first)
        self._n += 1
        self._x, self._y = self._x + x, self._y + y
        self._xx, self._xy, self._yy = self._xx + x * x, self._xy + x * y, self._yy + y * y

    @property
    def fit(self) -> ClockFit | None:
        """The fit so far; None before there are enough frames."""
        n = self._n
        if n < _FEWEST:
            return None
        sxx = self._xx - self._x**2 / n
        sxy = self._xy - self._x * self._y / n
        syy = self._yy - self._y**2 / n
        if not (sxx > 0 and sxy > 0):
            return None
        rate = sxy / sxx
        late = (self._x - self._y / rate) / n
        residual = math.sqrt(max(syy - rate * sxy, 0.0) / n) / rate
        return ClockFit(rate, self._first_time + late - self._first / rate, residual, n)

    def _begin(self, ticks: int, host_time: float) -> None:
        self._first, self._first_time, self._last = ticks, host_time, ticks
        self._n = 0
        self._x = self._y = self._xx = self._xy = self._yy = 0.0
