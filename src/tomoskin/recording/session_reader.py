"""Reading a session file: what it holds, message by message, and its frames as a recording."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np

from tomoskin.core import DataError, Detection, Event, SkinError, Touch
from tomoskin.recording import channels
from tomoskin.recording.container_reader import ContainerReader
from tomoskin.recording.layout import MarkedFrame, decode_frame, decode_raw
from tomoskin.recording.parts import Message, Totals
from tomoskin.recording.writer import ABOUT, FORMAT, SKIN_FILE
from tomoskin.skin import Skin

_NO_CELLS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Truth:
    """What pressed on the twin from ``host_time`` on, and how it was bent: fields by name."""

    host_time: float
    presses: tuple[dict[str, Any], ...]
    bends: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedTouches:
    """Touches of the frame ``sequence``; which cells they covered is not in the file."""

    host_time: float
    sequence: int
    touches: tuple[Touch, ...]


class SessionReader:
    """A session file, open for reading; a context manager.

    Iterators read as they go: memory does not grow with the file. Times are host monotonic
    seconds, as they were when it was recorded.

    Attributes
    ----------
    path
        The file.
    skin
        The skin that it was recorded with.
    epoch
        What is added to a host time to give seconds since 1970; 0 when it was not said.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, or is damaged; from every method.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = ContainerReader(path)
        try:
            about = self._about()
            self.epoch = _epoch(about, str(path))
            self.skin = self._skin()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        """The reader itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    @property
    def torn(self) -> str:
        """What is missing at the end, in a sentence, or ""; whole once everything was read."""
        return self._file.torn

    @cached_property
    def totals(self) -> Totals | None:
        """Messages by channel and log times, from the index; None in a file without its end."""
        return self._file.totals()

    def log_time(self, host_time: float) -> int:
        """Ns at which something at ``host_time`` is logged."""
        seconds = host_time + self.epoch
        return round(1e9 * seconds) if seconds > 0 else 0

    def counts(self) -> dict[str, int]:
        """Messages by topic; goes through a file without its end."""
        if self.totals:
            found = self.totals.counts
        else:
            found = Counter(m.channel for m in self._file.messages(frozenset(channels.TOPICS)))
        return {topic: found.get(number, 0) for number, topic in channels.TOPICS.items()}

    def attachments(self) -> dict[str, bytes]:
        """Files inside by their name."""
        return {found.name: found.data for found in self._file.attachments()}

    def frames(self, since: float | None = None) -> Iterator[MarkedFrame]:
        """Frames, from host time ``since`` on."""
        for message in self._messages(channels.FRAMES, since):
            yield decode_frame(message.data, self._place(message))

    def raw(self, since: float | None = None) -> Iterator[tuple[float, bytes]]:
        """(host time, bytes as they were read from the source)."""
        for message in self._messages(channels.RAW, since):
            yield decode_raw(message.data, self._place(message))

    def reads(self, since: float | None = None) -> Iterator[tuple[float, bytes] | MarkedFrame]:
        """Raw bytes, each followed by the frames that they completed, as they were recorded."""
        start = 0 if since is None else self.log_time(since)
        for message in self._file.messages(frozenset({channels.RAW, channels.FRAMES}), start):
            decode = decode_raw if message.channel == channels.RAW else decode_frame
            yield decode(message.data, self._place(message))

    def touches(self) -> Iterator[RecordedTouches]:
        """Touches of every frame that had some, or none after some."""
        for item in self._documents(channels.TOUCHES):
            touches = tuple(map(_touch, item["touches"]))
            yield RecordedTouches(item["host_time"], item["sequence"], touches)

    def truth(self) -> Iterator[Truth]:
        """The twin's presses and bends, each time that they changed."""
        for item in self._documents(channels.TRUTH):
            yield Truth(item["host_time"], tuple(item["presses"]), tuple(item.get("bends", ())))

    def events(self) -> Iterator[Event]:
        """What happened."""
        return (_event(item) for item in self._documents(channels.EVENTS))

    def notes(self) -> Iterator[Event]:
        """What a person remarked."""
        return (_event(item) for item in self._documents(channels.NOTES))

    def device(self) -> dict[str, Any]:
        """What the board last said of itself; empty when it did not."""
        return self._last(channels.DEVICE)

    @property
    def tick_rate(self) -> float:
        """Of the device's clock, Hz, as the board said; the skin's where it did not."""
        said = self.device().get("tick_rate")
        if isinstance(said, int | float) and 0 < said < math.inf:
            return float(said)
        return self.skin.readout.tick_rate

    def clock(self) -> dict[str, Any]:
        """The last fit of the device's clock."""
        return self._last(channels.CLOCK)

    def settings(self) -> dict[str, Any]:
        """How the run was set."""
        return self._last(channels.SETTINGS)

    @property
    def touches_before(self) -> int:
        """The last identity that a touch had in the run before this recording began."""
        said = self.settings().get("touches_before", 0)
        return said if isinstance(said, int) and said >= 0 else 0

    @property
    def n_frames(self) -> int:
        """Number of frames by the index; 0 where there is none."""
        return self.totals.counts.get(channels.FRAMES, 0) if self.totals else 0

    def counted_frames(self) -> Iterator[MarkedFrame]:
        """All frames; DataError at the end when some that were written are missing."""
        count = 0
        for count, item in enumerate(self.frames(), start=1):  # noqa: B007
            yield item
        expected = self.totals.counts.get(channels.FRAMES, 0) if self.totals else count
        if count != expected:
            raise DataError(
                f"is damaged: {expected} frames were written, {count} are there",
                where=str(self.path),
            )

    def _about(self) -> dict[str, str]:
        about = self._file.describes().get(ABOUT)
        if about is None:
            raise DataError("is an MCAP file, but no session of tomoskin", where=str(self.path))
        if about.get("format") != str(FORMAT):
            raise DataError(
                f"expected a session of format {FORMAT}, got {about.get('format')}",
                where=str(self.path),
                hint="it was written by another version of tomoskin",
            )
        return about

    def _skin(self) -> Skin:
        for found in self._file.attachments():
            if found.name == SKIN_FILE:
                try:
                    return Skin.from_toml(found.data.decode(), source=f"{self.path}, {SKIN_FILE}")
                except (SkinError, UnicodeDecodeError) as error:
                    raise DataError(f"holds a skin that is none: {error}",
                                    where=str(self.path)) from error  # fmt: skip
        raise DataError(f"holds no skin{self._but()}", where=str(self.path))

    def _but(self) -> str:
        return f"; it {self.torn}" if self.torn else ""

    def _messages(self, channel: int, since: float | None = None) -> Iterator[Message]:
        start = 0 if since is None else self.log_time(since)
        return self._file.messages(frozenset({channel}), start)

    def _documents(self, channel: int) -> Iterator[dict[str, Any]]:
        return map(self._document, self._rare(channel))

    def _rare(self, channel: int) -> Iterator[Message]:
        if self.totals and not self.totals.counts.get(channel):
            return iter(())
        return self._file.rare(channel)

    def _document(self, message: Message) -> dict[str, Any]:
        try:
            return msgspec.json.decode(message.data, type=dict[str, Any])
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            topic = channels.TOPICS[message.channel]
            raise DataError(f"a message of {topic} is not understood: {error}",
                            where=self._place(message)) from error  # fmt: skip

    def _last(self, channel: int) -> dict[str, Any]:
        last = deque(self._rare(channel), maxlen=1)
        return self._document(last[0]) if last else {}

    def _place(self, message: Message) -> str:
        return f"{self.path}, chunk at byte {message.chunk}"


def _epoch(about: dict[str, str], where: str) -> float:
    try:
        return float(about["epoch_s"])
    except (KeyError, ValueError) as error:
        raise DataError("does not say when its clock began", where=where) from error


def _event(item: dict[str, Any]) -> Event:
    return Event(item["host_time"], item["name"], item["message"])


def _touch(item: dict[str, Any]) -> Touch:
    sd_x, sd_y = (float("nan") if item[k] is None else item[k] for k in ("sd_x", "sd_y"))
    place = item["x"], item["y"], sd_x, sd_y, item["area"], item["peak"], _NO_CELLS
    cov_xy, close, merged = (item.get(k) for k in ("cov_xy", "close", "merged"))  # format 1.0: none
    reading = Detection(*place, cov_xy=cov_xy or 0.0, close=bool(close))
    return Touch(item["id"], item["kind"], item["since"], reading, tuple(merged or ()))
