"""What a sink is, sinks by their names, what of a run goes to one, and how it is doing."""

from __future__ import annotations

import contextlib
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

from tomoskin.core import (
    Capacity,
    Consumer,
    Event,
    Registered,
    Say,
    SinkError,
    TomoskinError,
    Worker,
    no_such,
    registered,
    registered_one,
)
from tomoskin.files.messages import Item, Naming, Reporter, Stream
from tomoskin.pipeline import FrameResult

_Opener = TypeVar("_Opener", bound=Callable[[str], Any])
_EXAMPLE = "example"


class Sink(ABC):
    """Takes results elsewhere; all calls come from one thread of its own, which they may hold up.

    Any exception means that the sink is away: it is closed, and opened again after a pause. What
    to send, how often, and how one of several skins is called, is decided before it is called.

    Attributes
    ----------
    name
        What a person calls it; without passwords.
    naming
        What it calls the skin; those of a robot have their own names below it.
    period
        Seconds between two messages of touches that go on.
    hint
        What someone should know of it once it has been opened.
    """

    name: str
    naming = Naming()
    period = 0.0
    hint = ""

    def open(self, stream: Stream) -> None:
        """Get ready to publish; again after :meth:`close`."""
        del stream

    @abstractmethod
    def publish(self, item: Item) -> None:
        """Send one frame's contacts, or an event."""

    def close(self) -> None:
        """Let go of everything; also after an :meth:`open` that failed half-way."""
        return


def sink_names() -> tuple[str, ...]:
    """Names of the installed sinks."""
    return tuple(sorted(registered("sinks")))


def make_sink(spec: str) -> Sink:
    """Sink of ``name`` or ``name:argument``, not opened.

    Raises
    ------
    SinkError
        When there is no sink of that name, its argument is none, or its package is missing or
        makes no sink.
    """
    name, _, argument = spec.partition(":")
    entry = registered_one("sinks", name)
    if entry is None:
        raise SinkError(no_such(name, sink_names(), "a sink"))
    try:
        sink = entry.load()(argument)
    except TomoskinError:
        raise
    except Exception as error:
        raise _faulty(entry, f"{type(error).__name__}: {error}") from error
    if not isinstance(sink, Sink) or not isinstance(getattr(sink, "name", None), str):
        raise _faulty(entry, f"expected a Sink with a name, got {sink!r}")
    return sink


def tried_with(argument: str) -> Callable[[_Opener], _Opener]:
    """Say of what makes a sink with which ``argument`` it can be tried, where it needs one."""

    def mark(opener: _Opener) -> _Opener:
        vars(opener)[_EXAMPLE] = argument
        return opener

    return mark


def example_of(name: str) -> str:
    """What the sink of that ``name`` can be made of, to see whether its packages are here."""
    with contextlib.suppress(Exception):  # which making it says in words
        example = getattr(registered("sinks")[name].load(), _EXAMPLE, "")
        return f"{name}:{example}" if example else name
    return name


def _faulty(entry: Registered, why: str) -> SinkError:
    return SinkError(
        f"cannot be made: {why}",
        where=f"sink {entry.name}",
        hint=f"it is {entry.target}, which its own package has to mend",
    )


def port_of(text: str, where: str) -> int:
    """A port number; SinkError where ``text`` is none."""
    if text.isascii() and text.isdigit() and 0 < int(text) < 65536:
        return int(text)
    raise SinkError(f'expected a port from 1 to 65535, got "{text}"', where=where)


def options_of(words: Iterable[str], known: tuple[str, ...], where: str) -> dict[str, str]:
    """``a=1`` and ``b=2`` by name; SinkError for what is not known."""
    options = {}
    for word in words:
        key, _, value = word.partition("=")
        if key not in known or not value:
            form = ", ".join(f"{name}=…" for name in known)
            raise SinkError(f'expected {form}, got "{word}"', where=where)
        options[key] = value
    return options


MOST_WAITING = 256
"""Results and events that may wait for one sink; the oldest make room, and are counted."""

