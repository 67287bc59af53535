"""Messages of ROS 2."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tomoskin.core import Event, Image, PixelMap, Touch, encode_json
from tomoskin.recording import touches_message
from tomoskin.sink.sink import Item, Moment, Stream, TouchPace

TYPES: dict[str, dict[str, str]] = {
    "builtin_interfaces/msg/Time": {"sec": "int32", "nanosec": "uint32"},
    "std_msgs/msg/Header": {"stamp": "builtin_interfaces/msg/Time", "frame_id": "string"},
    "std_msgs/msg/String": {"data": "string"},
    "geometry_msgs/msg/Point": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Quaternion": {
        "x": "float64", "y": "float64", "z": "float64", "w": "float64",
    },
    "geometry_msgs/msg/Pose": {
        "position": "geometry_msgs/msg/Point", "orientation": "geometry_msgs/msg/Quaternion",
    },
    "geometry_msgs/msg/PoseWithCovariance": {
        "pose": "geometry_msgs/msg/Pose", "covariance": "float64[36]",
    },
    "geometry_msgs/msg/PoseWithCovarianceStamped": {
        "header": "std_msgs/msg/Header", "pose": "geometry_msgs/msg/PoseWithCovariance",
    },
    "sensor_msgs/msg/Image": {
        "header": "std_msgs/msg/Header", "height": "uint32", "width": "uint32",
        "encoding": "string", "is_bigendian": "uint8", "step": "uint32", "data": "uint8[]",
    },
}  # fmt: skip
"""Fields of each message by name, in order: a number, ``string``, another message, or an array."""

_NUMBERS = {"uint8": "B", "int32": "i", "uint32": "I", "float64": "d"}
_IDS = {"uint8": 3, "int32": 6, "uint32": 7, "float64": 11, "string": 17}
_NESTED, _FIXED, _ENDLESS = 1, 48, 144


@dataclass(frozen=True)
class _Field:
    """``kind`` without its brackets; ``length`` of an array: 0 for any, None where it is none."""

    kind: str
    length: int | None

    @classmethod
    def of(cls, text: str) -> _Field:
        kind, bracket, length = text.rstrip("]").partition("[")
        return cls(kind, int(length or 0) if bracket else None)

    def description(self) -> dict[str, Any]:
        number = _IDS.get(self.kind, _NESTED)
        if self.length is not None:
            number += _FIXED if self.length else _ENDLESS
        return {
            "type_id": number,
            "capacity": self.length or 0,
            "string_capacity": 0,
            "nested_type_name": "" if self.kind in _IDS else self.kind,
        }


def encode_cdr(kind: str, value: Mapping[str, Any]) -> bytes:
    """CDR of the message ``kind`` with those fields, by name; arrays are numpy's or bytes."""
    out = bytearray()
    _put_message(out, kind, value)
    return b"\x00\x01\x00\x00" + bytes(out)


