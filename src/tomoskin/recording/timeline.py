"""What happened in a recording, for a line of time beside its replay."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tomoskin.core import Event
from tomoskin.recording.layout import Mark
from tomoskin.recording.session_reader import SessionReader, end_time

MOST_SPANS = 2000
"""Touches on it; later ones are left out."""


@dataclass(frozen=True, slots=True)
class Span:
    """A touch from its first frame to its last, s."""

    id: int
    kind: str
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Timeline:
    """Times in s from the first frame: the end, notes and events in order, touches by onset."""

    end: float
    notes: tuple[tuple[float, Event], ...]
    events: tuple[tuple[float, Event], ...]
    touches: tuple[Span, ...]


def read_timeline(path: Path) -> Timeline:
    """Timeline of a session; its touches are those that were recorded.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, is damaged, or holds no frame.
    """
    with SessionReader(path) as session:
        own = (i.frame.host_time for i in session.frames() if not i.mark & Mark.EARLIER)
        start = next(own, 0.0)

        def timed(events: Iterator[Event]) -> tuple[tuple[float, Event], ...]:
            return tuple((event.host_time - start, event) for event in events)

        spans = tuple(_spans(session, start))
        last = end_time(session)
        end = max((span.end for span in spans), default=0.0) if last is None else last - start
        return Timeline(end, timed(session.notes()), timed(session.events()), spans)


def _spans(session: SessionReader, start: float) -> Iterator[Span]:
    """Touches with the same number at different times are different touches: one run each."""
    open_ones: dict[int, Span] = {}
    done: list[Span] = []
    for item in session.touches():
        now = item.host_time - start
        present = {touch.id: touch for touch in item.touches}
        done += [open_ones.pop(gone) for gone in open_ones.keys() - present.keys()]
        for number, touch in present.items():
            begun = open_ones[number].begin if number in open_ones else now
            open_ones[number] = Span(number, touch.kind, begun, now)
        if len(done) >= MOST_SPANS:
            break
    done += open_ones.values()
    return iter(sorted(done, key=lambda span: (span.begin, span.id)))
