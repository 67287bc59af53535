"""Turns: runs of one program compute one at a time, in the order in which they ask."""

from __future__ import annotations

import threading
from collections import deque


class Turns:
    """A context manager that one thread is in at a time; those who wait come in their order.

    Many runs that computed at once would take the interpreter from each other, and every frame
    of all of them would be late. One after the other, a run that is flooded with frames holds
    up the others for a frame at most.
    """

    def __init__(self) -> None:
        """Make turns that nobody holds."""
        self._lock = threading.Lock()
        self._waiting: deque[threading.Lock] = deque()
        self._taken = False

    def __enter__(self) -> None:
        """Wait for the turn and take it."""
        with self._lock:
            if not self._taken:
                self._taken = True
                return
            ticket = threading.Lock()
            ticket.acquire()
            self._waiting.append(ticket)
        ticket.acquire()

    def __exit__(self, *_: object) -> None:
        """Give the turn to the next one."""
        with self._lock:
            if self._waiting:
                self._waiting.popleft().release()
            else:
                self._taken = False
