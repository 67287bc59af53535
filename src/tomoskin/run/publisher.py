"""Who is told what a run makes and what happens to it: pages, the recording, the sinks."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from tomoskin.core import Event
from tomoskin.pipeline import Prepared, Result
from tomoskin.run.events import EventLog, told
from tomoskin.run.published import moment_of, stream_of
from tomoskin.run.tape import Tape
from tomoskin.sink import Outlets, Sink, SinkReport


class Watchers:
    """Who is called at each result, from the runner's thread."""

    def __init__(self) -> None:
        """Nobody yet."""
        self._calls: list[Callable[[], None]] = []
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def with_one(self, announce: Callable[[], None]) -> Iterator[None]:
        """While the block lasts, ``announce`` is called at each result; after it never again."""
        with self._lock:
            self._calls.append(announce)
        try:
            yield
        finally:
            with self._lock:
                self._calls.remove(announce)

    def call(self) -> None:
        """There is a result."""
        with self._lock:
            for announce in self._calls:
                announce()


@dataclass(frozen=True, slots=True, eq=False)
class Audience:
    """Who listens, whatever skin or source there is; ``clock`` is host monotonic seconds."""

    clock: Callable[[], float]
    sinks: Sequence[Sink] = ()
    events: EventLog = field(default_factory=EventLog)
    watchers: Watchers = field(default_factory=Watchers)


class Publisher:
    """Tells the audience of one skin's run; its recordings are the ``tape``.

    Parameters
    ----------
    prepared
        The skin and its mesh.
    audience
        Who listens.
    numbered
        The last identity that was given to a touch.
    """

    def __init__(self, prepared: Prepared, audience: Audience, numbered: Callable[[], int]) -> None:
        self._audience = audience
        self._outlets = Outlets(audience.sinks, self.say)
        self.tape = Tape(prepared, self.say, audience.clock, numbered)

    def opened(self, prepared: Prepared, source: str) -> None:
        """A source has been opened, and this is what it is called."""
        self.tape.opened(source)
        self._outlets.start(stream_of(prepared, source))

    def stop(self) -> None:
        """End the recording and the sinks; returns when they are whole."""
        self.tape.stop()
        self._outlets.stop()

    def say(self, kind: str, text: str) -> None:
        """Publish an event of this moment."""
        self.event(Event(self._audience.clock(), kind, text))

    def event(self, happened: Event) -> None:
        """Publish an event."""
        self._audience.events.add(happened)
        self.tape.event(happened)
        self._outlets.put(happened)

    def note(self, event: Event) -> None:
        """Publish a person's remark; from any thread."""
        self._audience.events.add(event)
        self.tape.note(event)
        self._outlets.put(event)

    def result(self, result: Result) -> None:
        """Publish what was made of a frame, when whoever reads the newest can have it."""
        self.tape.result(result)
        for happened in result.events:
            self.tape.event(told(happened))
        if self._outlets:
            self._outlets.put(moment_of(result))
        self.announce()

    def announce(self) -> None:
        """Wake those who wait for the status to change."""
        self._audience.watchers.call()

    def sink_reports(self) -> tuple[SinkReport, ...]:
        """How each sink is doing."""
        return self._outlets.reports()
