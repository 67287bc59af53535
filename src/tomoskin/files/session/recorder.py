"""What a run says, written to a session file as it comes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tomoskin.board.source import ClockFitter
from tomoskin.board.wire import Info
from tomoskin.core import DataError, Event, Image, Mark, MarkedFrame, PixelMap, StrPath, Touch
from tomoskin.files.session.layout import Truth
from tomoskin.files.session.session_writer import SessionWriter
from tomoskin.pipeline import FrameResult
from tomoskin.sensing.track import TouchEvent

IMAGE_PERIOD = 0.2
"""Seconds between two images in the file, by host time."""

CLOCK_PERIOD = 10.0
"""Seconds between two fits of the device's clock."""

_OBJECT = 256
"""Bytes that a waiting message is taken for, beside its data."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RawRead:
    """Bytes as one read of the source returned them."""

    host_time: float
    data: bytes


@dataclass(frozen=True, slots=True)
class BoardInfo:
    """What the board says that it is, and what it calls itself."""

    host_time: float
    info: Info
    name: str = ""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How the run is set: plain values by name."""

    host_time: float
    values: Mapping[str, Any]


RunMessage = RawRead | MarkedFrame | FrameResult | Event | Truth | BoardInfo | RunSettings
"""All that a run says, in the order of what happens: the bytes of a read, each frame of it with
what becomes of it, then its result. A person's remark is an event of the kind "note"."""


def event_of(happened: TouchEvent) -> Event:
    """What happened to a touch as an event: "touch-onset", "touch-move", "touch-release", …"""
    return Event(happened.host_time, f"touch-{happened.kind}", happened.text)


@dataclass(frozen=True, slots=True, eq=False)
class _Outcome:
    """What is kept of a result; None: not worth a message."""

    host_time: float
    sequence: int
    touches: tuple[Touch, ...] | None
    image: Image | None
    events: tuple[Event, ...]
    shown: tuple[Touch, ...]


class Recorder:
    """Takes the messages of a run into a session file; a consumer of a worker of its own.

    When the file cannot be written any further the recording ends, which is said; the file stays
    readable.

    Parameters
    ----------
    path
        The file.
    make
        Opens the session at ``path``; called once, by the worker's thread. DataError when the
        file cannot be made.
    pixels
        For the images; None where the skin has none (a curved sheet): then there are no images.
    say
        Called with the kind and text of an event.
    """

    kind = "recording"
    slow, ready = "the disk is too slow, and messages are lost", ""

    def __init__(
        self,
        path: StrPath,
        make: Callable[[], SessionWriter],
        pixels: PixelMap | None,
        say: Callable[[str, str], None],
    ) -> None:
        path = Path(path)
        self.path, self.name = path, f"{path}:"
        self._make, self._pixels, self._say = make, pixels, say
        self._session: SessionWriter
        self._made = self._broken = False
        self._last_image = float("-inf")
        self._had_touches = False
        self._clock, self._next_fit = ClockFitter(), float("-inf")

    def admit(self, message: RunMessage) -> RunMessage | _Outcome | None:
        """What of ``message`` is to be written; by the thread that puts it."""
        if not isinstance(message, FrameResult):
            return message
        touches, image = None, None
        if message.ready:
            touches = message.touches if message.touches or self._had_touches else None
            self._had_touches = bool(message.touches)
            image = message.image if self._image_is_due(message.host_time) else None
        events = tuple(map(event_of, message.events))
        if touches is None and image is None and not events:
            return None
        return _Outcome(
            message.host_time, message.sequence, touches, image, events, message.touches
        )

    def size(self, item: RunMessage | _Outcome) -> int:
        """Bytes that it takes while it waits."""
        match item:
            case RawRead():
                return _OBJECT + len(item.data)
            case MarkedFrame():
                return _OBJECT + item.frame.samples.nbytes
            case _Outcome():
                image = item.image.values.nbytes if item.image is not None else 0
                return _OBJECT + image + 200 * len(item.shown)
            case Truth():
                return _OBJECT + 100 * (len(item.presses) + len(item.bends))
            case _:
                return _OBJECT

    def durable(self, item: object) -> bool:
        """All is written, what came before the file was open too."""
        del item
        return True

    def open(self) -> None:
        """Make the file. Raises DataError."""
        self._session, self._made = self._make(), True

    def take(self, item: RunMessage | _Outcome) -> None:
        """Write one message. Raises DataError."""
        session = self._session
        match item:
            case RawRead():
                session.raw(item.host_time, item.data)
            case MarkedFrame():
                self._fit_clock(item)
                session.frame(item.frame, item.mark)
            case _Outcome():
                self._write_outcome(item)
            case Event(kind="note"):
                session.note(item.host_time, item.text)
            case Event():
                session.event(item)
            case Truth():
                session.truth(item.host_time, item.presses, item.bends)
            case BoardInfo():
                session.device(item.host_time, item.info, item.name)
            case RunSettings():
                session.settings(item.host_time, item.values)

    def tend(self) -> None:
        """Write the open chunk, to lose a second at most. Raises DataError."""
        self._session.settle()

    def close(self) -> None:
        """End the file. Raises DataError."""
        if self._made:
            self._session.close()
            if not self._broken:
                self._say("recorded", f"recorded to {self.path}")

    def handle_failure(self, error: Exception) -> None:
        """The recording ends here; what could be written is in the file."""
        self._broken = True
        if not self._made:
            return  # whoever asked for it is told
        why = str(error)
        if not isinstance(error, DataError):
            _log.exception("the recording thread ended", exc_info=error)
            why = f"internal error, {type(error).__name__}: {error}"
        self._say("recording-stopped", f"the recording has ended: {why}")

    def _write_outcome(self, item: _Outcome) -> None:
        session = self._session
        if item.touches is not None:
            session.touches(item.host_time, item.sequence, item.touches)
        if item.image is not None and self._pixels is not None:
            session.image(item.host_time, item.image, self._pixels, item.shown)
        for event in item.events:
            session.event(event)

    def _fit_clock(self, item: MarkedFrame) -> None:
        """Now and then a fit of the device's clock."""
        frame = item.frame
        if item.mark & Mark.EARLIER:
            return
        self._clock.add(frame.ticks, frame.host_time)
        if frame.host_time >= self._next_fit and (fit := self._clock.fit) is not None:
            self._session.clock(frame.host_time, fit)
            self._next_fit = frame.host_time + CLOCK_PERIOD

    def _image_is_due(self, host_time: float) -> bool:
        """Whether a period has gone by, or the time has been set back."""
        if self._pixels is None or 0 <= host_time - self._last_image < IMAGE_PERIOD:
            return False
        self._last_image = host_time
        return True
