"""The channels of a session file, and the schemas that say how to read them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from mcap.records import Channel, Schema

from tomoskin.files.messages import UNUSED

RAW, FRAMES, TOUCHES, SCENE, IMAGE, TRUTH, EVENTS, NOTES, DEVICE, CLOCK, SETTINGS = range(1, 12)
"""Numbers of the channels: the same in every file, so that a torn one can be read."""

_RAW_TEXT = """\
# Bytes as they were read from the source.
float64 host_time   # host monotonic seconds when they were read
uint8[] data
"""

_FRAME_TEXT = """\
# One scan as the device sent it.
float64 host_time     # host monotonic seconds when its last byte was read
uint64 ticks          # device clock at the start of the scan
uint32 sequence       # scans since START
uint16 configuration  # identity of the scan
uint16 drops          # frames that the device dropped since START
uint8 flags           # the device's
uint8 mark            # 1 a reference begins, 2 held, 4 skipped, 8 source opened, 16 from earlier
uint16[] samples      # counts in scan order, each the sum over the oversampling
uint16[] sums         # of an alternating drive: samples are differences of its directions + 32768
"""

_NUMBER = {"type": "number"}
_MAYBE = {"type": ["number", "null"]}
_INTEGER = {"type": "integer"}
_STRING = {"type": "string"}
_TIME = {"type": "object", "properties": {"sec": _INTEGER, "nsec": _INTEGER}}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _list(item: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item}


_XYZ = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POSE = _object(position=_XYZ, orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER))
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)

_TOUCH = _object(
    id=_INTEGER,
    kind=_STRING,
    since=_NUMBER,
    x=_NUMBER,
    y=_NUMBER,
    sd_x=_MAYBE,
    sd_y=_MAYBE,
    area=_NUMBER,
    peak=_NUMBER,
    cov_xy=_MAYBE,
    close={"type": "boolean"},
    merged=_list(_INTEGER),
    force=_MAYBE,
    force_interval=_list(_NUMBER),
    force_calibrated={"type": "boolean"},
    possible=_list(_INTEGER),
)
_PRESS = _object(x=_NUMBER, y=_NUMBER, force=_NUMBER, radius=_NUMBER)
_LOG = _object(
    timestamp=_TIME,
    level=_INTEGER,
    message=_STRING,
    name=_STRING,
    file=_STRING,
    line=_INTEGER,
    host_time=_NUMBER,
)
_GRID = _object(
    timestamp=_TIME,
    frame_id=_STRING,
    pose=_POSE,
    column_count=_INTEGER,
    cell_size=_object(x=_NUMBER, y=_NUMBER),
    row_stride=_INTEGER,
    cell_stride=_INTEGER,
    fields=_list(_object(name=_STRING, offset=_INTEGER, type=_INTEGER)),
    data={"type": "string", "contentEncoding": "base64"},
    host_time=_NUMBER,
    unit=_STRING,
)
_SCENE_UPDATE = _object(
    deletions=_list(_object(timestamp=_TIME, type=_INTEGER, id=_STRING)),
    entities=_list(
        _object(
            timestamp=_TIME,
            frame_id=_STRING,
            id=_STRING,
            lifetime=_TIME,
            frame_locked={"type": "boolean"},
            metadata=_list(_object(key=_STRING, value=_STRING)),
            **dict.fromkeys(UNUSED, _list({"type": "object"})),
            spheres=_list(_object(pose=_POSE, size=_XYZ, color=_COLOUR)),
            texts=_list(
                _object(
                    pose=_POSE,
                    billboard={"type": "boolean"},
                    font_size=_NUMBER,
                    scale_invariant={"type": "boolean"},
                    color=_COLOUR,
                    text=_STRING,
                )
            ),
        )
    ),
)
_CLOCK_FIT = _object(
    host_time=_NUMBER, tick_rate=_NUMBER, offset=_NUMBER, residual=_NUMBER, frames=_INTEGER
)


def _json(name: str, content: dict[str, Any]) -> tuple[str, str, str]:
    return name, "jsonschema", json.dumps({"title": name} | content, separators=(",", ":"))


_TABLE: tuple[tuple[int, str, tuple[str, str, str]], ...] = (
    (RAW, "/raw", ("tomoskin_msgs/msg/Raw", "ros2msg", _RAW_TEXT)),
    (FRAMES, "/frames", ("tomoskin_msgs/msg/Frame", "ros2msg", _FRAME_TEXT)),
    (
        TOUCHES,
        "/touches",
        _json("tomoskin.Touches", _object(host_time=_NUMBER, sequence=_INTEGER,
                                          touches=_list(_TOUCH))),
    ),
    (SCENE, "/scene", _json("foxglove.SceneUpdate", _SCENE_UPDATE)),
    (IMAGE, "/image", _json("foxglove.Grid", _GRID)),
    (
        TRUTH,
        "/truth",
        _json("tomoskin.Truth", _object(host_time=_NUMBER, presses=_list(_PRESS))),
    ),
    (EVENTS, "/events", _json("foxglove.Log", _LOG)),
    (NOTES, "/notes", _json("foxglove.Log", _LOG)),
    (DEVICE, "/device", _json("tomoskin.Device", {"type": "object"})),
    (CLOCK, "/clock", _json("tomoskin.Clock", _CLOCK_FIT)),
    (SETTINGS, "/settings", _json("tomoskin.Settings", {"type": "object"})),
)  # fmt: skip


def _schemas() -> tuple[Schema, ...]:
    names = dict.fromkeys(kind for _, _, kind in _TABLE)
    return tuple(
        Schema(number, text.encode(), encoding, name)
        for number, (name, encoding, text) in enumerate(names, start=1)
    )


SCHEMAS = _schemas()
"""Every schema, numbered from 1."""

_NUMBERS = {schema.name: schema.id for schema in SCHEMAS}

CHANNELS = tuple(
    Channel(number, topic, "cdr" if kind[1] == "ros2msg" else "json", {}, _NUMBERS[kind[0]])
    for number, topic, kind in _TABLE
)
"""Every channel."""

TOPICS = {channel.id: channel.topic for channel in CHANNELS}
"""Topic by number of the channel."""


SPAN = 16
"""Numbers that each of a robot's skins has for its channels in a file of all."""


def robot_channels(names: Sequence[str]) -> tuple[Channel, ...]:
    """Channels of a file of several skins: those of the first by the usual numbers."""
    return tuple(
        replace(channel, id=SPAN * number + channel.id, topic=f"/{name}{channel.topic}")
        for number, name in enumerate(names)
        for channel in CHANNELS
    )


def schema_of(topic: str) -> Schema:
    """Schema of the messages of a topic."""
    numbers = {channel.topic: channel.schema_id for channel in CHANNELS}
    return SCHEMAS[numbers[topic] - 1]
