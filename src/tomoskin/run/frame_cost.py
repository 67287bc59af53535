"""What the pipeline spent a frame's time on, and the frames that took longest."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tomoskin.core import Frame, watch_stages

_KEPT = 50
"""Frames of which the cost is kept: the slowest."""

_WINDOW = 20_000
"""Newest frames that these are of."""

_OFTEN = 100
"""Frames after which what is older than the window is forgotten."""

_BEGIN = "voltages"
_SHOWN = 4
"""Stages that a text names, those that took longest first."""


@dataclass(frozen=True, slots=True)
class FrameCost:
    """What one frame's work was.

    Attributes
    ----------
    number, sequence, host_time
        Of the frame: counted by the host and by the board, and when it was read, s.
    stages
        Of each stage its name, µs, and how often it began, in the order of the first time.
    """

    number: int
    sequence: int
    host_time: float
    stages: tuple[tuple[str, float, int], ...]

    @property
    def seconds(self) -> float:
        """The seconds that all stages took together."""
        return 1e-6 * sum(spent for _, spent, _ in self.stages)

    @property
    def text(self) -> str:
        """What took longest, in words: "3.1 ms: touches 1.9 (2 times), one touch more 0.7"."""
        longest = sorted(self.stages, key=lambda stage: -stage[1])[:_SHOWN]
        parts = [
            f"{name} {spent / 1e3:.2f}" + (f" ({times} times)" if times > 1 else "")
            for name, spent, times in longest
        ]
        return f"{1e3 * self.seconds:.2f} ms: {', '.join(parts)}"


class CostMeter:
    """Times the stages that a frame's work says it has reached (:func:`tomoskin.core.reach`).

    Written by one thread, read by any.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        """Begin to measure with ``clock``, which gives seconds."""
        self._clock, self._count = clock, 0
        self._stage, self._since = _BEGIN, 0.0
        self._spent: dict[str, list[float]] = {}
        self._kept: list[tuple[float, int, FrameCost]] = []  # a heap by s and number, negative

    @property
    def slowest(self) -> tuple[FrameCost, ...]:
        """The slowest of the newest frames, the slowest first."""
        return tuple(cost for _, _, cost in sorted(self._kept, reverse=True))

    @contextmanager
    def of(self, frame: Frame) -> Iterator[None]:
        """Time what the block does with ``frame``."""
        begun = self._clock()
        self._spent, self._stage, self._since = {}, _BEGIN, begun
        try:
            with watch_stages(self._reach):
                yield
        finally:
            self._reach("")
            self._keep(frame, self._since - begun)

    def _reach(self, stage: str) -> None:
        now = self._clock()
        spent = self._spent.setdefault(self._stage, [0.0, 0])
        spent[0] += now - self._since
        spent[1] += stage != self._stage
        self._stage, self._since = stage or self._stage, now

    def _keep(self, frame: Frame, seconds: float) -> None:
        number, self._count = self._count, self._count + 1
        if number % _OFTEN == 0:
            first = number - _WINDOW
            self._kept = [one for one in self._kept if -one[1] > first]
            heapq.heapify(self._kept)
        if len(self._kept) >= _KEPT and seconds <= self._kept[0][0]:
            return
        stages = [(name, 1e6 * spent, int(times)) for name, (spent, times) in self._spent.items()]
        cost = FrameCost(number, frame.sequence, frame.host_time, tuple(stages))
        if len(self._kept) < _KEPT:
            heapq.heappush(self._kept, (seconds, -number, cost))
        else:
            heapq.heapreplace(self._kept, (seconds, -number, cost))
