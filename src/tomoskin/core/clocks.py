"""Clocks, of the computer or virtual, and how far one is ahead of another."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Protocol

_READS = 16


class Clock(Protocol):
    """Where a source takes its time from."""

    def now(self) -> float:
        """The seconds of a clock that never goes back."""

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Wait for ``condition`` (held) at most that long."""


class WallClock:
    """The clock of the computer, in real time."""

    def now(self) -> float:
        """The monotonic seconds of the computer."""
        return time.monotonic()

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Wait for ``condition`` (held) at most that long."""
        condition.wait(seconds)


class VirtualClock:
    """Time that passes only by being waited for, from 0 s: faster than real, the same each time."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        """The virtual seconds since the start."""
        return self.time

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Let the time pass at once; nothing else can happen meanwhile."""
        del condition
        self.time += seconds


def clock_ahead(clock: Callable[[], float], own: Callable[[], float] = time.monotonic) -> float:
    """By how many s ``clock`` is ahead of ``own``.

    A busy machine may stop a process between two reads. So both clocks are read several times, and
    the reads with the least time between them count.
    """

    def read() -> tuple[float, float]:
        before, there, after = own(), clock(), own()
        return after - before, there - (before + after) / 2

    return min(read() for _ in range(_READS))[1]
