"""Sources: what a link needs of one, opening them by name, bytes that are fetched as they come, and
asking a board without a link."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, TypeVar, runtime_checkable

from tomoskin.board.wire import Ack, Command, Decoder, Message, encode
from tomoskin.core import SourceError, no_such, registered, registered_one

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

M = TypeVar("M", bound=Message)


@runtime_checkable
class Transport(Protocol):
    """A two-way stream of bytes to a board, real or not.

    One thread reads and writes; ``close`` may come from another. Where bytes are fetched while
    nobody reads, ``waited`` is how long the first byte of the last read had waited, s.
    """

    @property
    def name(self) -> str:
        """How a person would call it: ``serial:/dev/ttyACM0``."""

    def read(self, timeout: float) -> bytes:
        """Bytes that have come, waiting at most ``timeout`` s for the first; ``b""`` if none.

        Raises
        ------
        SourceError
            When the device has gone away.
        """

    def write(self, data: bytes) -> None:
        """Send ``data``; SourceError when the device has gone away."""

    def close(self) -> None:
        """Give the device back; a second call does nothing."""


@runtime_checkable
class Diagnosable(Protocol):
    """A transport that can say why no board answers behind it."""

    def diagnose(self, heard: bytes) -> SourceError:
        """The likeliest cause; ``heard``: the first bytes that came. Raises as ``read`` does."""


@runtime_checkable
class Played(Protocol):
    """A transport that plays a recording: it has a time of its own, and can be sought in."""

    def now(self) -> float:
        """Monotonic seconds in the recording: exactly those of what was read last."""

    def after_seek(self) -> bool:
        """Whether what was read last does not follow what was read before it."""


def source_names() -> tuple[str, ...]:
    """Names of the installed sources."""
    return tuple(sorted(registered("sources")))


def open_source(spec: str, skin: Skin) -> Transport:
    """Open ``name`` or ``name:argument``: ``twin``, ``twin:seed=3``, ``serial:/dev/ttyACM0``.

    Raises
    ------
    SourceError
        When there is no source of that name, or it cannot be opened.
    """
    name, _, argument = spec.partition(":")
    entry = registered_one("sources", name)
    if entry is None:
        raise SourceError(
            no_such(name, source_names(), "a source"), hint="for example twin or serial:PORT"
        )
    opener: Callable[[str, Skin], Transport] = entry.load()
    return opener(argument, skin)


def read_options(argument: str, known: tuple[str, ...], where: str) -> dict[str, str]:
    """``"seed=3,fast"`` as ``{"seed": "3", "fast": ""}``; SourceError for an unknown word."""
    options = {}
    for item in filter(None, (part.strip() for part in argument.split(","))):
        key, _, value = item.partition("=")
        if key not in known:
            raise SourceError(no_such(key, known, "an option"), where=where)
        options[key] = value
    return options


class Exchange:
    """Commands, one after the other, and what comes in between."""

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self._decoder = Decoder()
        self._request = 200

    def ask(
        self, command: Command, kind: type[M], *, patience: float = 0.3, tries: int = 5
    ) -> M | None:
        """The answer, of a ``kind`` of message; None where ``tries`` of ``patience`` s bring none.

        An acknowledgement is one of this very command.
        """
        self._request = self._request % 255 + 1
        data = encode(replace(command, request=self._request))
        for _ in range(tries):
            self.transport.write(data)
            for message in self.listen(patience):
                others = isinstance(message, Ack) and message.request != self._request
                if isinstance(message, kind) and not others:
                    return message
        return None

    def listen(self, seconds: float) -> Iterator[Message]:
        """What comes within ``seconds``."""
        end = time.monotonic() + seconds
        while (rest := end - time.monotonic()) > 0:
            data = self.transport.read(rest)
            yield from self._decoder.feed(data, time.monotonic())


MOST = 1 << 24
"""Bytes that wait at most; then no more are fetched, and the board drops frames and counts them."""


class ReadAhead:
    """Fetches bytes from the first :meth:`read` on, until it is closed.

    Attributes
    ----------
    waited
        How long the first byte of the last read had waited, s.
    """

    def __init__(
        self, fetch: Callable[[], bytes], cancel: Callable[[], None], most: int = MOST
    ) -> None:
        """``fetch`` waits a while for bytes; what it raises, :meth:`read` raises after the last
        byte. ``cancel``, called from another thread, ends its waiting."""
        self._fetch, self._cancel, self._most = fetch, cancel, most
        self._chunks: deque[tuple[float, bytes]] = deque()
        self._size = 0
        self._error: Exception | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self.waited = 0.0

    def read(self, timeout: float) -> bytes:
        """All that waits, after at most ``timeout`` s for the first byte; ``b""`` if none."""
        if self._thread is None and not self._closed:
            self._thread = threading.Thread(target=self._run, name="port", daemon=True)
            self._thread.start()
        with self._changed:
            self._changed.wait_for(lambda: self._chunks or self._error or self._closed, timeout)
            if not self._chunks:
                if self._error is not None:
                    raise self._error
                return b""
            self.waited = time.monotonic() - self._chunks[0][0]
            data = b"".join(chunk for _, chunk in self._chunks)
            self._chunks.clear()
            self._size = 0
            self._changed.notify_all()
            return data

    def close(self) -> None:
        """Fetch no more; returns when nothing is fetched any longer."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None:
            self._cancel()
            self._thread.join()

    def _run(self) -> None:
        try:
            while self._has_room():
                data = self._fetch()
                if data:
                    with self._changed:
                        self._chunks.append((time.monotonic(), data))
                        self._size += len(data)
                        self._changed.notify_all()
        except Exception as error:
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _has_room(self) -> bool:
        """Wait until more may be fetched; False when it has been closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._size < self._most or self._closed)
            return not self._closed