def type_hash(kind: str) -> str:
    """RIHS01 hash of a message's type, as ROS 2 has it from Iron on."""
    content = {
        "type_description": _described(kind),
        "referenced_type_descriptions": [_described(name) for name in sorted(_used_by(kind))],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _put_message(out: bytearray, kind: str, value: Mapping[str, Any]) -> None:
    for name, text in TYPES[kind].items():
        _put(out, _Field.of(text), value[name])


def _put(out: bytearray, field: _Field, value: Any) -> None:
    if field.length is not None:
        _put_array(out, field, value)
    elif field.kind in TYPES:
        _put_message(out, field.kind, value)
    elif field.kind == "string":
        data = value.encode() + b"\0"
        _put_number(out, "I", len(data))
        out += data
    else:
        _put_number(out, _NUMBERS[field.kind], value)


def _put_array(out: bytearray, field: _Field, value: Any) -> None:
    layout = _NUMBERS[field.kind]
    if not field.length:
        _put_number(out, "I", len(value))
    _align(out, layout)
    out += value if isinstance(value, bytes) else np.asarray(value, f"<{layout}").tobytes()


def _put_number(out: bytearray, layout: str, value: float) -> None:
    _align(out, layout)
    out += struct.pack("<" + layout, value)


def _align(out: bytearray, layout: str) -> None:
    out += bytes(-len(out) % struct.calcsize("<" + layout))


def _described(kind: str) -> dict[str, Any]:
    fields = [
        {"name": name, "type": _Field.of(text).description()} for name, text in TYPES[kind].items()
    ]
    return {"type_name": kind, "fields": fields}


def _used_by(kind: str) -> set[str]:
    direct = {_Field.of(text).kind for text in TYPES[kind].values()} & TYPES.keys()
    return direct.union(*(_used_by(name) for name in direct))


FRAME = "skin"
"""Name of the sheet's own frame of coordinates: x right, y up, seen from the front; m."""

POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
IMAGE = "sensor_msgs/msg/Image"
TEXT = "std_msgs/msg/String"

TOPICS = {
    "tomoskin/touch": POSE,
    "tomoskin/touches": TEXT,
    "tomoskin/image": IMAGE,
    "tomoskin/events": TEXT,
}
"""Type of each topic."""

_UNKNOWN = 1e6
"""Variance of what is not measured, m² or rad²: what filters take for no knowledge."""

Value = dict[str, Any]


@dataclass(frozen=True, slots=True)
class RosMessage:
    """A message for ``topic``, its fields by name, of the time ``stamp`` in ns since 1970."""

    topic: str
    value: Value
    stamp: int


class RosView:
    """Turns results and events into messages."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._pace = TouchPace()

    def of(self, item: Item) -> Iterator[RosMessage]:
        """Messages of one frame, or of an event."""
        stamp = self._stream.log_time(item.host_time)
        for event in (item,) if isinstance(item, Event) else item.told:
            content = {"time_s": event.host_time, "kind": event.kind, "text": event.text}
            yield RosMessage("tomoskin/events", _json(content), stamp)
        if isinstance(item, Event):
            return
        if self._pace.is_due(item):
            for touch in item.touches:
                yield RosMessage("tomoskin/touch", _pose(touch, stamp), stamp)
            yield RosMessage("tomoskin/touches", _json(_touches(item)), stamp)
        if item.image is not None and self._stream.pixels is not None:
            yield RosMessage(
                "tomoskin/image", _image(item.image, self._stream.pixels, stamp), stamp
            )


def _touches(moment: Moment) -> dict[str, Any]:
    return touches_message(moment.host_time, moment.sequence, moment.touches)


def _json(content: Any) -> Value:
    return {"data": encode_json(content).decode()}


def _header(stamp: int) -> Value:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": FRAME}


def _pose(touch: Touch, stamp: int) -> Value:
    """Place in the sheet's plane; what an image does not say has a vast variance."""
    detection = touch.detection
    variance = np.array([detection.sd_x**2, detection.sd_y**2, *[_UNKNOWN] * 4])
    covariance = np.diag(np.where(np.isfinite(variance), variance, _UNKNOWN))
    if np.isfinite(variance).all():
        covariance[[0, 1], [1, 0]] = detection.cov_xy
    pose = {
        "position": {"x": detection.x, "y": detection.y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    return {"header": _header(stamp), "pose": {"pose": pose, "covariance": covariance.ravel()}}


def _image(image: Image, pixels: PixelMap, stamp: int) -> Value:
    """Change of conductivity as 32-bit floats, the top row first, NaN outside the sheet."""
    values = image.on_pixels(pixels).astype("<f4")
    height, width = values.shape
    return {
        "header": _header(stamp),
        "height": height,
        "width": width,
        "encoding": "32FC1",
        "is_bigendian": 0,
        "step": 4 * width,
        "data": values.tobytes(),
    }
