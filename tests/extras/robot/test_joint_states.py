"""How a robot stands: messages of others, written by libraries of others, and touches that move."""

from __future__ import annotations

import contextlib
import json
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from extras.ros2.test_ros2 import domain
from files.session.runs import SKIN, TOUCH
from run.sinks.conftest import PATIENCE, contacts_at
from tomoskin.core import DataError, SinkError, SkinError
from tomoskin.extras.robot import Robot, with_joints
from tomoskin.extras.ros2 import JointStates, joint_states
from tomoskin.files.messages import Stream
from tomoskin.pipeline import prepare

__all__ = ["domain"]

PUBLISHER = Path(__file__).parents[1] / "ros2" / "joint_publisher.py"
STORE = get_typestore(Stores.ROS2_JAZZY)
KIND = "sensor_msgs/msg/JointState"
BEGUN = 1_700_000_000.0
URDF = """<robot name="arm"><link name="base"/><link name="upper"/><link name="fore"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0 0 0.2"/><axis xyz="0 0 2"/></joint>
<joint name="elbow" type="prismatic"><parent link="upper"/><child link="fore"/>
  <origin xyz="0.3 0 0"/></joint></robot>"""
ROBOT = """format = 1
[robot]
urdf = "arm.urdf"
joints = "JOINTS"
[[skin]]
name = "palm"
skin = "textile-disc-8"
link = "fore"
"""


def state(when, **positions):
    """A message of rosbags' own type, as CDR."""
    types, second = STORE.types, int(when)
    stamp = types["builtin_interfaces/msg/Time"](second, round(1e9 * (when - second)))
    header = types["std_msgs/msg/Header"](stamp, "")
    none, values = np.zeros(0), np.array([*positions.values()], float)
    return STORE.serialize_cdr(types[KIND](header, [*positions], values, none, none), KIND)


def write_bag(path, times, angle, name="/joint_states", kind=KIND, *, begun=BEGUN):
    """A bag of ROS 2 by the library of the format: ``angle(t)`` of the shoulder."""
    with path.open("wb") as file:
        bag = Writer(file, compression=CompressionType.ZSTD)
        bag.start(profile="ros2")
        channel = bag.register_channel(name, "cdr", bag.register_schema(kind, "ros2msg", b""))
        for t in times:
            data = bytes(state(begun + t, shoulder=angle(t), elbow=0.1))
            bag.add_message(channel, round(1e9 * (begun + t)), data, 0)
        bag.finish()


def placed(folder, joints):
    """The skin of a robot file whose joints are told by ``joints``, and what it publishes."""
    (folder / "arm.urdf").write_text(URDF)
    (folder / "robot.toml").write_text(ROBOT.replace("JOINTS", joints))
    place = with_joints(Robot.load(folder / "robot.toml")).skins[0].place
    return Stream.of(prepare(SKIN), "twin", BEGUN, place)


def test_touches_follow_a_link_that_moves(tmp_path):
    write_bag(tmp_path / "joints.mcap", np.arange(0, 10, 0.1), lambda t: 0.2 * t)
    stream = placed(tmp_path, "joints.mcap")
    for t in (1.0, 4.03):
        contacts = contacts_at(t, TOUCH, stream=stream)
        (contact,) = contacts.touches
        x, y = TOUCH.detection.x + 0.4, TOUCH.detection.y
        c, s = math.cos(0.2 * t), math.sin(0.2 * t)
        assert contact.root_position == pytest.approx((c * x - s * y, s * x + c * y, 0.2), abs=1e-6)
        assert contact.root_normal == pytest.approx((0, 0, 1))
        assert contact.position == (TOUCH.detection.x, TOUCH.detection.y, 0)  # of the link, as ever
        content = contacts.content()
        assert (content["frame_id"], content["root_problem"]) == ("fore", None)
        assert content["root"]["frame_id"] == "base"
        assert content["root"]["position"] == pytest.approx([0.4 * c, 0.4 * s, 0.2], abs=1e-6)
        turn = [0, 0, math.sin(0.1 * t), math.cos(0.1 * t)]
        assert content["root"]["orientation"] == pytest.approx(turn, abs=1e-6)
        assert content["touches"][0]["root_position"] == contact.root_position


