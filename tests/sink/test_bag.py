"""A session as a bag of ROS 2: read back by what the file itself says of its messages."""

from __future__ import annotations

import json
import re

import pytest
from mcap.reader import make_reader

from cli.conftest import tomoskin
from sink.test_ros import Cdr
from tomoskin.recording import SessionReader, as_recorded, replayed

__all__ = ["tomoskin"]

SCRIPT = """format = 1
[script]
duration = "700 ms"
lead_in = "1.2 s"
[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "0 s"
force = "3 N"
hold = "200 ms"
[[mark]]
at = "500 ms"
text = "half"
"""
LAYOUTS = {"float64": "d", "uint32": "I", "int32": "i", "uint8": "B"}


def decode(cdr, schema):
    """Fields by name, as the definition in the file has them."""
    parts = re.split(r"\n=+\nMSG: (\S+)\n", schema.data.decode())
    known = dict(zip(parts[1::2], parts[2::2], strict=True))

    def value(kind):
        if kind == "string":
            return cdr.text()
        return cdr.take(LAYOUTS[kind]) if kind in LAYOUTS else fields(known[kind])

    def field(kind):
        base, bracket, length = kind.rstrip("]").partition("[")
        if not bracket:
            return value(base)
        return [value(base) for _ in range(int(length) if length else cdr.take("I"))]

    def fields(text):
        lines = (line.split() for line in text.splitlines())
        return {name: field(kind) for kind, name in lines}

    return fields(parts[0])


@pytest.fixture
def bag(tomoskin, tmp_path):
    """(session, bag) of a short press."""
    (tmp_path / "press.toml").write_text(SCRIPT, encoding="utf-8")
    session, bag = tmp_path / "press.mcap", tmp_path / "bag.mcap"
    assert tomoskin("simulate", "--script", tmp_path / "press.toml", "--out", session)[0] == 0
    code, _, errors = tomoskin("session", "export", session, bag, "--every", "0.2")
    assert (code, errors) == (0, "")
    return session, bag


def test_a_bag_holds_the_touches_of_a_session(bag, tomoskin):
    with bag[1].open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        found = {}
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            cdr = Cdr(message.data)
            content = decode(cdr, schema)
            assert cdr.ends()
            found.setdefault(channel.topic, []).append((message.log_time, content))
    with SessionReader(bag[0]) as session:
        results = list(replayed(as_recorded(session), session))
    expected = [(round(1e9 * r.host_time), t) for r in results for t in r.touches]
    assert len(expected) > 3
    for (when, told), (time, touch) in zip(found["/tomoskin/track"], expected, strict=True):
        assert (when, told["child_frame_id"]) == (time, f"skin/touch_{touch.id}")
        place = told["pose"]["pose"]["position"]
        assert (place["x"], place["y"], place["z"]) == (touch.detection.x, touch.detection.y, 0)
    assert len(found["/tomoskin/touch"]) == len(expected)
    texts = [json.loads(told["data"]) for _, told in found["/tomoskin/events"]]
    assert {"note", "touch-onset"} <= {text["kind"] for text in texts}
    assert texts[0]["utc_s"] is None  # a simulation has no time of the day
    assert 2 <= len(found["/tomoskin/image"]) <= 5
    code, _, errors = tomoskin("session", "info", bag[1])
    assert (code, "no session of tomoskin" in errors) == (1, True)
