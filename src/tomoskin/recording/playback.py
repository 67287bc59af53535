"""A recorded session as the reads of a source: the same bytes, in the same pieces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from tomoskin.core import Frame
from tomoskin.recording.layout import Mark, MarkedFrame
from tomoskin.wire import SCHEMA, Deframer, decode_payload, encode

RawBytes = tuple[float, bytes]
Item = RawBytes | MarkedFrame

_LONGEST = 2 * SCHEMA.from_device_bytes
"""Bytes that are kept while a first frame is awaited: more than the longest message has."""


@dataclass(frozen=True, slots=True)
class Piece:
    """What one read returned: the bytes, when, and the frames that were made of them.

    ``follows`` says whether the bytes continue those of the piece before.
    """

    host_time: float
    data: bytes
    follows: bool
    frames: tuple[MarkedFrame, ...]


@dataclass
class _Read:
    host_time: float
    data: bytes
    frames: list[MarkedFrame] = field(default_factory=list)
    was_recorded: bool = True


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
        wanted = any(item.frame.host_time >= since for item in read.frames)
        if not follows and read.was_recorded and not wanted:
            early = (early + read.data)[-_LONGEST:]
        elif not read.was_recorded:
            if wanted:
                yield Piece(read.host_time, read.data, False, tuple(read.frames))
                follows, early = False, b""
        elif follows:
            yield Piece(read.host_time, read.data, True, tuple(read.frames))
        else:
            first = next(item.frame for item in read.frames if item.frame.host_time >= since)
            data = _from_frame(early + read.data, first)
            yield Piece(read.host_time, data, False, tuple(read.frames))
            follows, early = True, b""


def _reads(items: Iterable[Item]) -> Iterator[_Read]:
    """Each read with the frames of it, in the order of the file."""
    current: _Read | None = None
    for item in items:
        if not isinstance(item, MarkedFrame):
            if current is not None:
                yield current
            current = _Read(*item)
        elif current is not None and item.frame.host_time == current.host_time:
            current.frames.append(item)
        else:
            if current is not None:
                yield current
            again = encode(item.frame)
            current = None
            yield _Read(item.frame.host_time, again, [item], was_recorded=False)
    if current is not None:
        yield current


def _from_frame(data: bytes, frame: Frame) -> bytes:
    """The part of ``data`` that begins with the message of ``frame``; all where it is not found."""
    place = 0
    while (end := data.find(b"\0", place)) >= 0:
        for payload in Deframer(SCHEMA.from_device_bytes).feed(data[place : end + 1]):
            message = decode_payload(payload, frame.host_time)
            if isinstance(message, Frame) and message.sequence == frame.sequence:
                return data[place:]
        place = end + 1
    return data


def marks(piece: Piece) -> dict[int, Mark]:
    """What became of the frames of a piece, by their sequence."""
    return {item.frame.sequence: item.mark for item in piece.frames}
