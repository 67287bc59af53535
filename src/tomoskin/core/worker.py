"""A bounded queue and a thread before each consumer: a slow or dead one delays nobody."""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Generic, Literal, Protocol, TypeVar

from tomoskin.core.errors import SinkError

_PATIENCE = 2.0
"""Seconds beyond its grace in which a consumer must have ended."""

_ROUTINE = 0.9
"""Seconds after which a consumer looks after itself: what a killed program can lose, with room."""

Say = Callable[[str, str], None]
"""Called with the kind and text of an event, from any thread."""

_log = logging.getLogger(__name__)


class Consumer(Protocol):
    """Takes messages from its worker's thread, which it may hold up.

    :meth:`admit` and :meth:`durable` are called by whoever puts a message, and must be quick. Who
    inherits from this gets the simplest consumer: all that waits is worth something, and with a
    failure it ends.
    """

    kind: str
    """First part of the kinds of events about it: "sink", "recording"."""

    name: str
    """What a person calls it; events about it begin with that."""

    slow: str
    """What is said when it does not keep up."""

    ready: str = ""
    """What is said when it has been opened; "": nothing."""

    gathering: float = 0.0
    """Seconds for which messages may wait to be taken together; 0: each wakes the thread."""

    def admit(self, message: Any) -> Any:
        """What of ``message`` is to wait for it; None: it is not meant for it."""

    def durable(self, item: Any) -> bool:
        """Whether an item is still worth something after the consumer was away."""
        del item
        return True

    def open(self) -> None:
        """Get ready; again after it has failed."""
        return

    def take(self, item: Any) -> None:
        """Take what was admitted; in the order in which it came."""

    def tend(self) -> None:
        """Look after itself: called once a second, whether messages come or not."""
        return

    def close(self) -> None:
        """Let go of everything; also after an :meth:`open` that failed half-way."""
        return

    def handle_failure(self, error: Exception) -> float | None:
        """It has raised: seconds until it is opened again; None: it ends here."""
        del error
        return None


C = TypeVar("C", bound=Consumer)


@dataclass(frozen=True, slots=True)
class Capacity:
    """How many items may wait for a consumer.

    Of more than ``most`` the ``keeps`` stay: before the newest the oldest make room, the oldest
    stay and what comes is left out. ``grace``: seconds for what waits at the end.
    """

    most: int
    keeps: Literal["newest", "oldest"]
    grace: float = math.inf


