"""Reading a session file: what it holds, message by message."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from tomoskin.board.source import TICK_RATES
from tomoskin.core import DataError, Event, Mark, MarkedFrame, SkinError, StrPath
from tomoskin.files.session import channels, layout
from tomoskin.files.session.container_reader import MEND, ContainerReader
from tomoskin.files.session.mcap_records import LoggedMessage
from tomoskin.files.session.session_writer import ABOUT, FORMAT, SKIN_FILE, SKINS
from tomoskin.model.skin import Skin

T = TypeVar("T")
_RAW, _FRAMES = frozenset({channels.RAW}), frozenset({channels.FRAMES})


class SessionReader(AbstractContextManager["SessionReader"]):
    """A session file, or that of one ``skin`` of a robot's recording, open for reading.

    Iterators read as they go: memory does not grow with the file. Times are host monotonic
    seconds, as they were when it was recorded.

    Attributes
    ----------
    path
        The file.
    name
        Which of a robot's skins it is; "" where there is no robot.
    skin
        The skin that it was recorded with.
    epoch
        What is added to a host time to give seconds since 1970; 0 where the file does not say.
    container
        The MCAP file itself.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, or is damaged; from every method.
    """

    def __init__(self, path: StrPath, skin: str = "") -> None:
        self.path, self.name = Path(path), skin
        self.container = ContainerReader(self.path)
        try:
            if skin:
                self.container = _part(self.container, skin)
            self.epoch = _epoch(self.container)
            self.skin = _skin(self.container)
        except BaseException:
            self.close()
            raise

    def __exit__(self, *_: object) -> None:
        """Close the file; nothing can be read afterwards."""
        self.close()

    def close(self) -> None:
        """Close the file; nothing can be read afterwards."""
        self.container.close()

    @property
    def torn(self) -> str:
        """What is missing at the end, in a sentence, or ""; complete once everything was read."""
        return self.container.torn

    def attachments(self) -> dict[str, bytes]:
        """The attached files by their names."""
        return {attachment.name: attachment.data for attachment in self.container.attachments()}

    def frames(self, since: float | None = None) -> Iterator[MarkedFrame]:
        """Frames, from host time ``since`` on."""
        for message in self.container.messages(_FRAMES, _log_time(self, since)):
            yield layout.decode_frame(message.data, _place(self, message))

    def raw(self, since: float | None = None) -> Iterator[tuple[float, bytes]]:
        """(host time, bytes as they were read from the source)."""
        for message in self.container.messages(_RAW, _log_time(self, since)):
            yield layout.decode_raw(message.data, _place(self, message))

    def reads(self, since: float | None = None) -> Iterator[tuple[float, bytes] | MarkedFrame]:
        """Raw bytes, each followed by the frames that they completed, as they were recorded."""
        for message in self.container.messages(_RAW | _FRAMES, _log_time(self, since)):
            decode = layout.decode_raw if message.channel == channels.RAW else layout.decode_frame
            yield decode(message.data, _place(self, message))

    def touches(self) -> Iterator[layout.RecordedTouches]:
        """Touches of every frame that had some, or none after some."""
        return _documents(self, channels.TOUCHES, layout.touches_of)

    def truth(self) -> Iterator[layout.Truth]:
        """The twin's presses and bends, each time that they changed."""
        return _documents(self, channels.TRUTH, layout.truth_of)

    def events(self) -> Iterator[Event]:
        """The events of the run, in their order."""
        return _documents(self, channels.EVENTS, layout.event_of)

    def notes(self) -> Iterator[Event]:
        """The notes that a person made."""
        return _documents(self, channels.NOTES, layout.event_of)

    def device(self) -> dict[str, Any]:
        """What the board last said of itself; empty when it did not."""
        return _last(self, channels.DEVICE)

    def clock(self) -> dict[str, Any]:
        """The last fit of the device's clock."""
        return _last(self, channels.CLOCK)

    def settings(self) -> dict[str, Any]:
        """The settings of the run, as they were last."""
        return _last(self, channels.SETTINGS)


def skins_in(path: StrPath) -> tuple[str, ...]:
    """Names of the skins in a recording of several; ("",) of one alone. Raises DataError."""
    with closing(ContainerReader(Path(path))) as container:
        return _skins(container) or ("",)


def tick_rate(session: SessionReader) -> float:
    """Of the device's clock, Hz; see :func:`stated_rate`."""
    return stated_rate(session.device(), session.skin)


def stated_rate(device: Mapping[str, Any], skin: Skin) -> float:
    """The tick rate that a board states of itself, Hz; the skin's where that cannot be."""
    rate = device.get("tick_rate")
    if isinstance(rate, int | float) and TICK_RATES[0] <= rate <= TICK_RATES[1]:
        return float(rate)
    return skin.readout.tick_rate


def touches_before(session: SessionReader) -> int:
    """The last identity that a touch had in the run before this recording began."""
    number = session.settings().get("touches_before", 0)
    return number if isinstance(number, int) and number >= 0 else 0


