"""The contacts of a run for a function of the same program."""

from __future__ import annotations

from collections.abc import Callable

from tomoskin.core import Event
from tomoskin.run.sinks.contact import Contacts
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.sink import Item, Stream


class ContactListener:
    """A sink that calls ``react`` with the contacts of each frame, from a thread of its own.

    A function that is slow gets the newest 256 frames, and delays nobody; one that raises is
    called again after a pause.
    """

    def __init__(
        self, react: Callable[[Contacts], None], naming: Naming | None = None, name: str = "robot"
    ) -> None:
        self.name = name
        self._react, self._naming = react, naming or Naming()
        self._stream: Stream | None = None

    def open(self, stream: Stream) -> None:
        """Remember whose contacts they are."""
        self._stream, self._of_skin = stream, self._naming.of_skin(stream)

    def publish(self, item: Item) -> None:
        """Call the function with the contacts of a frame."""
        if self._stream is not None and not isinstance(item, Event):
            self._react(Contacts.of(self._stream, self._of_skin, item))

    def close(self) -> None:
        """Nothing is held."""
        self._stream = None
