"""What was lost on the way, how fast frames came, and where the age of a picture comes from.

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

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from tomoskin.board.source import Link
from tomoskin.core import FloatArray, Frame

_WINDOW = 512
"""Frames whose times are kept: some seconds of a real board."""

_RECENT = 1.0
"""Seconds over which the rate is counted."""

Timed = Literal["sample", "decode", "reconstruct", "publish"]


@dataclass(frozen=True, slots=True)
class StageLatency:
    """How long one stage took of late, s: median and 99th percentile; NaN: not known."""

    name: str
    p50: float
    p99: float


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
        """The sum of both losses."""
        return Losses(
            self.dropped + other.dropped,
            self.corrupt + other.corrupt,
            self.gaps + other.gaps,
        )


class Ring:
    """The last so many numbers; written by one thread, read by any."""

    def __init__(self, size: int = _WINDOW) -> None:
        """Make an empty ring."""
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


class Latency:
    """Times of the last frames, in bounded memory; each is written by one thread, read by any."""

    def __init__(self, window: int = _WINDOW) -> None:
        """Make counters without any times."""
        self._rings: dict[Timed, Ring] = {
            name: Ring(window) for name in ("sample", "decode", "reconstruct", "publish")
        }
        self._arrivals, self._ages = Ring(window), Ring(window)
        self._painted: dict[object, tuple[float, float]] = {}
        self._last: Frame | None = None

    @property
    def frames(self) -> int:
        """Number of frames since the start."""
        return self._arrivals.count

    def add_frame(self, frame: Frame, read: float, tick_rate: float) -> None:
        """Note a frame whose last byte was read at ``read``, s; ``tick_rate`` in Hz."""
        self._arrivals.add(read)
        last, self._last = self._last, frame
        if last is not None and frame.sequence == last.sequence + 1 and frame.ticks > last.ticks:
            self.add("sample", (frame.ticks - last.ticks) / tick_rate)

    def add(self, stage: Timed, seconds: float) -> None:
        """Note how long a stage took."""
        self._rings[stage].add(seconds)

    def add_age(self, seconds: float) -> None:
        """Note the time from a frame's last byte to its touches."""
        self._ages.add(seconds)

    def set_paint(self, page: object, p50: float, p99: float) -> None:
        """What a page says of its own drawing, s."""
        self._painted[page] = p50, p99

    def forget(self, page: object) -> None:
        """Forget a page that has stopped drawing."""
        self._painted.pop(page, None)

    def age(self) -> tuple[float, float]:
        """(p50, p99) from a frame's last byte to its touches, s; NaN before the first."""
        return self._ages.percentiles()

    def rate(self, now: float) -> float:
        """Frames per second over the last second; 0 where fewer than two came."""
        arrivals = self._arrivals.values()
        recent = arrivals[arrivals > now - _RECENT]
        span = float(np.ptp(recent)) if len(recent) else 0.0
        return (len(recent) - 1) / span if span > 0 else 0.0

    def stages(self) -> tuple[StageLatency, ...]:
        """All stages, in the order of the flow; of the pages the one that is slowest."""
        slowest = max(
            self._painted.copy().values(), key=lambda p: p[1], default=(float("nan"),) * 2
        )
        timed = (StageLatency(name, *ring.percentiles()) for name, ring in self._rings.items())
        return *timed, StageLatency("paint", *slowest)
