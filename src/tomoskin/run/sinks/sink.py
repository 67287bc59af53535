"""What a sink is, and sinks by their names."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from importlib.metadata import entry_points

from tomoskin.core import Event, SinkError
from tomoskin.files.messages import Contacts, Item, Naming, Stream

GROUP = "tomoskin.sinks"
"""Entry-point group: each entry is a function ``argument -> Sink`` that does no I/O."""


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
    """

    name: str
    naming = Naming()
    period = 0.0

    def open(self, stream: Stream) -> None:
        """Get ready to publish; again after :meth:`close`."""
        del stream

    @abstractmethod
    def publish(self, item: Item) -> None:
        """Send one frame's contacts, or an event."""

    def close(self) -> None:
        """Let go of everything; also after an :meth:`open` that failed half-way."""
        return


class ContactListener(Sink):
    """Calls ``react`` with the contacts of each frame, from a thread of its own.

    A function that is slow gets the newest 256 frames, and delays nobody; one that raises is
    called again after a pause. Of a source that is lost it gets one last, not valid.
    """

    def __init__(
        self, react: Callable[[Contacts], None], naming: Naming | None = None, name: str = "robot"
    ) -> None:
        self.name, self.naming = name, naming or Naming()
        self._react = react

    def publish(self, item: Item) -> None:
        """Call the function with the contacts of a frame."""
        if not isinstance(item, Event) and (item.voltages is not None or item.is_due):
            self._react(item)


def sink_names() -> tuple[str, ...]:
    """Names of the installed sinks."""
    return tuple(sorted(entry_points(group=GROUP).names))


def make_sink(spec: str) -> Sink:
    """Sink of ``name`` or ``name:argument``, not opened: ``lsl``, ``mqtt://host/topic``.

    Raises
    ------
    SinkError
        When there is no sink of that name, its argument is none, or its package is missing.
    """
    name, _, argument = spec.partition(":")
    entries = tuple(entry_points(group=GROUP, name=name))
    if not entries:
        raise SinkError(
            f'there is no sink "{name}"', hint=f"sinks: {', '.join(sink_names()) or 'none'}"
        )
    sink: Sink = entries[0].load()(argument)
    return sink


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
