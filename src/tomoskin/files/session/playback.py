"""A recording as it is played: its time line, and where it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain, islice

from tomoskin.board.wire import SCHEMA, Deframer, decode_payload, encode
from tomoskin.core import DataError, DriveSamples, Event, Frame, Mark, MarkedFrame, StrPath
from tomoskin.files.session.session_reader import SessionReader, end_time, start_time
from tomoskin.sensing.track import Span, touch_spans

MOST_SPANS = 2000
"""Touches on it; later ones are left out."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Times in s from the first frame: the end, notes and events in order, touches by onset."""

    end: float
    notes: tuple[tuple[float, Event], ...]
    events: tuple[tuple[float, Event], ...]
    touches: tuple[Span, ...]


def read_timeline(path: StrPath) -> Timeline:
    """Timeline of a session; its touches are those that were recorded.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, is damaged, or holds no frame.
    """
    with SessionReader(path) as session:
        start = start_time(session)

        def timed(events: Iterator[Event]) -> tuple[tuple[float, Event], ...]:
            return tuple((event.host_time - start, event) for event in events)

        touched = ((item.host_time - start, item.touches) for item in session.touches())
        spans = touch_spans(touched)[:MOST_SPANS]
        last = end_time(session)
        end = max((span.end for span in spans), default=0.0) if last is None else last - start
        return Timeline(end, timed(session.notes()), timed(session.events()), spans)


RawBytes = tuple[float, bytes]
Item = RawBytes | MarkedFrame

_LONGEST = 2 * SCHEMA.from_device_bytes
"""Bytes that are kept while a first frame is awaited: more than the longest message has."""

_BEFORE = 1.0
"""Seconds before a moment that are read to find the first byte of its first frame."""


@dataclass(frozen=True, slots=True)
class Piece:
    """What one read returned: the bytes, when, and the frames that were made of them.

    ``follows`` says whether the bytes continue those of the piece before.
    """

    host_time: float
    data: bytes
    follows: bool = True
    frames: list[MarkedFrame] = field(default_factory=list)

    @property
    def is_earlier(self) -> bool:
        """Whether it is from before the recording, or played for the sake of a reference."""
        return any(item.mark & Mark.EARLIER for item in self.frames)

    def mark(self, sequence: int) -> Mark | None:
        """What became of a frame of it; None for one that is not in it."""
        return next((i.mark for i in self.frames if i.frame.sequence == sequence), None)


class Playhead:
    """Where a replay is: the last piece, the next one, and the recorded time between them.

    Parameters
    ----------
    items
        The recorded items from somewhat before a host time on, as :func:`pieces` takes them.

    Attributes
    ----------
    next
        The piece that is played next; None at the end.
    last
        The piece that was played last, or None.
    now
        The time in the recording, host monotonic s: exactly that of the last piece when it has
        just been played.
    damage
        What is wrong with the file where it could be read no further since the last seek, or None.
    """

    def __init__(self, items: Callable[[float], Iterable[Item]]) -> None:
        self._items = items
        self.last: Piece | None = None
        self.now = self._reached = float("-inf")
        self.seek(float("-inf"))
        if self.next is not None:
            self.now = self.next.host_time

    def seek(self, host_time: float, earlier: Iterable[MarkedFrame] = ()) -> None:
        """Go on from the first frame at ``host_time``, if there is one, after those ``earlier``."""
        self.damage: DataError | None = None
        there = self._until_damage(pieces(self._items(host_time - _BEFORE), host_time))
        first = tuple(islice(there, 1))
        before = pieces(earlier if first else ())
        self._pieces = chain(before, first, there)
        self.next: Piece | None = next(self._pieces, None)
        self._reach_next()

    def advance(self, seconds: float) -> float:
        """Let recorded time go by; the seconds that are left until the next piece."""
        self._reached += seconds
        if self.next is None:
            return float("inf")
        self.now = max(self.now, min(self._reached, self.next.host_time))
        return self.next.host_time - self._reached

    def play(self) -> Piece:
        """The next piece, which must be there."""
        assert self.next is not None
        self.last = piece = self.next
        self.now = piece.host_time
        self._reached = max(self._reached, piece.host_time)
        self.next = next(self._pieces, None)
        if piece.is_earlier:
            self._reach_next()
        return piece

    def _until_damage(self, there: Iterator[Piece]) -> Iterator[Piece]:
        """A damaged file ends where it can be read no further."""
        try:
            yield from there
        except DataError as error:
            self.damage = error

    def _reach_next(self) -> None:
        """Recorded time goes on from the next piece, however far it is."""
        if self.next is not None:
            self._reached = self.next.host_time


def pieces(items: Iterable[Item], since: float = float("-inf")) -> Iterator[Piece]:
    """Pieces from the first frame at ``since`` on.

    ``items`` are raw bytes, each followed by the frames that they completed, from somewhat before
    ``since``. The first piece begins with that frame's first byte. A frame whose raw bytes were
    not recorded is encoded again, to the bytes that the board sent.
    """
    reads = _reads(items)
    early = b""
    follows = False
    for read in reads:
        later = [item.frame for item in read.frames if item.frame.host_time >= since]
        if not read.follows:
            if later:
                yield read
                follows, early = False, b""
        elif follows:
            yield read
        elif later:
            data = _from_frame(early + read.data, later[0])
            yield replace(read, data=data, follows=False)
            follows, early = True, b""
        else:
            early = (early + read.data)[-_LONGEST:]


def _reads(items: Iterable[Item]) -> Iterator[Piece]:
    """Each read with the frames of it, in the order of the file; it follows if it was recorded."""
    current: Piece | None = None
    for item in items:
        if not isinstance(item, MarkedFrame):
            if current is not None:
                yield current
            current = Piece(*item)
        elif current is not None and item.frame.host_time == current.host_time:
            current.frames.append(item)
        else:
            if current is not None:
                yield current
            current = None
            yield Piece(item.frame.host_time, encode(item.frame), follows=False, frames=[item])
    if current is not None:
        yield current


def _from_frame(data: bytes, frame: Frame) -> bytes:
    """The part of ``data`` that begins with the message of ``frame``; all where it is not found."""
    place = 0
    while (end := data.find(b"\0", place)) >= 0:
        for payload in Deframer(SCHEMA.from_device_bytes).feed(data[place : end + 1]):
            message = decode_payload(payload, frame.host_time)
            match message:
                case Frame(sequence=frame.sequence) | DriveSamples(sequence=frame.sequence):
                    return data[place:]
        place = end + 1
    return data