GRACE = 2.0
"""Seconds in which a sink must send what waits when it is stopped."""

_FIRST_DELAY, _LONGEST_DELAY = 0.5, 10.0
_LONG = 2.0
"""Seconds in one call after which a sink is said not to answer."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SinkReport:
    """How a sink is doing: ``well`` or not, in words, and what it sent and what was left out."""

    name: str
    well: bool
    text: str
    sent: int
    left_out: int


class SinkConsumer(Consumer):
    """Gives a sink results and events; opens it again whenever it has failed.

    Of results that wait only the newest keeps its image, ten a second at most. Those that came
    while the sink was away are no news any more; events are.

    Attributes
    ----------
    trouble
        Why nothing is sent, or "".
    """

    kind = "sink"
    slow = "is too slow, and results are left out"

    def __init__(self, sink: Sink, stream: Stream, say: Say) -> None:
        self.name = sink.name
        self.trouble = "connecting"
        self._sink, self._stream, self._say = sink, stream.named(sink.naming), say
        self._reporter = Reporter(self._stream, period=sink.period)
        self._newest: FrameResult | None = None
        self._delay = _FIRST_DELAY

    def admit(self, message: FrameResult | Event) -> FrameResult | Event:
        """Take all that comes, and know the newest result."""
        if isinstance(message, FrameResult):
            self._newest = message
        return message

    def durable(self, item: FrameResult | Event) -> bool:
        """Events are news however late."""
        return isinstance(item, Event)

    def open(self) -> None:
        """Open the sink, which gets what comes next in full."""
        self._sink.open(self._stream)
        self.ready = "; ".join(filter(None, ("takes results", self._sink.hint)))
        self.trouble = ""
        self._reporter.repeat()
        self.tend()

    def take(self, item: FrameResult | Event) -> None:
        """Send it; and of an event that the source is lost what that means for touches."""
        if isinstance(item, FrameResult):
            self._sink.publish(self._reporter.of(item, with_image=item is self._newest))
        else:
            self._sink.publish(item)
            if (last := self._reporter.lost(item)) is not None:
                self._sink.publish(last)
        self._delay = _FIRST_DELAY

    def tend(self) -> None:
        """Report that no frame has come, or that the source is lost, where it is so."""
        if (report := self._reporter.silent()) is not None:
            self._sink.publish(report)

    def close(self) -> None:
        """Close the sink, which may be what has failed."""
        with contextlib.suppress(Exception):
            self._sink.close()

    def handle_failure(self, error: Exception) -> float:
        """Say so once; it is opened again after a pause that doubles."""
        how = "is not reachable" if isinstance(error, (OSError, TomoskinError)) else "fails"
        before, self.trouble = self.trouble, f"{how}: {_why(error)}"
        if self.trouble != before:
            text = f"{self.name} {self.trouble}"
            _log.warning("%s", text)
            self._say("sink-away", text)
        delay = self._delay
        self._delay = min(2 * delay, _LONGEST_DELAY)
        return delay


def sink_worker(sink: Sink, stream: Stream, say: Say) -> Worker[SinkConsumer]:
    """A worker before ``sink``, not started."""
    consumer = SinkConsumer(sink, stream, say)
    return Worker(consumer, Capacity(MOST_WAITING, "newest", GRACE), say)


def sink_report(worker: Worker[SinkConsumer]) -> SinkReport:
    """How a sink is doing at this moment."""
    consumer = worker.consumer
    text = consumer.trouble or f"{worker.taken} sent"
    if (silent := worker.silent) > _LONG:
        text = f"has not answered for {silent:.0f} s, {text}"
    if worker.left_out:
        text += f", {worker.left_out} left out"
    well = not consumer.trouble and silent <= _LONG
    return SinkReport(consumer.name, well, text, worker.taken, worker.left_out)


def _why(error: Exception) -> str:
    """In words; the sink's name stands before them already."""
    if isinstance(error, TomoskinError):
        return error.advice
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return f"{type(error).__name__}: {error}"
