"""Recording beside a running pipeline: a queue of bounded size, and a thread that empties it."""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tomoskin.core import DataError, Event, Frame, Image, PixelMap, Touch
from tomoskin.recording.clock import ClockFitter
from tomoskin.recording.layout import Mark
from tomoskin.recording.writer import SessionWriter

MOST_WAITING = 64 << 20
"""Bytes that may wait for the disk: about a minute of the fastest board."""

IMAGE_PERIOD = 0.2
"""Seconds between two images in the file, by host time."""

CLOCK_PERIOD = 10.0
"""Seconds between two fits of the device's clock."""

_ROUTINE = 1.0
"""Seconds after which the thread looks after the file though nothing came."""

_OBJECT = 256
"""Bytes that a waiting message is taken for, beside its data."""


_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Task:
    size: int
    write: Callable[..., None]
    arguments: tuple[Any, ...]


class Recorder:
    """Records to ``session`` from a thread of its own; no call waits for the disk.

    When the disk cannot keep up, messages are left out, counted and said. When the file cannot be
    written any further the recording ends, which is said too; the file stays readable.

    Parameters
    ----------
    session
        An open session; closed by :meth:`stop`, or when writing fails.
    pixels
        For the images; None where the skin has none (a curved sheet): then there are no images.
    say
        Called with the kind and text of an event, from either thread.
    """

    def __init__(
        self,
        session: SessionWriter,
        pixels: PixelMap | None,
        say: Callable[[str, str], None],
        *,
        most_waiting: int = MOST_WAITING,
    ) -> None:
        self.path = session.path
        self.left_out = 0
        self._session, self._pixels, self._say = session, pixels, say
        self._limit = most_waiting
        self._queue: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._put_lock = threading.Lock()
        self._came = self._went = 0
        self._behind = 0
        self._last_image = float("-inf")
        self._had_touches = False
        self._clock, self._next_fit = ClockFitter(), float("-inf")
        self._failed = False
        self._thread = threading.Thread(target=self._run, name="tomoskin-recorder", daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether what comes is still written."""
        return self._thread.is_alive() and not self._failed

    @property
    def is_whole(self) -> bool:
        """Whether it was stopped, and not by the disk."""
        return not self._thread.is_alive() and not self._failed

    def raw(self, host_time: float, data: bytes) -> None:
        """Bytes as they were read."""
        self._put(len(data), self._session.raw, host_time, data)

    def frame(self, frame: Frame, mark: Mark) -> None:
        """One frame, and what becomes of it; after the raw bytes that it came in."""
        if not mark & Mark.EARLIER:
            self._clock.add(frame.ticks, frame.host_time)
            self._fit_clock(frame.host_time)
        self._put(frame.samples.nbytes, self._session.frame, frame, mark)

    def result(
        self, host_time: float, sequence: int, image: Image, touches: Sequence[Touch]
    ) -> None:
        """What was made of a frame: its touches, and now and then its image."""
        if touches or self._had_touches:
            self._put(200 * len(touches), self._session.touches, host_time, sequence, touches)
        self._had_touches = bool(touches)
        if self._pixels is None or not self._image_is_due(host_time):
            return
        size = image.values.nbytes
        self._put(size, self._session.image, host_time, image, self._pixels, touches)

    def event(self, event: Event) -> None:
        """Something that happened."""
        self._put(len(event.text), self._session.event, event)

    def note(self, host_time: float, text: str) -> None:
        """A person's remark."""
        self._put(len(text), self._session.note, host_time, text)

    def truth(self, host_time: float, presses: Sequence[Any], bends: Sequence[Any] = ()) -> None:
        """What presses on the twin, and how it is bent, from now on."""
        size = 100 * (len(presses) + len(bends))
        self._put(size, self._session.truth, host_time, presses, bends)

    def device(self, host_time: float, info: Any) -> None:
        """What the board is."""
        self._put(0, self._session.device, host_time, info)

    def settings(self, host_time: float, settings: Mapping[str, Any]) -> None:
        """How the run is set."""
        self._put(0, self._session.settings, host_time, settings)

    def stop(self) -> None:
        """Write what waits, end the file and return; a second call does nothing."""
        self._queue.put(None)
        self._thread.join()

    def _fit_clock(self, host_time: float) -> None:
        """Now and then a fit of the device's clock."""
        if host_time >= self._next_fit and (fit := self._clock.fit) is not None:
            self._put(0, self._session.clock, host_time, fit)
            self._next_fit = host_time + CLOCK_PERIOD

    def _image_is_due(self, host_time: float) -> bool:
        """Whether a period has gone by, or the time has been set back."""
        if 0 <= host_time - self._last_image < IMAGE_PERIOD:
            return False
        self._last_image = host_time
        return True

    def wait_until_written(self) -> None:
        """Return when nothing waits for the disk any more."""
        done = threading.Event()
        self._put(0, done.set)
        while not done.wait(_ROUTINE) and self.running:
            pass

    def _put(self, size: int, write: Callable[..., None], *arguments: Any) -> None:
        with self._put_lock:
            if self._failed:
                return
            size += _OBJECT
            if self._came - self._went + size > self._limit:
                self._leave_out()
                return
            self._came += size
            self._queue.put(_Task(size, write, arguments))

    def _leave_out(self) -> None:
        self.left_out += 1
        self._behind += 1
        if self._behind == 1:
            self._say("recording-behind", f"{self.path}: the disk is too slow, messages are lost")

    def _run(self) -> None:
        try:
            while (task := self._next()) is not None:
                task.write(*task.arguments)
                self._went += task.size
                if self._behind and self._came == self._went:
                    self._caught_up()
            self._session.close()
        except DataError as error:
            self._fail(str(error))
        except Exception as error:
            _log.exception("the recording thread ended")
            self._fail(f"internal error, {type(error).__name__}: {error}")

    def _next(self) -> _Task | None:
        while True:
            try:
                return self._queue.get(timeout=_ROUTINE)
            except queue.Empty:
                self._session.settle()

    def _caught_up(self) -> None:
        with self._put_lock:
            count, self._behind = self._behind, 0
        self._say("recording-gap", f"{self.path}: {count} messages were not recorded")

    def _fail(self, why: str) -> None:
        with self._put_lock:
            self._failed = True
        with contextlib.suppress(DataError):  # what could be written is in the file
            self._session.close()
        while not self._queue.empty():
            self._queue.get()
        self._say("recording-stopped", f"the recording has ended: {why}")
