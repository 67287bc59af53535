"""Latency and rate over the last frames, in bounded memory."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray

_WINDOW = 512
"""Frames that latency is told over: some seconds of a real board."""

_RECENT = 1.0
"""Seconds that the rate is told over."""


class Ring:
    """The last so many numbers; written by one thread, read by any."""

    def __init__(self, size: int = _WINDOW) -> None:
        """None yet."""
        self._values = np.zeros(size)
        self.count = 0

    def add(self, value: float) -> None:
        """Note one; the oldest makes room."""
        self._values[self.count % len(self._values)] = value
        self.count += 1

    def values(self) -> FloatArray:
        """Those that are kept, in no order."""
        return self._values[: self.count].copy()

    def percentiles(self) -> tuple[float, float]:
        """(p50, p99); NaN before the first."""
        known = self.values()
        if not len(known):
            return float("nan"), float("nan")
        p50, p99 = np.percentile(known, (50, 99))
        return float(p50), float(p99)


class Meter:
    """When frames came and how long each took, s; written by one thread, read by any."""

    def __init__(self, window: int = _WINDOW) -> None:
        self._arrivals = Ring(window)
        self._latencies = Ring(window)

    def arrived(self, host_time: float) -> None:
        """Note a frame by the host time of its last byte."""
        self._arrivals.add(host_time)

    def took(self, latency: float) -> None:
        """Note the seconds from a frame's last byte to its touches."""
        self._latencies.add(latency)

    @property
    def frames(self) -> int:
        """Frames since the start."""
        return self._arrivals.count

    def latency(self) -> tuple[float, float]:
        """(p50, p99) of the latency, s; NaN before the first frame."""
        return self._latencies.percentiles()

    def rate(self, now: float) -> float:
        """Frames per second over the last second; 0 where fewer than two came."""
        known = self._arrivals.values()
        recent = known[known > now - _RECENT]
        span = float(np.ptp(recent)) if len(recent) else 0.0
        return (len(recent) - 1) / span if span > 0 else 0.0
