"""Messages out: everything that a run says goes to every consumer through here."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tomoskin.core import Capacity, Consumer, Event, Worker, stop_workers
from tomoskin.files.messages import Place, Stream
from tomoskin.files.session import RunMessage
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run.recordings import Recordings
from tomoskin.run.sinks import Sink, SinkConsumer, SinkReport, sink_report, sink_worker

MOST_WAITING = 256
"""Results that may wait for a subscriber; the oldest make room."""

_OFTEN = 0.25
"""Seconds after which who waits for a turn does something else."""

_log = logging.getLogger(__name__)


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


class Subscriber(Consumer):
    """A function that is given each result."""

    kind, slow = "subscriber", "is too slow, and results are left out"

    def __init__(self, name: str, call: Callable[[FrameResult], None]) -> None:
        self.name, self._call = name, call

    def admit(self, message: Any) -> FrameResult | None:
        """Let results of frames pass, and nothing else."""
        return message if isinstance(message, FrameResult) else None

    def take(self, item: FrameResult) -> None:
        """Call the function with a result."""
        self._call(item)

    def handle_failure(self, error: Exception) -> None:
        """A fault of our own: it is given no more."""
        _log.error("%s is given no more results", self.name, exc_info=error)


class Turns:
    """Turns that one thread has at a time; those who wait come in their order.

    Many runs that computed at once would take the interpreter from each other, and every frame
    of all of them would be late. One after the other, a run that is flooded with frames holds
    up the others for one read at most.
    """

    def __init__(self) -> None:
        """Make turns that nobody holds."""
        self._lock = threading.Lock()
        self._waiting: deque[threading.Lock] = deque()
        self._taken = False

    @contextlib.contextmanager
    def turn(self, meanwhile: Callable[[], None]) -> Iterator[bool]:
        """Wait for the turn, and have it while the block lasts; whether others were first.

        It calls ``meanwhile`` before, and now and then while it waits: a first frame may take
        seconds, and boards stop that hear nothing for so long. It must not raise.
        """
        meanwhile()
        ticket = threading.Lock()
        ticket.acquire()
        with self._lock:
            self._waiting.append(ticket)
            waits = self._taken
            if not waits:
                self._pass_on()
        while not ticket.acquire(timeout=_OFTEN):
            meanwhile()
        try:
            yield waits
        finally:
            with self._lock:
                self._pass_on()

    def _pass_on(self) -> None:
        self._taken = bool(self._waiting)
        if self._taken:
            self._waiting.popleft().release()


class Audience:
    """Around a run, whatever skin or source there is: who listens, and what it is one of.

    Attributes
    ----------
    clock
        Host monotonic seconds.
    sinks
        Where results go; each run opens them again.
    events
        What happened, for any number of readers at their own pace.
    place
        Which of a robot's skins it is; None where there is no robot.
    turns
        Taken for each frame; those of a robot's skins share them.
    early
        Whether drives tell of touches before their scan ends, where the board can.
    obey
        Has the run do what a listener asks for, as :class:`~tomoskin.files.messages.Stream` says.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        sinks: Sequence[Sink] = (),
        place: Place | None = None,
        turns: Turns | None = None,
        *,
        early: bool = False,
    ) -> None:
        self.early = early
        self.clock, self.sinks, self.events = clock, sinks, EventLog()
        self.place, self.turns = place, turns or Turns()
        self.obey: Callable[[str, Path], str] | None = None
        self._calls: list[Callable[[], None]] = []
        self._subscribers: tuple[Worker[Subscriber], ...] = ()
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def watch(self, call: Callable[[], None]) -> Iterator[None]:
        """While the block lasts, ``call`` is called at each result and event, in their thread.

        It must return at once. After the block it is not called again.
        """
        with self._lock:
            self._calls.append(call)
        try:
            yield
        finally:
            with self._lock:
                self._calls.remove(call)

    @contextlib.contextmanager
    def subscribe(self, name: str, call: Callable[[FrameResult], None]) -> Iterator[None]:
        """While the block lasts, ``call`` is given each result, in a thread of its own.

        When it is slow the oldest results are left out.
        """
        worker = Worker(Subscriber(name, call), Capacity(MOST_WAITING, "newest", 0.0), self.say)
        worker.start()
        with self._lock:
            self._subscribers += (worker,)
        try:
            yield
        finally:
            with self._lock:
                self._subscribers = tuple(one for one in self._subscribers if one is not worker)
            worker.end()

    def say(self, kind: str, text: str) -> None:
        """Note an event of this moment that concerns no run."""
        self.events.add(Event(self.clock(), kind, text))

    def put(self, message: FrameResult | Event) -> None:
        """Give ``message`` to those who subscribe; keep an event; wake all others."""
        if isinstance(message, Event):
            self.events.add(message)
        for worker in self._subscribers:
            worker.put(message)
        self.wake()

    def wake(self) -> None:
        """There is something new to look at."""
        with self._lock:
            for call in self._calls:
                call()


class Publisher:
    """Gives what one skin's run says to its recording, its sinks and its audience.

    Parameters
    ----------
    prepared
        The skin and its mesh.
    audience
        Who listens.
    numbered
        The last identity that was given to a touch.
    board
        How the board is doing, by name.

    Attributes
    ----------
    stream
        What will be published, once a source is followed.
    recordings
        The recording, and what it needs.
    """

    stream: Stream

    def __init__(
        self,
        prepared: Prepared,
        audience: Audience,
        numbered: Callable[[], int],
        board: Callable[[], Mapping[str, object]],
    ) -> None:
        self._audience, self._board = audience, board
        self._sinks: tuple[Worker[SinkConsumer], ...] = ()
        self.recordings = Recordings(prepared, self.say, audience.clock, numbered)

    def begin(self, prepared: Prepared, source: str, recorded: float | None = None) -> None:
        """A source is followed, and this is what it is called; a replay's epoch.

        Sinks that run already, because it could not be opened at first, go on.
        """
        self.recordings.name_source(source)
        stream = Stream.of(prepared, source, recorded, self._audience.place)
        self.stream = stream = replace(stream, board=self._board, obey=self._audience.obey)
        if self._sinks:
            return
        self._sinks = tuple(sink_worker(sink, stream, self.say) for sink in self._audience.sinks)
        for worker in self._sinks:
            worker.start()

    def put(self, message: RunMessage) -> None:
        """Have it recorded; give results and events to all who listen. Events from any thread,
        the rest from one."""
        self.recordings.put(message)
        if isinstance(message, FrameResult | Event):
            self.tell(message)

    def tell(self, message: FrameResult | Event) -> None:
        """Give to all who listen what is not recorded."""
        for worker in self._sinks:
            worker.put(message)
        self._audience.put(message)

    def say(self, kind: str, text: str) -> None:
        """Publish an event of this moment; from any thread."""
        self.put(Event(self._audience.clock(), kind, text))

    def wake(self) -> None:
        """Wake those who wait for the status to change."""
        self._audience.wake()

    def sink_reports(self) -> tuple[SinkReport, ...]:
        """The reports of all sinks, in their order."""
        return tuple(map(sink_report, self._sinks))

    def stop(self) -> None:
        """End the recording and the sinks; returns when they are complete."""
        if (ended := self.recordings.end()) is not None:
            ended.result()
        stop_workers(self._sinks)
        self._sinks = ()
