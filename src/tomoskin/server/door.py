"""A connection that asks for nothing is closed, so that it keeps nobody else out."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import TYPE_CHECKING, Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

if TYPE_CHECKING:
    import h11

PATIENCE = 5.0
"""s in which a request has to arrive whole; a page's comes within milliseconds."""

MOST_WAITING = 64
"""Connections without a request: beyond, the oldest of them is closed."""

_QUIET = 60.0
_log = logging.getLogger(__name__)


class Door(H11Protocol):
    """One HTTP connection. It has :data:`PATIENCE` s for each of its requests."""

    _quiet_until: ClassVar[float] = 0.0

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._limit: asyncio.TimerHandle | None = None
        self._upgraded = self._begun = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request, and close the oldest where too many wait."""
        super().connection_made(transport)
        self._mind()
        waiting = [c for c in self.connections if isinstance(c, Door) and c._limit is not None]
        if len(waiting) > MOST_WAITING:
            oldest = min(waiting, key=lambda door: door._limit.when() if door._limit else 0.0)
            oldest._refuse(crowded=True)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clock of a connection that has ended."""
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what may be part of a request."""
        self._begun = True
        super().data_received(data)
        self._mind()

    def on_response_complete(self) -> None:
        """Start the clock for the next request."""
        super().on_response_complete()
        self._begun = False
        self._mind()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the socket of a page."""
        self._upgraded = True
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def _mind(self) -> None:
        answering = self.cycle is not None and not self.cycle.response_complete
        if self._upgraded or answering or self.transport.is_closing():
            self._stop_waiting()
        elif self._limit is None:
            self._limit = self.loop.call_later(PATIENCE, self._refuse)

    def _stop_waiting(self) -> None:
        if self._limit is not None:
            self._limit.cancel()
            self._limit = None

    def _refuse(self, *, crowded: bool = False) -> None:
        """Close it; that is said once a minute, but of no connection that a browser had to spare:
        one without a single byte, where there are few."""
        self._stop_waiting()
        self.transport.abort()
        now = time.monotonic()
        if (self._begun or crowded) and now >= Door._quiet_until:
            Door._quiet_until = now + _QUIET
            where = f"{self.client[0]}" if self.client else "somewhere"
            _log.warning("page: connections from %s that ask for nothing are closed", where)
