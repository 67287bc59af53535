"""A clock that a program moves: the twin faster than real time, and the same each time."""

from __future__ import annotations

import threading


class VirtualClock:
    """Time that passes only by being waited for; starts at 0 s."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        """Seconds since the start."""
        return self.time

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Let the time pass at once; nothing else can happen meanwhile."""
        del condition
        self.time += seconds