@pytest.mark.parametrize(("when", "far"), [(11.0, "1.1"), (-2.0, "2.0")])
def test_beyond_the_states_the_pose_is_unknown(tmp_path, when, far):
    write_bag(tmp_path / "joints.mcap", np.arange(0, 10, 0.1), lambda t: t)
    contacts = contacts_at(when, TOUCH, stream=placed(tmp_path, "joints.mcap"))
    content = json.loads(json.dumps(contacts.content()))
    assert content["root"] is None
    assert content["touches"][0]["root_position"] is None
    assert content["touches"][0]["root_normal"] is None
    said = f'pose unknown: the nearest state of the joint "elbow" is {far} s from the frame'
    assert said in content["root_problem"]
    assert content["valid"]  # the touches are as true as before


def test_without_states_only_a_link_that_stands_has_a_pose(tmp_path):
    write_bag(tmp_path / "joints.mcap", [0.0], lambda t: t)
    stream = placed(tmp_path, "joints.mcap")
    alone = replace(stream, place=replace(stream.place, joints=None))
    problem = contacts_at(0.0, stream=alone).link.problem
    assert 'the joint "elbow" may move, and no joint states are given' in problem
    assert 'joints = "ros2"' in problem
    text = URDF.replace("revolute", "fixed").replace("prismatic", "fixed")
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "robot.toml").write_text(ROBOT.replace('joints = "JOINTS"', ""))
    fixed = Robot.load(tmp_path / "robot.toml").skins[0].place
    contacts = contacts_at(0.0, TOUCH, stream=replace(stream, place=fixed))
    assert contacts.link.problem is None
    assert contacts.link.pose.position == pytest.approx([0.3, 0, 0.2])


def test_an_angle_that_starts_anew_is_not_halfway(tmp_path):
    wrapped = {0.0: 3.1, 0.2: -3.1}
    write_bag(tmp_path / "joints.mcap", wrapped, wrapped.get)
    states = joint_states(str(tmp_path / "joints.mcap"))
    assert states(BEGUN + 0.05)("shoulder") == 3.1
    assert states(BEGUN + 0.15)("shoulder") == -3.1
    with pytest.raises(SkinError, match='of the joint "wrist" has not come'):
        states(BEGUN)("wrist")


def test_a_clock_that_is_set_back_begins_again():
    sent = [
        (0.0, STORE.deserialize_cdr(state(BEGUN + t, shoulder=t), KIND)) for t in (5, 6, 0, 0.1)
    ]
    states = JointStates(lambda: [sent.pop(0)] if sent else [], "an arm")
    assert states(BEGUN + 5.0)("shoulder") == pytest.approx(5.0, abs=1e-6)
    for _ in range(3):
        states(BEGUN)
    assert states(BEGUN + 0.05)("shoulder") == pytest.approx(0.05, abs=1e-6)
    with pytest.raises(SkinError, match="pose unknown"):
        states(BEGUN + 6.0)("shoulder")


@pytest.mark.parametrize(
    ("write", "said"),
    [
        (lambda path: path.unlink(missing_ok=True), "cannot be read"),
        (lambda path: path.write_bytes(b"sqlite"), "is not a complete MCAP file"),
        (
            lambda path: write_bag(path, [0.0], lambda t: t, kind="sensor_msgs/msg/Imu"),
            "expected messages of sensor_msgs/msg/JointState, got none",
        ),
    ],
)
def test_a_file_that_tells_no_joints(tmp_path, write, said):
    write(tmp_path / "joints.mcap")
    with pytest.raises(DataError, match=said):
        joint_states(str(tmp_path / "joints.mcap"))


@pytest.mark.parametrize(
    ("spec", "said"), [("ros2:domain=x", "expected a domain"), ("ros2:node=x", "expected domain=…")]
)
def test_what_cannot_be_meant(spec, said):
    with pytest.raises(SinkError, match=said):
        joint_states(spec)


def test_a_robot_that_runs_tells_how_it_stands(program, domain):
    states = joint_states("ros2:topic=/arm/joint_states")
    peer = program(str(PUBLISHER), domain, "rt/arm/joint_states")
    end, position = time.monotonic() + PATIENCE, None
    while position is None:
        assert time.monotonic() < end
        time.sleep(0.05)
        now = time.time()
        with contextlib.suppress(SkinError):  # it has not come
            position = states(now)("shoulder")
    assert position == pytest.approx(now % 100, abs=0.6)  # what it publishes
    assert states(now - 0.01)("shoulder") == pytest.approx((now - 0.01) % 100, abs=0.6)
    peer.stop()
    time.sleep(0.7)
    with pytest.raises(SkinError, match=r"is \d+\.\d s from the frame"):
        states(time.time())("shoulder")
