"""What is said again and again is said once a second, with how often it was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from tomoskin.core import Event

PERIOD = 1.0
"""s in which the same event is said once."""

COUNTED = frozenset({"fault", "refused"})
"""Kinds of events that a sick board causes in masses; all others are said each time."""


class Repeats:
    """Counts events of one kind and text; only of the kinds that are :data:`COUNTED`."""

    def __init__(self) -> None:
        self._said: dict[tuple[str, str], float] = {}
        self._waiting: dict[tuple[str, str], tuple[Event, int]] = {}

    def push(self, now: float, events: Sequence[Event]) -> Iterator[Event]:
        """What is to be said at ``now``, s: of ``events``, and of those that have waited."""
        for event in events:
            key = event.kind, event.text
            if event.kind not in COUNTED:
                yield event
            elif key in self._said and abs(now - self._said[key]) < PERIOD:
                self._waiting[key] = event, self._waiting.get(key, (event, 0))[1] + 1
            else:
                yield self._told(now, event, 1 + self._waiting.pop(key, (event, 0))[1])
        for key, (event, count) in list(self._waiting.items()):
            if key not in self._said or abs(now - self._said[key]) >= PERIOD:
                del self._waiting[key]
                yield self._told(now, event, count)

    def _told(self, now: float, event: Event, count: int) -> Event:
        self._said = {key: time for key, time in self._said.items() if abs(now - time) < PERIOD}
        self._said[event.kind, event.text] = now
        return event if count == 1 else replace(event, text=f"{event.text} ({count} times)")
