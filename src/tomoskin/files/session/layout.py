"""Messages of a session: frames and bytes in binary, the rest as documents."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    MEASURANDS,
    Amount,
    DataError,
    Detection,
    Event,
    Frame,
    Mark,
    MarkedFrame,
    Touch,
)
from tomoskin.files.messages import deformation_of
from tomoskin.sensing.fit import Deformation

_CDR = b"\x00\x01\x00\x00"
_FRAME = struct.Struct("<4sdQIHHBBxxI")
_COUNT = struct.Struct("<I")
_RAW = struct.Struct("<4sdI")
_HOST_TIME = struct.Struct("<4xd")


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
    samples = frame.samples.astype("<u2", copy=False).tobytes()
    sums = b"" if frame.sums is None else frame.sums.astype("<u2", copy=False).tobytes()
    return head + samples + bytes(_gap(frame)) + _COUNT.pack(len(sums) // 2) + sums


def _gap(frame: Frame) -> int:
    """Bytes that bring the next count to a multiple of four."""
    return 2 * (len(frame.samples) % 2)


def decode_frame(data: bytes | memoryview, where: str) -> MarkedFrame:
    """Frame of a message of ``/frames``; DataError when it is no such message."""
    if len(data) < _FRAME.size:
        raise _wrong("a frame", data, where)
    cdr, host_time, ticks, sequence, configuration, drops, flags, mark, n = _FRAME.unpack_from(data)
    end = _FRAME.size + 2 * n
    if cdr != _CDR or len(data) < end:
        raise _wrong("a frame", data, where)
    samples = np.frombuffer(data, "<u2", n, _FRAME.size)
    frame = Frame(sequence, ticks, host_time, configuration, flags, drops, samples)
    sums = None if len(data) == end else _sums(data, end + _gap(frame), where)
    return MarkedFrame(replace(frame, sums=sums), Mark(mark))


def _sums(data: bytes | memoryview, at: int, where: str) -> NDArray[np.uint16] | None:
    """The sums, whose number stands at ``at``; files of before protocol 1.2 have none."""
    n = _COUNT.unpack_from(data, at)[0] if len(data) >= at + _COUNT.size else -1
    if len(data) != at + _COUNT.size + 2 * n:
        raise _wrong("a frame", data, where)
    return np.frombuffer(data, "<u2", n, at + _COUNT.size) if n else None


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


class _Timed(msgspec.Struct):
    host_time: float = math.nan


def host_time_of(data: bytes) -> float:
    """Host time, s, of a message of any channel; NaN where it does not say."""
    if data.startswith(_CDR):
        return float(_HOST_TIME.unpack_from(data)[0]) if len(data) >= _HOST_TIME.size else math.nan
    try:
        return msgspec.json.decode(data, type=_Timed).host_time
    except (msgspec.DecodeError, UnicodeDecodeError):
        return math.nan


def _wrong(what: str, data: bytes | memoryview, where: str) -> DataError:
    return DataError(f"expected {what}, got {len(data)} bytes that are not", where=where)


_NO_CELLS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Truth:
    """What pressed on the twin from ``host_time`` on, and how it was bent: fields by name."""

    host_time: float
    presses: tuple[dict[str, Any], ...]
    bends: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedTouches:
    """Touches of the frame ``sequence``, and how the sheet is deformed in it; which cells they
    covered is not in the file."""

    host_time: float
    sequence: int
    touches: tuple[Touch, ...]
    deformation: Deformation | None = None


def touches_of(content: Mapping[str, Any]) -> RecordedTouches:
    """The touches of a ``tomoskin.Touches``."""
    touches = tuple(map(_touch_of, content["touches"]))
    deformation = deformation_of(content.get("deformation"))
    return RecordedTouches(content["host_time"], content["sequence"], touches, deformation)


def truth_of(content: Mapping[str, Any]) -> Truth:
    """The presses and bends of a ``tomoskin.Truth``."""
    bends = tuple(content.get("bends", ()))
    return Truth(content["host_time"], tuple(content["presses"]), bends)


def event_of(content: Mapping[str, Any]) -> Event:
    """The event of a ``foxglove.Log``."""
    return Event(content["host_time"], content["name"], content["message"])


def _touch_of(item: dict[str, Any]) -> Touch:
    sd_x, sd_y = (float("nan") if item[k] is None else item[k] for k in ("sd_x", "sd_y"))
    place = item["x"], item["y"], sd_x, sd_y, item["area"], item["peak"], _NO_CELLS
    cov_xy, close, merged = (item.get(k) for k in ("cov_xy", "close", "merged"))  # format 1.0: none
    possible = tuple(item.get("possible", ()))  # none in 0.1
    elsewhere = tuple((x, y) for x, y in item.get("elsewhere", ()))
    amounts: dict[str, Any] = {}
    for name in MEASURANDS:
        if item.get(name) is not None:
            low, high = item[f"{name}_interval"]
            high = math.inf if high is None else high  # beyond what was taught
            amounts[name] = Amount(item[name], low, high)
    reading = Detection(*place, cov_xy=cov_xy or 0.0, close=bool(close), **amounts)
    named = item["id"], item["kind"], item["since"], reading
    return Touch(*named, tuple(merged or ()), possible, elsewhere=elsewhere)
