"""The channels of a session file, and the schemas that say how to read them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from typing import Any

from mcap.records import Channel, Schema

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

_JSON: dict[str, dict[str, Any]] = json.loads(
    (files(__package__) / "schemas.json").read_text(encoding="utf-8")
)


def _json(name: str) -> tuple[str, str, str]:
    return name, "jsonschema", json.dumps(_JSON[name], separators=(",", ":"))


_TABLE: tuple[tuple[int, str, tuple[str, str, str]], ...] = (
    (RAW, "/raw", ("tomoskin_msgs/msg/Raw", "ros2msg", _RAW_TEXT)),
    (FRAMES, "/frames", ("tomoskin_msgs/msg/Frame", "ros2msg", _FRAME_TEXT)),
    (TOUCHES, "/touches", _json("tomoskin.Touches")),
    (SCENE, "/scene", _json("foxglove.SceneUpdate")),
    (IMAGE, "/image", _json("foxglove.Grid")),
    (TRUTH, "/truth", _json("tomoskin.Truth")),
    (EVENTS, "/events", _json("foxglove.Log")),
    (NOTES, "/notes", _json("foxglove.Log")),
    (DEVICE, "/device", _json("tomoskin.Device")),
    (CLOCK, "/clock", _json("tomoskin.Clock")),
    (SETTINGS, "/settings", _json("tomoskin.Settings")),
)


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
