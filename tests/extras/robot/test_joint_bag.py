"""Bags of others: which topic tells how a robot stands, in which order, and how it is packed."""

from __future__ import annotations

import math

import pytest
import zstandard
from mcap.writer import Writer

from extras.robot.test_joint_states import BEGUN, KIND, state
from tomoskin.core import DataError, SkinError
from tomoskin.extras.ros2 import JointStates, joint_states

TIMES = [0.02 * k for k in range(500)]
STATES = [("/joint_states", t, 0.5 * math.sin(t)) for t in TIMES]
"""Topic, stamp and position of the shoulder."""
TARGETS = [("/joint_states_desired", t, 0.5 * math.sin(t) + 0.3) for t in TIMES]


def write(path, rows, pack=bytes):
    """A bag of messages in the order of ``rows``, which is that in which they came."""
    with path.open("wb") as file:
        bag = Writer(file)
        bag.start(profile="ros2")
        kind, channels = bag.register_schema(KIND, "ros2msg", b""), {}
        for number, (topic, t, position) in enumerate(rows):
            if topic not in channels:
                channels[topic] = bag.register_channel(topic, "cdr", kind)
            log = round(1e9 * BEGUN) + 10_000_000 * number
            bag.add_message(channels[topic], log, pack(state(BEGUN + t, shoulder=position)), log)
        bag.finish()
    return str(path)


def assert_right(spec, offset=0.0):
    states = joint_states(spec)
    for t in (1.0, 3.0, 6.0, 8.01, 9.0):
        got = states(BEGUN + t)("shoulder")
        assert got == pytest.approx(0.5 * math.sin(t) + offset, abs=0.002)


def mixed(*tracks):
    return [row for rows in zip(*tracks, strict=True) for row in rows]


def named(topic, rows):
    return [(topic, *row[1:]) for row in rows]


@pytest.mark.parametrize(
    "rows",
    [
        mixed(TARGETS, STATES),
        mixed(STATES, named("/viz/joint_states", TARGETS)),
        mixed(TARGETS, named("/arm/joint_states", STATES)),
        named("/measured", STATES),
    ],
    ids=["targets", "relay", "namespace", "only"],
)
def test_the_usual_topic_is_taken(tmp_path, rows):
    assert_right(write(tmp_path / "arm.mcap", rows))


def test_one_of_several_is_asked_for(tmp_path):
    rows = mixed(named("/measured", STATES), named("/target", TARGETS))
    path = write(tmp_path / "arm.mcap", rows)
    with pytest.raises(DataError, match=r'got /measured, /target \(.*"arm\.mcap:topic=/measured"'):
        joint_states(path)
    assert_right(f"{path}:topic=/measured")
    assert_right(f"{path}:topic=/target", 0.3)
    with pytest.raises(DataError, match="of the topics /measured, /target, got /arm"):
        joint_states(f"{path}:topic=/arm")


def test_two_namespaces_are_asked_for_and_may_both_be_named(tmp_path):
    rows = mixed(named("/left/joint_states", STATES), named("/right/joint_states", TARGETS))
    path = write(tmp_path / "arm.mcap", rows)
    with pytest.raises(DataError, match="expected one topic of joint states"):
        joint_states(path)
    states = joint_states(f"{path}:topic=/left/joint_states,/right/joint_states")
    with pytest.raises(SkinError, match=r'topic /left.*, /right.*"wrist" has not come'):
        states(BEGUN)("wrist")


@pytest.mark.parametrize("order", [slice(None, None, -1), slice(1, None, 2)])
def test_stamps_decide_on_the_order_not_arrival(tmp_path, order):
    late = STATES[order]
    rest = [row for row in STATES if row not in late]
    assert_right(write(tmp_path / "arm.mcap", late + rest))


def test_a_late_state_of_a_live_robot_goes_to_its_place():
    """Neighbours that came in the other order, and one of an age ago."""
    import extras.robot.test_joint_states as bags

    order = [0.0, 0.02, 0.06, 0.04, 0.08, 5.0, 0.1, 5.02]
    sent = [(0.0, bags.STORE.deserialize_cdr(state(BEGUN + t, shoulder=t), KIND)) for t in order]
    states = JointStates(lambda: sent, "an arm")
    first = states(BEGUN + 0.05)
    sent = []
    for t in (0.0, 0.03, 0.05, 0.07):
        assert states(BEGUN + t)("shoulder") == pytest.approx(t, abs=1e-6)
    assert first("shoulder") == pytest.approx(0.05, abs=1e-6)
    assert states(BEGUN + 5.01)("shoulder") == pytest.approx(5.01, abs=1e-6)


@pytest.mark.parametrize("size", [True, False], ids=["size", "no-size"])
def test_messages_that_are_compressed_one_by_one(tmp_path, size):
    packer = zstandard.ZstdCompressor(write_content_size=size)
    assert_right(write(tmp_path / "arm.mcap", STATES, packer.compress))


def test_a_file_that_is_compressed_as_a_whole(tmp_path):
    write(tmp_path / "arm.mcap", STATES)
    packed = tmp_path / "arm.mcap.zstd"
    with (tmp_path / "arm.mcap").open("rb") as file, packed.open("wb") as out:
        zstandard.ZstdCompressor().copy_stream(file, out)
    assert_right(str(packed))
    packed.write_bytes(packed.read_bytes()[:-2000])
    with pytest.raises(DataError, match="is not a complete MCAP file"):
        joint_states(str(packed))


def test_what_is_packed_in_another_way_is_said(tmp_path):
    path = write(tmp_path / "arm.mcap", STATES, lambda data: b"\x04\x22\x4d\x18" + data)
    with pytest.raises(
        DataError, match=r"message 0: expected a .*begin with 04 22 4d 18 \(ros2 bag"
    ):
        joint_states(path)
