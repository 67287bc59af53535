"""How fast frames came, and where the age of a picture comes from.

How long each stage takes, from the sample to the page:

========================  ====================================================================
sample                    between the scans of two frames that follow each other, by the device
decode                    from a frame's last byte to the pipeline, waiting for others included
reconstruct               the pipeline: voltages, picture, touches
publish                   from the touches to the last byte given to a page's connection
paint                     from its arrival at a page to the end of drawing it, as pages say
========================  ====================================================================

The way through the network lies between the last two and is not known; on the loopback it is
far less than a millisecond.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tomoskin.core import Frame

_WINDOW = 512
"""Frames whose times are kept: some seconds of a real board."""

_RECENT = 1.0
"""Seconds over which the rate is counted."""

Timed = Literal["sample", "decode", "reconstruct", "publish"]
_TIMED: tuple[Timed, ...] = ("sample", "decode", "reconstruct", "publish")


@dataclass(frozen=True, slots=True)
class StageLatency:
    """How long one stage took of late, s: median and 99th percentile; NaN: not known."""

    name: str
    p50: float
    p99: float


class Latency:
    """Times of the last frames, in bounded memory; each is written by one thread, read by any.

    ``frames``: their number since the start.
    """

    def __init__(self, window: int = _WINDOW) -> None:
        """Make counters without any times."""
        self._times = {name: deque[float](maxlen=window) for name in _TIMED}
        self._arrivals, self._ages = deque[float](maxlen=window), deque[float](maxlen=window)
        self._painted: dict[object, tuple[float, float]] = {}
        self._last: Frame | None = None
        self.frames = 0

    def add_frame(self, frame: Frame, read: float, tick_rate: float) -> None:
        """Note a frame whose last byte was read at ``read``, s; ``tick_rate`` in Hz."""
        self.frames += 1
        self._arrivals.append(read)
        last, self._last = self._last, frame
        if last is not None and frame.sequence == last.sequence + 1 and frame.ticks > last.ticks:
            self._times["sample"].append((frame.ticks - last.ticks) / tick_rate)

    def add_result(self, decode: float, reconstruct: float) -> None:
        """Note how long a frame took from its last byte to the pipeline, and from there to its
        touches, s."""
        self._times["decode"].append(decode)
        self._times["reconstruct"].append(reconstruct)
        self._ages.append(decode + reconstruct)

    def add_published(self, seconds: float) -> None:
        """Note how long it took from a frame's touches to a page's connection."""
        self._times["publish"].append(seconds)

    def set_paint(self, page: object, p50: float, p99: float) -> None:
        """What a page says of its own drawing, s."""
        self._painted[page] = p50, p99

    def forget(self, page: object) -> None:
        """Forget a page that has stopped drawing."""
        self._painted.pop(page, None)

    def age(self) -> tuple[float, float]:
        """(p50, p99) from a frame's last byte to its touches, s; NaN before the first."""
        return _percentiles(self._ages)

    def rate(self, now: float) -> float:
        """Frames per second over the last second; 0 where fewer than two came."""
        recent = [time for time in self._arrivals.copy() if time > now - _RECENT]
        span = max(recent) - min(recent) if recent else 0.0
        return (len(recent) - 1) / span if span > 0 else 0.0

    def stages(self) -> tuple[StageLatency, ...]:
        """All stages, in the order of the flow; of the pages the one that is slowest."""
        slowest = max(
            self._painted.copy().values(), key=lambda p: p[1], default=(float("nan"),) * 2
        )
        timed = [StageLatency(name, *_percentiles(self._times[name])) for name in _TIMED]
        return *timed, StageLatency("paint", *slowest)


def _percentiles(times: deque[float]) -> tuple[float, float]:
    """(p50, p99); NaN before the first. ``times`` may grow meanwhile, in another thread."""
    values = list(times.copy())
    if not values:
        return float("nan"), float("nan")
    p50, p99 = np.percentile(values, (50, 99))
    return float(p50), float(p99)
