"""How far one clock is ahead of another."""

from __future__ import annotations

import time
from collections.abc import Callable

_READS = 16


def clock_ahead(clock: Callable[[], float], own: Callable[[], float] = time.monotonic) -> float:
    """By how many s ``clock`` is ahead of ``own``.

    A busy machine may stop a process between two reads. So both clocks are read several times, and
    the reads with the least time between them count.
    """

    def read() -> tuple[float, float]:
        before, there, after = own(), clock(), own()
        return after - before, there - (before + after) / 2

    return min(read() for _ in range(_READS))[1]
