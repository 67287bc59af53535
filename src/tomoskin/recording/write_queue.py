"""A thread that writes what others hand it, and a queue of bounded size before it."""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tomoskin.core import DataError
from tomoskin.recording.message_log import MessageLog

_SETTLE = 0.9
"""Seconds after which the open chunk is written: what a killed program can lose, with room."""

_OBJECT = 256
"""Bytes that a waiting call is taken for, beside its data."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Call:
    size: int
    write: Callable[..., None]
    arguments: tuple[Any, ...]


class WriteQueue:
    """Makes calls that write to ``file`` from a thread of its own.

    When the disk cannot keep up, calls are left out, counted and reported. When the file cannot be
    written any further the queue ends, which is reported too; the file stays readable.

    Parameters
    ----------
    file
        Closed by :meth:`stop`, or when writing fails.
    say
        Called with the kind and text of an event, from any thread.
    most_waiting
        Bytes that may wait.

    Attributes
    ----------
    left_out
        Calls that were not made.
    """

    def __init__(
        self, file: MessageLog, say: Callable[[str, str], None], most_waiting: int
    ) -> None:
        self.left_out = 0
        self._file, self._say, self._limit = file, say, most_waiting
        self._queue: queue.SimpleQueue[_Call | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._came = self._went = self._behind = 0
        self._settled = time.monotonic()
        self.has_failed = False
        self._thread = threading.Thread(target=self._run, name="tomoskin-recorder", daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether calls are still made."""
        return self._thread.is_alive() and not self.has_failed

    def put(self, size: int, write: Callable[..., None], *arguments: Any) -> None:
        """Have ``write`` called, for ``size`` bytes; returns at once."""
        with self._lock:
            if self.has_failed:
                return
            size += _OBJECT
            fits = self._came - self._went + size <= self._limit
            if fits:
                self._came += size
                self._queue.put(_Call(size, write, arguments))
            else:
                self.left_out += 1
                self._behind += 1
            first = not fits and self._behind == 1
        if first:
            where = self._file.path
            self._say("recording-behind", f"{where}: the disk is too slow, messages are lost")

    def wait_until_empty(self) -> None:
        """Return when nothing waits for the disk any more."""
        done = threading.Event()
        self.put(0, done.set)
        while not done.wait(_SETTLE) and self.is_running:
            pass

    def stop(self) -> None:
        """Make the calls that wait, end the file and return; a second call does nothing."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        try:
            while (call := self._next()) is not None:
                call.write(*call.arguments)
                self._went += call.size
                if self._behind and self._came == self._went:
                    self._catch_up()
            self._file.close()
        except DataError as error:
            self._fail(str(error))
        except Exception as error:
            _log.exception("the recording thread ended")
            self._fail(f"internal error, {type(error).__name__}: {error}")

    def _next(self) -> _Call | None:
        """The next call, or None at the end; the file is settled once in a while."""
        while True:
            patience = self._settled + _SETTLE - time.monotonic()
            if patience > 0:
                with contextlib.suppress(queue.Empty):
                    return self._queue.get(timeout=patience)
            self._file.settle()
            self._settled = time.monotonic()

    def _catch_up(self) -> None:
        with self._lock:
            count, self._behind = self._behind, 0
        self._say("recording-gap", f"{self._file.path}: {count} messages were not recorded")

    def _fail(self, why: str) -> None:
        with self._lock:
            self.has_failed = True
        with contextlib.suppress(DataError):  # what could be written is in the file
            self._file.close()
        while not self._queue.empty():
            self._queue.get()
        self._say("recording-stopped", f"the recording has ended: {why}")
