"""Where the age of a picture comes from: how long each stage takes, from the sample to the page.

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
from typing import Literal

from tomoskin.core import Frame
from tomoskin.run.counters import Ring

Timed = Literal["sample", "decode", "reconstruct", "publish"]


@dataclass(frozen=True, slots=True)
class Stage:
    """How long one stage took of late, s: median and 99th percentile; NaN: not known."""

    name: str
    p50: float
    p99: float


class Latency:
    """Durations of each stage over the last frames; each is written by one thread."""

    def __init__(self) -> None:
        """Nothing has been timed."""
        self._rings: dict[Timed, Ring] = {
            name: Ring() for name in ("sample", "decode", "reconstruct", "publish")
        }
        self._painted: dict[object, tuple[float, float]] = {}
        self._last: Frame | None = None

    def add(self, stage: Timed, seconds: float) -> None:
        """Note how long a stage took."""
        self._rings[stage].add(seconds)

    def add_frame(self, frame: Frame, tick_rate: float) -> None:
        """Note a frame's scan; ``tick_rate`` in Hz."""
        last, self._last = self._last, frame
        if last is not None and frame.sequence == last.sequence + 1 and frame.ticks > last.ticks:
            self.add("sample", (frame.ticks - last.ticks) / tick_rate)

    def set_paint(self, page: object, p50: float, p99: float) -> None:
        """What a page says of its own drawing, s."""
        self._painted[page] = p50, p99

    def forget(self, page: object) -> None:
        """A page draws no longer."""
        self._painted.pop(page, None)

    def stages(self) -> tuple[Stage, ...]:
        """All stages, in the order of the flow; of the pages the one that is slowest."""
        slowest = max(
            self._painted.copy().values(), key=lambda p: p[1], default=(float("nan"),) * 2
        )
        timed = (Stage(name, *ring.percentiles()) for name, ring in self._rings.items())
        return *timed, Stage("paint", *slowest)
