"""Messages of ROS 2."""

from __future__ import annotations

import functools
import hashlib
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tomoskin.core import Detection, Event, Image, PixelMap, encode_json
from tomoskin.sink.naming import (
    UNKNOWN,
    Naming,
    SpacePose,
    event_content,
    poses_of,
    touches_content,
)
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
    "geometry_msgs/msg/Vector3": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Twist": {
        "linear": "geometry_msgs/msg/Vector3", "angular": "geometry_msgs/msg/Vector3",
    },
    "geometry_msgs/msg/TwistWithCovariance": {
        "twist": "geometry_msgs/msg/Twist", "covariance": "float64[36]",
    },
    "nav_msgs/msg/Odometry": {
        "header": "std_msgs/msg/Header", "child_frame_id": "string",
        "pose": "geometry_msgs/msg/PoseWithCovariance",
        "twist": "geometry_msgs/msg/TwistWithCovariance",
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

    @staticmethod
    @functools.cache
    def of(text: str) -> _Field:
        kind, bracket, length = text.rstrip("]").partition("[")
        return _Field(kind, int(length or 0) if bracket else None)

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


def definition(kind: str) -> list[str]:
    """The text of a message's definition, then that of each message in it, headed by its name."""
    inner = (f"MSG: {_short(name)}\n{_fields(name)}" for name in sorted(_used_by(kind)))
    return [_fields(kind), *inner]


def _fields(kind: str) -> str:
    return "\n".join(f"{_short(text)} {name}" for name, text in TYPES[kind].items())


def _short(kind: str) -> str:
    """As definitions name it: without "msg"."""
    return kind.replace("/msg/", "/")


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


POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
IMAGE = "sensor_msgs/msg/Image"
TEXT = "std_msgs/msg/String"

TOPICS = {"touch": POSE, "track": ODOMETRY, "touches": TEXT, "image": IMAGE, "events": TEXT}
"""Type of each topic, by its name in the skin's namespace."""

Value = dict[str, Any]


@dataclass(frozen=True, slots=True)
class RosMessage:
    """A message for ``topic`` (of :data:`TOPICS`), its fields by name; ``stamp`` ns since 1970."""

    topic: str
    value: Value
    stamp: int


class RosView:
    """Turns results and events into messages."""

    def __init__(self, stream: Stream, naming: Naming) -> None:
        self._stream, self._naming = stream, naming
        self._pace = TouchPace()

    def of(self, item: Item) -> Iterator[RosMessage]:
        """Messages of one frame, or of an event."""
        stamp = self._stream.log_time(item.host_time)
        of_frame = not isinstance(item, Event)
        for event in (item,) if isinstance(item, Event) else item.told:
            content = event_content(self._stream, self._naming, event, of_frame=of_frame)
            yield RosMessage("events", _json(content), stamp)
        if isinstance(item, Event):
            return
        if self._pace.is_due(item):
            yield from self._touches(item, stamp)
        if item.image is not None and self._stream.pixels is not None:
            yield RosMessage("image", self._image(item.image, self._stream.pixels, stamp), stamp)

    def _touches(self, moment: Moment, stamp: int) -> Iterator[RosMessage]:
        """Each touch as a pose and as a track, which has its identity; all of them in words."""
        header = self._header(stamp)
        poses = poses_of(self._stream, moment.touches)
        for touch, place in zip(moment.touches, poses, strict=True):
            pose = _pose(place, touch.detection)
            yield RosMessage("touch", {"header": header, "pose": pose}, stamp)
            child = f"{self._naming.frame_id}/touch_{touch.id}"
            track = {"header": header, "child_frame_id": child, "pose": pose, "twist": _AT_REST}
            yield RosMessage("track", track, stamp)
        content = touches_content(self._stream, self._naming, moment, poses)
        yield RosMessage("touches", _json(content), stamp)

    def _header(self, stamp: int) -> Value:
        sec, nanosec = divmod(stamp, 1_000_000_000)
        return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": self._naming.frame_id}

    def _image(self, image: Image, pixels: PixelMap, stamp: int) -> Value:
        """Change of conductivity as 32-bit floats, the top row first, NaN outside the sheet."""
        values = image.on_pixels(pixels).astype("<f4")
        height, width = values.shape
        return {
            "header": self._header(stamp),
            "height": height,
            "width": width,
            "encoding": "32FC1",
            "is_bigendian": 0,
            "step": 4 * width,
            "data": values.tobytes(),
        }


def _json(content: Mapping[str, Any]) -> Value:
    return {"data": encode_json(content).decode()}


def _pose(pose: SpacePose, detection: Detection) -> Value:
    place = {
        "position": _named("xyz", pose.position),
        "orientation": _named("xyzw", pose.quaternion()),
    }
    return {"pose": place, "covariance": pose.covariance(detection).ravel()}


def _named(names: str, values: Sequence[float]) -> Value:
    return dict(zip(names, values, strict=True))


_ZERO = _named("xyz", (0.0, 0.0, 0.0))
_AT_REST = {
    "twist": {"linear": _ZERO, "angular": _ZERO},
    "covariance": (UNKNOWN * np.eye(6)).ravel(),
}
"""Velocities are not measured."""
