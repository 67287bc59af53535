"""What was lost on the way, and how fast frames came, in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.source import Link

_WINDOW = 512
"""Frames whose latency is kept: some seconds of a real board."""

_RECENT = 1.0
"""Seconds over which the rate is counted."""


@dataclass(frozen=True, slots=True)
class Losses:
    """Counts of what did not arrive.

    ``dropped`` frames that the device or this host left out, ``corrupt`` messages damaged on
    the line, ``gaps`` frames missing in the sequence.
    """

    dropped: int = 0
    corrupt: int = 0
    gaps: int = 0

    @classmethod
    def of(cls, link: Link, device_drops: int) -> Self:
        """Counts of one link; ``device_drops`` is what its last frame said."""
        frames = link.frames
        return cls(device_drops + frames.foreign, link.counters.corrupt, frames.lost)

    def __add__(self, other: Losses) -> Losses:
        """Both together."""
        return Losses(
            self.dropped + other.dropped,
            self.corrupt + other.corrupt,
            self.gaps + other.gaps,
        )


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
        values = self.values()
        if not len(values):
            return float("nan"), float("nan")
        p50, p99 = np.percentile(values, (50, 99))
        return float(p50), float(p99)


class FrameCounter:
    """When frames came and how long each took, s; written by one thread, read by any."""

    def __init__(self, window: int = _WINDOW) -> None:
        self._arrivals = Ring(window)
        self._latencies = Ring(window)

    def add_arrival(self, host_time: float) -> None:
        """Note a frame by the host time of its last byte."""
        self._arrivals.add(host_time)

    def add_latency(self, latency: float) -> None:
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
        arrivals = self._arrivals.values()
        recent = arrivals[arrivals > now - _RECENT]
        span = float(np.ptp(recent)) if len(recent) else 0.0
        return (len(recent) - 1) / span if span > 0 else 0.0
