"""A session as a bag of ROS 2, read back by ``rosbags``."""

from __future__ import annotations

import json

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from cli.conftest import tomoskin
from run.sinks.conftest import SCRIPT
from tomoskin.files.session import SessionReader, as_recorded, replayed

__all__ = ["tomoskin"]


@pytest.fixture
def bag(tomoskin, tmp_path):
    """(session, bag) of a short press."""
    (tmp_path / "press.toml").write_text(SCRIPT, encoding="utf-8")
    session, bag = tmp_path / "press.mcap", tmp_path / "bag.mcap"
    assert tomoskin("simulate", "--script", tmp_path / "press.toml", "--out", session)[0] == 0
    code, _, errors = tomoskin("session", "export", session, bag, "--every", "0.2")
    assert (code, errors) == (0, "")
    return session, bag


def messages_of(path):
    """(profile, messages by topic) as ``rosbags`` reads them by what the file says of its types."""
    found = {}
    store = get_typestore(Stores.EMPTY)
    with AnyReader([path], default_typestore=store) as reader:
        for connection, when, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((when, message))
    return found


def test_a_bag_holds_the_touches_of_a_session(bag, tomoskin):
    found = messages_of(bag[1])
    with SessionReader(bag[0]) as session:
        results = list(replayed(as_recorded(session), session))
    expected = [(round(1e9 * r.scanned), t) for r in results for t in r.touches]
    assert len(expected) > 3
    for (when, told), (time, touch) in zip(found["/tomoskin/track"], expected, strict=True):
        assert (when, told.child_frame_id) == (time, f"skin/touch_{touch.id}")
        place = told.pose.pose.position
        assert (place.x, place.y, place.z) == (touch.detection.x, touch.detection.y, 0)
    assert len(found["/tomoskin/touch"]) == len(expected)
    contacts = [contact for _, told in found["/tomoskin/contacts"] for contact in told.contacts]
    assert [contact.position.x for contact in contacts] == [t.detection.x for _, t in expected]
    texts = [json.loads(told.data) for _, told in found["/tomoskin/events"]]
    assert {"note", "touch-onset"} <= {text["kind"] for text in texts}
    assert texts[0]["utc_s"] is None  # a simulation has no time of the day
    told = [json.loads(told.data) for _, told in found["/tomoskin/touches"]]
    assert {row["latency_s"] for row in told} == {None}  # of a recording nothing is known of it
    assert not told[0]["valid"]  # until the reference stands
    assert all(row["valid"] for row in told if row["touches"])
    assert 2 <= len(found["/tomoskin/image"]) == len(found["/tomoskin/points"]) <= 5
    with bag[1].open("rb") as file:
        assert make_reader(file, validate_crcs=True).get_header().profile == "ros2"
    code, _, errors = tomoskin("session", "info", bag[1])
    assert (code, "not a session of tomoskin" in errors) == (1, True)
