"""Recording beside a running pipeline: what of a run goes into its file, and how often."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tomoskin.core import Event, Frame, Image, PixelMap, Touch
from tomoskin.recording.clock import ClockFitter
from tomoskin.recording.layout import Mark
from tomoskin.recording.session_writer import SessionWriter
from tomoskin.recording.write_queue import WriteQueue

MOST_WAITING = 64 << 20
"""Bytes that may wait for the disk: about a minute of the fastest board."""

IMAGE_PERIOD = 0.2
"""Seconds between two images in the file, by host time."""

CLOCK_PERIOD = 10.0
"""Seconds between two fits of the device's clock."""


class Recorder:
    """Records to ``session`` from a thread of its own; no call waits for the disk.

    When the disk cannot keep up, messages are left out, counted and reported. When the file cannot
    be written any further the recording ends, which is reported too; the file stays readable.

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
        self._session, self._pixels = session, pixels
        self._queue = WriteQueue(session, say, most_waiting)
        self._last_image = float("-inf")
        self._had_touches = False
        self._clock, self._next_fit = ClockFitter(), float("-inf")

    @property
    def running(self) -> bool:
        """Whether what comes is still written."""
        return self._queue.is_running

    @property
    def is_complete(self) -> bool:
        """Whether it was stopped, and not by the disk."""
        return not self._queue.is_running and not self._queue.has_failed

    @property
    def left_out(self) -> int:
        """Messages that were not recorded: the disk was too slow."""
        return self._queue.left_out

    def raw(self, host_time: float, data: bytes) -> None:
        """Bytes as they were read."""
        self._queue.put(len(data), self._session.raw, host_time, data)

    def frame(self, frame: Frame, mark: Mark) -> None:
        """One frame, and what becomes of it; after the raw bytes that it came in."""
        if not mark & Mark.EARLIER:
            self._clock.add(frame.ticks, frame.host_time)
            self._fit_clock(frame.host_time)
        self._queue.put(frame.samples.nbytes, self._session.frame, frame, mark)

    def result(
        self, host_time: float, sequence: int, image: Image, touches: Sequence[Touch]
    ) -> None:
        """What was made of a frame: its touches, and now and then its image."""
        if touches or self._had_touches:
            size = 200 * len(touches)
            self._queue.put(size, self._session.touches, host_time, sequence, touches)
        self._had_touches = bool(touches)
        if self._pixels is None or 0 <= host_time - self._last_image < IMAGE_PERIOD:
            return
        self._last_image = host_time
        size = image.values.nbytes
        self._queue.put(size, self._session.image, host_time, image, self._pixels, touches)

    def event(self, event: Event) -> None:
        """Something that happened."""
        self._queue.put(len(event.text), self._session.event, event)

    def note(self, host_time: float, text: str) -> None:
        """A person's remark."""
        self._queue.put(len(text), self._session.note, host_time, text)

    def truth(self, host_time: float, presses: Sequence[Any], bends: Sequence[Any] = ()) -> None:
        """What presses on the twin, and how it is bent, from now on."""
        size = 100 * (len(presses) + len(bends))
        self._queue.put(size, self._session.truth, host_time, presses, bends)

    def device(self, host_time: float, info: Any) -> None:
        """What the board is."""
        self._queue.put(0, self._session.device, host_time, info)

    def settings(self, host_time: float, settings: Mapping[str, Any]) -> None:
        """How the run is set."""
        self._queue.put(0, self._session.settings, host_time, settings)

    def wait_until_written(self) -> None:
        """Return when nothing waits for the disk any more."""
        self._queue.wait_until_empty()

    def stop(self) -> None:
        """Write what waits, end the file and return; a second call does nothing."""
        self._queue.stop()

    def _fit_clock(self, host_time: float) -> None:
        """Now and then a fit of the device's clock."""
        if host_time >= self._next_fit and (fit := self._clock.fit) is not None:
            self._queue.put(0, self._session.clock, host_time, fit)
            self._next_fit = host_time + CLOCK_PERIOD
