"""Readings of successive frames → touches that keep their identity."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from tomoskin.core import Reading, Touch


@dataclass
class Tracker:
    """Joins each reading to the nearest living touch of the same sign.

    Attributes
    ----------
    reach
        A touch moves at most this far between frames, m.
    patience
        Frames for which a touch may be missing before it is released.
    debounce
        Frames for which a region must stand before it is reported.
    """

    reach: float = 0.03
    patience: int = 3
    debounce: int = 2
    _living: list[_Trace] = field(default_factory=list)
    _next_id: int = 1

    def update(self, readings: list[Reading], host_time: float) -> tuple[Touch, ...]:
        """Touches of this frame, in order of their identity."""
        pairs = self._assign(readings)
        for trace in self._living:
            trace.missed += 1
        for index, reading in enumerate(readings):
            if index in pairs:
                self._living[pairs[index]].see(reading)
            else:
                self._living.append(_Trace(_touch(0, reading, host_time)))
        self._living = [t for t in self._living if t.missed <= self._patience(t)]
        for trace in self._living:
            if not trace.touch.id and trace.seen >= self.debounce:
                trace.touch = replace(trace.touch, id=self._next_id)
                self._next_id += 1
        shown = [t.touch for t in self._living if t.touch.id]
        return tuple(sorted(shown, key=lambda touch: touch.id))

    def reset(self) -> None:
        """Release every touch; identities go on counting."""
        self._living = []

    def _patience(self, trace: _Trace) -> int:
        return self.patience if trace.touch.id else 0

    def _assign(self, readings: list[Reading]) -> dict[int, int]:
        """Pairs reading → living trace with the least sum of distances (Kuhn 1955)."""
        if not readings or not self._living:
            return {}
        cost = np.array([[_distance(r, t.touch.reading) for t in self._living] for r in readings])
        rows, cols = linear_sum_assignment(np.minimum(cost, 2 * self.reach))
        return {int(r): int(c) for r, c in zip(rows, cols, strict=True) if cost[r, c] <= self.reach}


@dataclass
class _Trace:
    touch: Touch
    seen: int = 1
    missed: int = 0

    def see(self, reading: Reading) -> None:
        self.touch = replace(self.touch, reading=reading)
        self.seen += 1
        self.missed = 0


def _touch(number: int, reading: Reading, host_time: float) -> Touch:
    kind = "decrease" if reading.peak < 0 else "increase"
    return Touch(number, kind, host_time, reading)


def _distance(a: Reading, b: Reading) -> float:
    if (a.peak < 0) != (b.peak < 0):
        return 1e9
    return math.hypot(a.x - b.x, a.y - b.y)
