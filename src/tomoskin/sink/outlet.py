"""A thread and a bounded queue before each sink: a slow or dead one delays nobody."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from tomoskin.core import TomoskinError
from tomoskin.sink.sink import Item, Moment, Sink, Stream

MOST_WAITING = 256
"""Results and events that may wait for one sink; the oldest make room, and are counted."""

IMAGE_PERIOD = 0.1
"""Seconds between two images, by host time."""

GRACE = 2.0
"""Seconds in which a sink must send what waits when it is stopped."""

_FIRST_DELAY, _LONGEST_DELAY = 0.5, 10.0
_LONG = 2.0
"""Seconds in one call after which a sink is reported not to answer."""

Say = Callable[[str, str], None]

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SinkReport:
    """How a sink is doing: ``well`` or not, in words, and what it sent and what was left out."""

    name: str
    well: bool
    text: str
    sent: int
    left_out: int


class Outlet:
    """Gives one sink what comes, from a thread of its own.

    Parameters
    ----------
    sink
        Opened when the outlet is started, and again whenever it has failed.
    say
        Called with the kind and text of an event, from any thread.
    """

    def __init__(self, sink: Sink, say: Say) -> None:
        self.sink = sink
        self.sent = self.left_out = 0
        self._say = say
        self._waiting: deque[Item] = deque()
        self._newest: Moment | None = None
        self._news = threading.Condition()
        self._behind = 0
        self._last_image = float("-inf")
        self._away = "not started"
        self._asked: float | None = None
        self._deadline: float | None = None
        self._thread: threading.Thread | None = None

    def start(self, stream: Stream) -> None:
        """Open the sink, without waiting for it."""
        self._thread = threading.Thread(
            target=self._run, args=(stream,), name=f"tomoskin-{self.sink.name}", daemon=True
        )
        self._thread.start()

    def put(self, item: Item) -> None:
        """Have ``item`` published; returns at once."""
        with self._news:
            if isinstance(item, Moment):
                self._newest = item
            self._waiting.append(item)
            full = len(self._waiting) > MOST_WAITING
            if full:
                self._waiting.popleft()
                self._behind += 1
                self.left_out += 1
            first = full and self._behind == 1 and not self._away
            self._news.notify()
        if first:
            self._tell("sink-behind", "does not keep up, and results are left out")

    def end(self) -> None:
        """Stop soon; :meth:`join` waits for it."""
        with self._news:
            self._deadline = time.monotonic() + GRACE
            self._news.notify()

    def join(self) -> None:
        """Return when the sink is closed, or leave it to itself when it does not end."""
        if self._thread is None:
            return
        left = (self._deadline or 0.0) + GRACE - time.monotonic()
        self._thread.join(max(left, 0.0))
        if self._thread.is_alive():
            self._tell("sink-stuck", "does not answer, and is left to itself")

    def report(self) -> SinkReport:
        """How it is doing now."""
        asked = self._asked
        silent = 0.0 if asked is None else time.monotonic() - asked
        text = self._away or f"{self.sent} sent"
        if silent > _LONG:
            text = f"does not answer for {silent:.0f} s, {text}"
        if self.left_out:
            text += f", {self.left_out} left out"
        well = not self._away and silent <= _LONG
        return SinkReport(self.sink.name, well, text, self.sent, self.left_out)

    def _run(self, stream: Stream) -> None:
        delay = _FIRST_DELAY
        self._away = "connecting"
        while True:
            before = self.sent
            try:
                self._serve(stream)
            except Exception as error:
                self._failed(error)
            finally:
                with contextlib.suppress(Exception), self._in_time():  # it may be what has failed
                    self.sink.close()
            if self.sent > before:
                delay = _FIRST_DELAY
            if self._stopped_within(delay):
                return
            delay = min(2 * delay, _LONGEST_DELAY)

    def _serve(self, stream: Stream) -> None:
        with self._in_time():
            self.sink.open(stream)
        self._forget()
        self._away = ""
        self._tell("sink-open", "takes results")
        while (item := self._next()) is not None:
            with self._in_time():
                self.sink.publish(item)
            self.sent += 1
            self._caught_up()

    @contextlib.contextmanager
    def _in_time(self) -> Iterator[None]:
        """Notes since when the sink has been asked for something."""
        self._asked = time.monotonic()
        try:
            yield
        finally:
            self._asked = None

    def _stopped_within(self, delay: float) -> bool:
        with self._news:
            return self._news.wait_for(lambda: self._deadline is not None, delay)

    def _forget(self) -> None:
        """Results that waited for the sink to open are no news any more; events are."""
        with self._news:
            events = [item for item in self._waiting if not isinstance(item, Moment)]
            self.left_out += len(self._waiting) - len(events)
            self._waiting = deque(events)

    def _next(self) -> Item | None:
        """What is to be sent now; None: no more."""
        with self._news:
            self._news.wait_for(lambda: self._waiting or self._deadline is not None)
            late = self._deadline is not None and time.monotonic() > self._deadline
            if late or not self._waiting:
                return None
            item = self._waiting.popleft()
            if not isinstance(item, Moment) or item.image is None:
                return item
            if item is self._newest and not 0 <= item.host_time - self._last_image < IMAGE_PERIOD:
                self._last_image = item.host_time
                return item
        return replace(item, image=None)

    def _caught_up(self) -> None:
        with self._news:
            count = 0 if self._waiting else self._behind
            self._behind -= count
        if count:
            self._tell("sink-gap", f"{count} results were left out")

    def _failed(self, error: Exception) -> None:
        before, self._away = self._away, f"is away: {_why(error)}"
        if self._away != before:
            self._tell("sink-away", self._away)

    def _tell(self, kind: str, text: str) -> None:
        level = logging.INFO if kind == "sink-open" else logging.WARNING
        _log.log(level, "%s %s", self.sink.name, text)
        self._say(kind, f"{self.sink.name} {text}")


def _why(error: Exception) -> str:
    """In words; the sink's name stands before them already."""
    if isinstance(error, TomoskinError):
        return f"{error.message} ({error.hint})" if error.hint else error.message
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return f"{type(error).__name__}: {error}"


class Outlets:
    """Every sink of a run, each behind its own outlet."""

    def __init__(self, sinks: Sequence[Sink], say: Say) -> None:
        self._outlets = tuple(Outlet(sink, say) for sink in sinks)

    def __bool__(self) -> bool:
        """Whether there is a sink at all."""
        return bool(self._outlets)

    def start(self, stream: Stream) -> None:
        """Open all, without waiting for any."""
        for outlet in self._outlets:
            outlet.start(stream)

    def put(self, item: Item) -> None:
        """Have ``item`` published by all; returns at once."""
        for outlet in self._outlets:
            outlet.put(item)

    def stop(self) -> None:
        """Let each send what waits for a short while, and close it; a second call does nothing."""
        for outlet in self._outlets:
            outlet.end()
        for outlet in self._outlets:
            outlet.join()
        self._outlets = ()

    def reports(self) -> tuple[SinkReport, ...]:
        """How each is doing."""
        return tuple(outlet.report() for outlet in self._outlets)
