"""Bytes are fetched as they come, in a thread: a port's own buffer is full soon."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

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
