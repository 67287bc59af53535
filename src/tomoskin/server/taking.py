"""When someone presses: the change that a steady press makes, frame by frame, without a picture."""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np

from tomoskin.core import FloatArray

Phase = Literal["rest", "press", "hold", "release"]
"""Hands off; press now; hold still; let go."""

_REST = 10
"""Frames that the untouched skin is told from."""

_LAG = 4
"""The newest frames, which are not taken for untouched: a press may have begun in them."""

_STEADY = 8
"""Frames that a press must stand still for."""

_PRESENT = 2.5
"""Noises by which a frame must differ from the untouched skin to be a press."""

_STILL, _WAVERS = 0.06, 1.5
"""How far a steady press may move from its first half to its second, as a part of itself, and in
noises, where these are larger."""

_RELEASED = 0.4
"""A press is over when this part of it is left."""

_OFTEN = 0.02
"""Frames are taken no more often than this, s: a hand is not faster."""


class Taker:
    """Takes presses from a stream of voltages.

    The untouched skin is what was read just before each press, so that drift and what a press
    leaves behind do not matter.

    Parameters
    ----------
    least
        V that noise is never taken to be below.
    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._rest: deque[FloatArray] = deque(maxlen=_REST + _LAG)
        self._pressed: deque[FloatArray] = deque(maxlen=_STEADY)
        self._mean = self._noise = np.zeros(0)
        self._taken = 0.0
        self._last = -np.inf
        self.phase: Phase = "rest"

    @property
    def untouched(self) -> tuple[FloatArray, FloatArray] | None:
        """(n_meas,) V, mean and noise before the last press; None before the first frames."""
        return (self._mean, self._noise) if len(self._mean) else None

    def push(self, host_time: float, voltages: FloatArray) -> FloatArray | None:
        """Take a frame (n_meas,) V; (n_meas,) V, the change, when a press has stood still."""
        if 0 <= host_time - self._last < _OFTEN:
            return None
        self._last = host_time
        if self.phase == "rest":
            self._wait(voltages)
            return None
        size = self._size(voltages - self._mean)
        if self.phase == "release":
            if size < max(_RELEASED * self._taken, _PRESENT):
                self.phase = "rest"
                self._rest.clear()
            return None
        if size < _PRESENT:
            self.phase = "press"
            self._pressed.clear()
            self._wait(voltages)
            return None
        self.phase = "hold"
        self._pressed.append(voltages)
        return self._steady()

    def _wait(self, voltages: FloatArray) -> None:
        self._rest.append(voltages)
        if len(self._rest) < _REST + _LAG:
            return
        quiet = np.array(self._rest)[:_REST]
        self._mean = quiet.mean(axis=0)
        own = quiet.var(axis=0, ddof=1)  # of few frames: drawn halfway to that of all rows
        self._noise = np.maximum(np.sqrt((own + np.nanmean(own)) / 2), self._least)
        self.phase = "press"

    def _steady(self) -> FloatArray | None:
        if len(self._pressed) < _STEADY:
            return None
        frames = np.array(self._pressed)
        mean = frames.mean(axis=0)
        change = mean - self._mean
        size = self._size(change)
        half = _STEADY // 2
        moved = self._size(frames[half:].mean(axis=0) - frames[:half].mean(axis=0))
        if moved > max(_STILL * size, _WAVERS):
            return None
        self.phase, self._taken = "release", size
        self._pressed.clear()
        return np.asarray(change)

    def _size(self, change: FloatArray) -> float:
        """Root mean square in noises, of the rows that are known."""
        squares = (change / self._noise) ** 2
        known = squares[np.isfinite(squares)]
        return float(np.sqrt(known.mean())) if len(known) else 0.0
