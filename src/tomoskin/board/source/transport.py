"""What a link needs of a source: bytes in, bytes out."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from tomoskin.core import SourceError


@runtime_checkable
class Transport(Protocol):
    """A two-way stream of bytes to a board, real or not.

    One thread reads and writes; ``close`` may come from another.
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
class Fetched(Protocol):
    """A transport whose bytes are fetched while nobody reads, so that they may have waited."""

    @property
    def waited(self) -> float:
        """How long the first byte of the last read had waited, s."""


@runtime_checkable
class Played(Protocol):
    """A transport that plays a recording: it has a time of its own, and can be sought in."""

    def now(self) -> float:
        """Monotonic seconds in the recording: exactly those of what was read last."""

    def after_seek(self) -> bool:
        """Whether what was read last does not follow what was read before it."""
