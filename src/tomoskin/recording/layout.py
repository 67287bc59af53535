"""Frames and raw bytes as they lie in a session file: CDR, as ROS 2 and Foxglove read it.

A CDR message is 4 bytes that say little-endian, then the fields, each aligned to its own size.
The byte layout is in docs/session-file.md.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from tomoskin.core import DataError, Frame

_CDR = b"\x00\x01\x00\x00"
_FRAME = struct.Struct("<4sdQIHHBBxxI")
_RAW = struct.Struct("<4sdI")


class Mark(IntFlag):
    """What became of a frame on its way to the pipeline."""

    NONE = 0
    REFERENCE = 1
    """A new reference begins with this frame."""
    HELD = 2
    """Left out: the image was held."""
    SKIPPED = 4
    """Left out: too many frames waited."""
    OPENED = 8
    """First frame since the source was opened."""
    EARLIER = 16
    """From before the recording began: what its reference and operator were made of."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkedFrame:
    """A frame, and what became of it."""

    frame: Frame
    mark: Mark


def encode_frame(frame: Frame, mark: Mark) -> bytes:
    """Message of the channel ``/frames``."""
    head = _FRAME.pack(
        _CDR,
        frame.host_time,
        frame.ticks,
        frame.sequence,
        frame.configuration,
        frame.drops,
        frame.flags,
        mark,
        len(frame.samples),
    )
    return head + frame.samples.astype("<u2", copy=False).tobytes()


def decode_frame(data: bytes | memoryview, where: str) -> MarkedFrame:
    """Frame of a message of ``/frames``; DataError when it is no such message."""
    if len(data) < _FRAME.size:
        raise _wrong("a frame", data, where)
    cdr, host_time, ticks, sequence, configuration, drops, flags, mark, n = _FRAME.unpack_from(data)
    if cdr != _CDR or len(data) != _FRAME.size + 2 * n:
        raise _wrong("a frame", data, where)
    samples = np.frombuffer(data, "<u2", n, _FRAME.size)
    frame = Frame(sequence, ticks, host_time, configuration, flags, drops, samples)
    return MarkedFrame(frame, Mark(mark))


def encode_raw(host_time: float, data: bytes) -> bytes:
    """Message of the channel ``/raw``."""
    return _RAW.pack(_CDR, host_time, len(data)) + data


def decode_raw(data: bytes | memoryview, where: str) -> tuple[float, bytes]:
    """Host time and bytes of a message of ``/raw``; DataError when it is no such message."""
    if len(data) < _RAW.size:
        raise _wrong("raw bytes", data, where)
    cdr, host_time, n = _RAW.unpack_from(data)
    if cdr != _CDR or len(data) != _RAW.size + n:
        raise _wrong("raw bytes", data, where)
    return host_time, bytes(data[_RAW.size :])


def _wrong(what: str, data: bytes | memoryview, where: str) -> DataError:
    return DataError(f"expected {what}, got {len(data)} bytes that are not", where=where)
