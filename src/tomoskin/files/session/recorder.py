"""What a run says, written to a session file as it comes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tomoskin.board.source import ClockFitter
from tomoskin.board.wire import Info
from tomoskin.core import Consumer, DataError, Event, Mark, MarkedFrame, PixelMap, StrPath
from tomoskin.files.messages import Every, event_of
from tomoskin.files.session.layout import RecordedTouches, Truth
from tomoskin.files.session.session_writer import SessionWriter
from tomoskin.pipeline import FrameResult

IMAGE_PERIOD = 0.2
"""Seconds between two images in the file, by host time."""

CLOCK_PERIOD = 10.0
"""Seconds between two fits of the device's clock."""

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


_Part = RunMessage | RecordedTouches
"""What becomes one record of the file, or an image and its touches."""


class Recorder(Consumer):
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
    most
        Frames that are recorded, where not all are.

    Attributes
    ----------
    frames
        How many have come, those from before the recording not counted.
    """

    kind, slow = "recording", "the disk is too slow, and messages are lost"
    gathering = 0.1

    def __init__(
        self,
        path: StrPath,
        make: Callable[[], SessionWriter],
        pixels: PixelMap | None,
        say: Callable[[str, str], None],
        most: int | None = None,
    ) -> None:
        path = Path(path)
        self.frames, self._most = 0, most
        self.path, self.name = path, f"{path}:"
        self._make, self._pixels, self._say = make, pixels, say
        self._session: SessionWriter
        self._made = self._broken = False
        self._image_is_due = Every(IMAGE_PERIOD)
        self._had_some = False
        self._clock, self._next_fit = ClockFitter(), float("-inf")

    def admit(self, message: RunMessage) -> list[_Part] | None:
        """What of ``message`` is to be written; by the thread that puts it."""
        if isinstance(message, MarkedFrame):
            self.frames += not message.mark & Mark.EARLIER
        if self._most is not None and self.frames > self._most:
            return None
        if not isinstance(message, FrameResult):
            return [message]
        parts: list[_Part] = []
        if message.ready:
            state = message.touches, message.deformation
            if any(state) or self._had_some:
                parts.append(RecordedTouches(message.host_time, message.sequence, *state))
            self._had_some = any(state)
            if self._pixels is not None and self._image_is_due(message.host_time):
                parts.append(message)
        parts += map(event_of, message.events)
        return parts or None

    def open(self) -> None:
        """Make the file. Raises DataError."""
        self._session, self._made = self._make(), True

    def take(self, item: list[_Part]) -> None:
        """Write what was admitted of one message. Raises DataError."""
        session = self._session
        for part in item:
            match part:
                case RawRead():
                    session.raw(part.host_time, part.data)
                case MarkedFrame():
                    self._fit_clock(part)
                    session.frame(part.frame, part.mark)
                case RecordedTouches():
                    session.touches(part.host_time, part.sequence, part.touches, part.deformation)
                case FrameResult() if self._pixels is not None:
                    session.image(part.host_time, part.image, self._pixels, part.touches)
                case Event():
                    session.event(part)
                case Truth():
                    session.truth(part.host_time, part.presses, part.bends)
                case BoardInfo():
                    session.device(part.host_time, part.info, part.name)
                case RunSettings():
                    session.settings(part.host_time, part.values)

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

    def _fit_clock(self, item: MarkedFrame) -> None:
        """Now and then a fit of the device's clock."""
        frame = item.frame
        if item.mark & Mark.EARLIER:
            return
        self._clock.add(frame.ticks, frame.host_time)
        if frame.host_time >= self._next_fit and (fit := self._clock.fit) is not None:
            self._session.clock(frame.host_time, fit)
            self._next_fit = frame.host_time + CLOCK_PERIOD