_USUAL = 20
"""Frames that make a reference, where a session does not say."""


def reference_frames(settings: Mapping[str, Any]) -> int:
    """Frames that make a reference, by the ``settings`` of a session."""
    count = settings.get("reference_frames")
    return count if isinstance(count, int) and count > 0 else _USUAL


def message_counts(session: SessionReader) -> dict[str, int]:
    """Messages by topic; goes through a file without its end."""
    counts = _indexed(session)
    if session.container.summary is None:
        every = session.container.messages(frozenset(channels.TOPICS))
        counts = Counter(message.channel for message in every)
    return {topic: counts.get(number, 0) for number, topic in channels.TOPICS.items()}


def indexed_frames(session: SessionReader) -> int:
    """Number of frames by the index; 0 where there is none."""
    return _indexed(session).get(channels.FRAMES, 0)


def _indexed(session: SessionReader) -> dict[int, int]:
    """Messages by channel, by the index."""
    summary, first = session.container.summary, session.container.first
    counts = summary.totals.channel_message_counts if summary else {}
    return {channel - first: count for channel, count in counts.items()}


def start_time(session: SessionReader) -> float:
    """Host time of the recording's own first frame; 0 where there is none."""
    own = (item.frame.host_time for item in session.frames() if not item.mark & Mark.EARLIER)
    return next(own, 0.0)


def end_time(session: SessionReader) -> float | None:
    """Host time of the last message by the index; None where there is none."""
    summary = session.container.summary
    return summary.totals.message_end_time / 1e9 - session.epoch if summary else None


def _skins(container: ContainerReader) -> tuple[str, ...]:
    """Names of a robot's skins; none where the recording is of one alone."""
    return tuple((container.description(ABOUT) or {}).get(SKINS, "").split())


def _part(container: ContainerReader, skin: str) -> ContainerReader:
    names = _skins(container)
    if skin not in names:
        held = ", ".join(names) or "a single skin"
        raise DataError(f'expected one of its skins, {held}, got "{skin}"', where=container.where)
    return container.part(skin, channels.SPAN * names.index(skin))


def _epoch(container: ContainerReader) -> float:
    about = container.description(ABOUT)
    if about is None:
        raise DataError("is an MCAP file, but not a session of tomoskin", where=container.where)
    if SKINS in about:
        raise DataError(
            f"holds the sessions of several skins: {about[SKINS]}",
            where=container.where,
            hint=f"tomoskin session split {container.where} makes one file of each",
        )
    if about.get("format") != str(FORMAT):
        raise DataError(
            f"expected a session of format {FORMAT}, got {about.get('format')}",
            where=container.where,
            hint="it was written by another version of tomoskin: use that version",
        )
    epoch = epoch_of(about)
    if epoch is None:
        raise DataError(
            "does not hold the start time of its clock", where=container.where, hint=MEND
        )
    return epoch


def epoch_of(about: Mapping[str, str]) -> float | None:
    """What is added to a host time to give seconds since 1970, where a session says it."""
    try:
        epoch = float(about["epoch_s"])
    except (KeyError, ValueError):
        return None
    return epoch if math.isfinite(epoch) else None


def _skin(container: ContainerReader) -> Skin:
    where = f"{container.where}, {SKIN_FILE}"
    for attachment in container.attachments():
        if attachment.name == SKIN_FILE:
            try:
                return Skin.from_toml(attachment.data.decode(), source=where)
            except (SkinError, UnicodeDecodeError) as error:
                raise DataError(
                    f"holds a skin that cannot be read: {error}", where=container.where
                ) from error
    but = f"; it {container.torn}" if container.torn else ""
    raise DataError(f"holds no skin{but}", where=container.where)


def _log_time(session: SessionReader, host_time: float | None) -> int:
    """Ns at which something at ``host_time`` is logged; 0 for None: from the first."""
    seconds = 0.0 if host_time is None else host_time + session.epoch
    return round(1e9 * seconds) if seconds > 0 else 0


def _documents(
    session: SessionReader, channel: int, convert: Callable[[dict[str, Any]], T]
) -> Iterator[T]:
    for message in session.container.messages(frozenset({channel})):
        yield _document(session, message, convert)


def _last(session: SessionReader, channel: int) -> dict[str, Any]:
    message = session.container.last(channel)
    return _document(session, message, dict) if message else {}


def _document(
    session: SessionReader, message: LoggedMessage, convert: Callable[[dict[str, Any]], T]
) -> T:
    try:
        return convert(msgspec.json.decode(message.data, type=dict[str, Any]))
    except (KeyError, TypeError, ValueError) as error:
        topic = channels.TOPICS[message.channel]
        raise DataError(
            f"a message of {topic} cannot be decoded: {error}", where=_place(session, message)
        ) from error


def _place(session: SessionReader, message: LoggedMessage) -> str:
    return f"{session.path}, chunk at byte {message.chunk}"
