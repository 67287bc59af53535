"""What the pipeline spent a frame's time on, and the frames that took longest."""

from __future__ import annotations

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
        """All stages together."""
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
        """``clock`` in s."""
        self._clock, self._count = clock, 0
        self._stage, self._since = _BEGIN, 0.0
        self._spent: dict[str, list[float]] = {}
        self._slowest: tuple[FrameCost, ...] = ()

    @property
    def slowest(self) -> tuple[FrameCost, ...]:
        """The slowest of the newest frames, the slowest first."""
        return self._slowest

    @contextmanager
    def of(self, frame: Frame) -> Iterator[None]:
        """Time what the block does with ``frame``."""
        self._spent, self._stage, self._since = {}, _BEGIN, self._clock()
        try:
            with watch_stages(self._reach):
                yield
        finally:
            self._reach("")
            self._keep(frame)

    def _reach(self, stage: str) -> None:
        now = self._clock()
        spent = self._spent.setdefault(self._stage, [0.0, 0])
        spent[0] += now - self._since
        spent[1] += stage != self._stage
        self._stage, self._since = stage or self._stage, now

    def _keep(self, frame: Frame) -> None:
        self._count += 1
        stages = tuple((name, 1e6 * t, int(n)) for name, (t, n) in self._spent.items())
        cost = FrameCost(self._count - 1, frame.sequence, frame.host_time, stages)
        if cost.number % _OFTEN == 0:
            first = cost.number - _WINDOW
            self._slowest = tuple(one for one in self._slowest if one.number > first)
        kept = self._slowest
        if len(kept) < _KEPT or cost.seconds > kept[-1].seconds:
            self._slowest = tuple(sorted([*kept, cost], key=lambda c: -c.seconds)[:_KEPT])
