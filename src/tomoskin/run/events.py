"""The last things worth saying, for any number of readers at their own pace."""

from __future__ import annotations

import threading
from collections import deque

from tomoskin.core import Event
from tomoskin.touch import TouchEvent


def told(happened: TouchEvent) -> Event:
    """What happened to a touch as an event: "touch-onset", "touch-move", "touch-release" and so on.

    They go into a recording and not into an :class:`EventLog`: pages see the touches themselves.
    """
    return Event(happened.host_time, f"touch-{happened.kind}", happened.text)


class EventLog:
    """Bounded list of events, safe between threads; each has a number that only grows."""

    def __init__(self, size: int = 200) -> None:
        self._events: deque[tuple[int, Event]] = deque(maxlen=size)
        self._lock = threading.Lock()
        self._next = 0

    def add(self, event: Event) -> None:
        """Note one event; the oldest makes room."""
        with self._lock:
            self._events.append((self._next, event))
            self._next += 1

    def since(self, number: int) -> tuple[int, tuple[Event, ...]]:
        """(number to ask with next time, events from ``number`` on that are still kept)."""
        with self._lock:
            return self._next, tuple(e for n, e in self._events if n >= number)