class Worker(Generic[C]):
    """Gives one consumer what comes, from a thread of its own.

    What does not fit is left out, counted and said: "KIND-behind" when it begins, "KIND-gap" with
    the count when the consumer has caught up, "KIND-stuck" where it does not end.

    Attributes
    ----------
    taken, left_out
        Messages that the consumer took, and that it could not be given.
    opening, ending
        Done when the consumer was opened for the first time (or has its error), and when the
        thread has ended.
    """

    def __init__(self, consumer: C, capacity: Capacity, say: Say) -> None:
        self.consumer = consumer
        self.taken = self.left_out = 0
        self.opening: Future[None] = Future()
        self.ending: Future[None] = Future()
        self._capacity, self._say = capacity, say
        self._waiting: deque[Any] = deque()
        self._behind = 0
        self._news = threading.Condition()
        self._ready = self._is_idle = False
        self._asked: float | None = None
        self._tended = time.monotonic()
        self._deadline: float | None = None
        self._thread = threading.Thread(
            target=self._run, name=f"tomoskin-{consumer.name}", daemon=True
        )

    def start(self) -> None:
        """Open the consumer, without waiting for it."""
        self._thread.start()

    def put(self, message: Any) -> None:
        """Have ``message`` taken; returns at once."""
        item = self.consumer.admit(message)
        if item is None:
            return
        with self._news:
            if self.ending.done() or self._deadline is not None:
                return
            if not self._ready and not self.consumer.durable(item):
                self.left_out += 1
                return
            lost = self._add(item)
            first = lost > 0 and self._behind == 0
            self.left_out += lost
            self._behind += lost
            if self._is_idle:
                self._news.notify()
        if first:
            self._tell("behind", self.consumer.slow)

    def end(self) -> None:
        """Take no more, and stop when all that waits was taken or the grace is over."""
        with self._news:
            self._deadline = time.monotonic() + self._capacity.grace
            self._news.notify()

    def join(self) -> None:
        """Return when it has ended, or leave it to itself when it does not."""
        if self._thread.ident is None:
            return
        remaining = (self._deadline or 0.0) + _PATIENCE - time.monotonic()
        self._thread.join(None if math.isinf(remaining) else max(remaining, 0.0))
        if self._thread.is_alive():
            self._tell("stuck", "does not answer, and tomoskin no longer waits for it")

    @property
    def silent(self) -> float:
        """Seconds since which the consumer has not come back from a call."""
        asked = self._asked
        return 0.0 if asked is None else time.monotonic() - asked

    def _add(self, item: Any) -> int:
        """Let ``item`` wait; how many messages are left out for it."""
        most, waiting = self._capacity.most, self._waiting
        if self._capacity.keeps == "oldest" and len(waiting) >= most:
            return 1
        waiting.append(item)
        lost = 0
        while len(waiting) > most:
            with contextlib.suppress(IndexError):  # it has been taken at this very moment
                waiting.popleft()
                lost += 1
        return lost

    def _run(self) -> None:
        try:
            while (pause := self._serve()) is not None:
                with self._news:
                    if self._news.wait_for(lambda: self._deadline is not None, pause):
                        break
        finally:
            with self._news:
                self._waiting.clear()
                self.ending.set_result(None)
            if not self.opening.done():
                self.opening.set_exception(SinkError("was never opened", where=self.consumer.name))

    def _serve(self) -> float | None:
        """Until the end, or until it fails: seconds until the next attempt."""
        consumer = self.consumer
        try:
            self._call(consumer.open)
            self._ready = True
            if not self.opening.done():
                self.opening.set_result(None)
            if consumer.ready:
                self._tell("open", consumer.ready)
            while (item := self._next()) is not None:
                self._call(consumer.take, item)
                self.taken += 1
                if self._behind and not self._waiting:
                    self._report_gap()
            self._call(consumer.close)
        except Exception as error:
            pause = self._recover(error)
            with contextlib.suppress(Exception):  # it may be what has failed
                self._call(consumer.close)
            return pause
        return None

    def _recover(self, error: Exception) -> float | None:
        """What waits and is of no worth later is left out."""
        with self._news:
            self._ready = False
            kept = deque(filter(self.consumer.durable, self._waiting))
            self.left_out += len(self._waiting) - len(kept)
            self._waiting = kept
        pause = self.consumer.handle_failure(error)
        if pause is None and not self.opening.done():
            self.opening.set_exception(error)
        return pause

    def _call(self, function: Callable[..., None], *arguments: Any) -> None:
        """Ask the consumer for something, and note since when."""
        self._asked = time.monotonic()
        try:
            function(*arguments)
        finally:
            self._asked = None

    def _next(self) -> Any:
        """What is to be taken now; None: no more."""
        while self._deadline is None or time.monotonic() <= self._deadline:
            if time.monotonic() > self._tended + _ROUTINE:
                self._call(self.consumer.tend)
                self._tended = time.monotonic()
            try:
                return self._waiting.popleft()  # needs no lock
            except IndexError:
                if not self._wait():
                    return None
        return None

    def _wait(self) -> bool:
        """Wait for messages, until the routine is due; False where there will be no more."""
        patience, gathering = self._tended + _ROUTINE - time.monotonic(), self.consumer.gathering
        with self._news:
            if gathering:
                self._news.wait_for(lambda: self._deadline is not None, min(gathering, patience))
            else:
                self._is_idle = True
                self._news.wait_for(lambda: self._waiting or self._deadline is not None, patience)
                self._is_idle = False
            return bool(self._waiting) or self._deadline is None

    def _report_gap(self) -> None:
        with self._news:
            count, self._behind = self._behind, 0
        self._tell("gap", f"{count} messages were left out")

    def _tell(self, kind: str, text: str) -> None:
        text = f"{self.consumer.name} {text}"
        _log.log(logging.INFO if kind == "open" else logging.WARNING, "%s", text)
        self._say(f"{self.consumer.kind}-{kind}", text)


def stop_workers(workers: Iterable[Worker[Any]]) -> None:
    """Let each consumer take what waits within its grace, and return when all have ended."""
    ending = tuple(workers)
    for worker in ending:
        worker.end()
    for worker in ending:
        worker.join()
