"""Standard ROS 2 messages: the bytes, the types' hashes, and a node that is a stand-in.

No ROS 2 was there to try them on: the hashes are those of its own releases, the bytes are read
back by the rules of CDR, and the node has rclpy's calls.
"""

from __future__ import annotations

import struct
import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from recording.runs import TOUCH
from sink.conftest import EPOCH, EVENT, VALUES, moment_at, touch_of
from tomoskin.core import Event, SinkError
from tomoskin.mesh import Cylinder
from tomoskin.sink import make_sink
from tomoskin.sink.naming import Naming, SpacePose
from tomoskin.sink.ros import (
    IMAGE,
    ODOMETRY,
    POSE,
    TEXT,
    TOPICS,
    TYPES,
    RosView,
    encode_cdr,
    type_hash,
)


@pytest.mark.parametrize(
    ("kind", "digest"),
    [
        (TEXT, "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
        (IMAGE, "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"),
        # has the covariance that our pose has
        (ODOMETRY, "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
    ],
)
def test_hashes_are_those_of_ros_2(kind, digest):
    assert type_hash(kind) == f"RIHS01_{digest}"


class Cdr:
    """Reads CDR; every number is aligned to its own size from behind the first four bytes."""

    def __init__(self, data):
        assert data[:4] == b"\x00\x01\x00\x00"
        self.data, self.place = data[4:], 0

    def take(self, layout):
        size = struct.calcsize("<" + layout)
        self.place += -self.place % size
        (value,) = struct.unpack_from("<" + layout, self.data, self.place)
        self.place += size
        return value

    def text(self):
        length = self.take("I")
        self.place += length
        data = self.data[self.place - length : self.place]
        assert data.endswith(b"\0")
        return data[:-1].decode()

    def header(self):
        return self.take("i") + 1e-9 * self.take("I"), self.text()

    def ends(self):
        return self.place == len(self.data)


def messages_of(stream, item):
    return {message.topic: message.value for message in RosView(stream, Naming()).of(item)}


def test_a_touch_is_a_pose_with_covariance(stream):
    value = messages_of(stream, moment_at(0.25, TOUCH))["touch"]
    cdr = Cdr(encode_cdr(POSE, value))
    assert cdr.header() == (pytest.approx(EPOCH + 0.25), "skin")
    pose = [cdr.take("d") for _ in range(7)]
    assert pose == [TOUCH.detection.x, TOUCH.detection.y, 0, 0, 0, 0, 1]
    covariance = np.array([cdr.take("d") for _ in range(36)]).reshape(6, 6)
    assert cdr.ends()
    assert covariance[0, 0] == TOUCH.detection.sd_x**2
    assert (np.diag(covariance)[1:] == 1e6).all()  # its sd_y is not known
    assert (covariance == np.diag(np.diag(covariance))).all()
    reading = replace(TOUCH.detection, sd_y=2e-3, cov_xy=5e-7)
    moment = moment_at(0.25, replace(TOUCH, detection=reading))
    value = messages_of(stream, moment)["touch"]
    assert value["pose"]["covariance"][[1, 6]].tolist() == [5e-7, 5e-7]


def test_a_track_says_whose_pose_it_is(stream):
    view = RosView(stream, Naming("left_arm"))
    tracks = [m for m in view.of(moment_at(0.25, TOUCH, touch_of(5))) if m.topic == "track"]
    for message, number in zip(tracks, (4, 5), strict=True):
        cdr = Cdr(encode_cdr(ODOMETRY, message.value))
        assert cdr.header() == (pytest.approx(EPOCH + 0.25), "left_arm/skin")
        assert cdr.text() == f"left_arm/skin/touch_{number}"
        assert [cdr.take("d") for _ in range(3)] == [TOUCH.detection.x, TOUCH.detection.y, 0]
        rest = [cdr.take("d") for _ in range(4 + 36 + 6 + 36)]
        assert rest[4 + 36 :][:7] == [0] * 6 + [1e6]  # velocities are not known
        assert cdr.ends()


def test_on_a_curved_skin_a_touch_is_where_it_is_in_space(stream):
    radius, angle = 0.05, 0.6
    detection = replace(TOUCH.detection, x=radius * angle, y=0.02, sd_x=1e-3, sd_y=2e-3)
    touch = replace(TOUCH, detection=detection)
    curved = replace(stream, surface=Cylinder(radius), pixels=None)
    value = messages_of(curved, moment_at(0.25, touch))
    pose = value["touch"]["pose"]
    place = np.array([*pose["pose"]["position"].values()])
    x, height = radius * np.sin(angle), radius * (np.cos(angle) - 1)
    assert place == pytest.approx([x, 0.02, height])
    turn = Rotation.from_quat([*pose["pose"]["orientation"].values()])
    assert turn.as_rotvec() == pytest.approx([0, angle, 0])  # about the cylinder's axis
    local = turn.as_matrix().T @ pose["covariance"].reshape(6, 6)[:3, :3] @ turn.as_matrix()
    assert np.diag(local) == pytest.approx([1e-6, 4e-6, 1e6], rel=1e-3)
    (told,) = msgspec.json.decode(value["touches"]["data"])["touches"]
    assert told["position"] == pytest.approx(place.tolist())
    assert told["normal"] == pytest.approx([np.sin(angle), 0, np.cos(angle)])


@pytest.mark.parametrize("turn", [(0, 0, 3.1), (0, 3.1, 0), (-3, 0.1, 0), (1, 2, -1)])
def test_an_orientation_is_that_of_its_axes(turn):
    wanted = Rotation.from_rotvec(turn)
    pose = SpacePose((0.0, 0.0, 0.0), tuple(wanted.as_matrix().T.tolist()), np.empty((3, 2)))
    found = Rotation.from_quat(pose.quaternion())
    assert (found.inv() * wanted).magnitude() == pytest.approx(0, abs=1e-12)


def test_two_skins_do_not_meet(rclpy, stream):
    sinks = [make_sink("ros2"), make_sink("ros2:namespace=left_arm,frame=left_forearm")]
    for sink in sinks:
        sink.open(stream)
        sink.publish(moment_at(0.25, TOUCH))
        sink.close()
    headed = [(topic, msg) for topic, msg in rclpy.published if "touches" not in topic]
    frames = {topic: msg.header.frame_id for topic, msg in headed}
    assert frames["/tomoskin/track"] == "skin"
    assert frames["/left_arm/track"] == "left_forearm"
    assert {topic.rpartition("/")[2] for topic in frames} == TOPICS.keys() - {"touches", "events"}


def test_an_image_is_of_floats_with_the_top_row_first(stream):
    cdr = Cdr(encode_cdr(IMAGE, messages_of(stream, moment_at(0.0))["image"]))
    cdr.header()
    height, width = cdr.take("I"), cdr.take("I")
    assert (cdr.text(), cdr.take("B"), cdr.take("I")) == ("32FC1", 0, 4 * width)
    values = np.frombuffer(cdr.data[cdr.place + 4 :], "<f4").reshape(height, width)
    assert cdr.take("I") == values.nbytes
    expected = stream.pixels.spread(VALUES).astype("f4")
    assert np.array_equal(values, expected, equal_nan=True)


def test_texts_are_json(stream):
    view = RosView(stream, Naming())
    touched = {m.topic: m.value for m in view.of(moment_at(0.0, TOUCH, touch_of(5), sequence=7))}
    told = msgspec.json.decode(touched["touches"]["data"])
    assert (told["sequence"], [t["id"] for t in told["touches"]]) == (7, [4, 5])
    after = [m.topic for m in view.of(moment_at(0.1))]
    assert after == ["touches", "image"]
    assert [m.topic for m in view.of(moment_at(0.2))] == ["image"]
    ended = replace(moment_at(0.3), told=(Event(0.3, "touch-release", "touch 4 ends"),))
    assert [m.topic for m in view.of(ended)] == ["events", "image"]
    (event,) = view.of(EVENT)
    cdr = Cdr(encode_cdr(TEXT, event.value))
    assert msgspec.json.decode(cdr.text()) == {
        "time_s": 0.5, "kind": "connected", "text": "board 01",
        "utc_s": EPOCH + 0.5, "skin": stream.skin, "frame_id": "skin",
    }  # fmt: skip


def message_class(kind):
    """A class as rosidl makes it: its fields are there, no others can be set."""
    defaults = {"string": "", "float64": 0.0}

    class Message:
        __slots__ = tuple(TYPES[kind])

        def __init__(self):
            for name, text in TYPES[kind].items():
                nested = message_class(text)() if text in TYPES else None
                setattr(self, name, nested or defaults.get(text, 0))

    return Message


class Rclpy(ModuleType):
    """Stands in for rclpy, with the signatures of its calls."""

    def __init__(self):
        super().__init__("rclpy")
        self.published, self.log = [], []

    def Context(self):  # noqa: N802
        return SimpleNamespace(ok=False)

    def init(self, *, args=None, context=None, signal_handler_options=None):
        assert args == []
        assert signal_handler_options is None  # of a context of one's own: none
        context.ok = True

    def create_node(self, node_name, *, context=None, namespace=None):
        assert context.ok
        assert namespace.startswith("/")
        self.log.append(node_name)

        def create_publisher(msg_type, topic, qos_profile):
            assert qos_profile > 0

            def publish(msg):
                assert isinstance(msg, msg_type)
                self.published.append((f"{namespace}/{topic}", msg))

            return SimpleNamespace(publish=publish)

        return SimpleNamespace(
            create_publisher=create_publisher, destroy_node=lambda: self.log.append("destroy")
        )

    def shutdown(self, *, context=None):
        self.log.append("shutdown")
        context.ok = False


@pytest.fixture
def rclpy(monkeypatch):
    fake = Rclpy()
    monkeypatch.setitem(sys.modules, "rclpy", fake)
    for kind in (POSE, ODOMETRY, IMAGE, TEXT):
        package, _, name = kind.rpartition("/")
        module = ModuleType(package.replace("/", "."))
        setattr(module, name, message_class(kind))
        monkeypatch.setitem(sys.modules, package.partition("/")[0], ModuleType("package"))
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return fake


def test_a_node_publishes_the_same_messages(rclpy, stream):
    sink = make_sink("ros2")
    for _ in range(2):  # it may be opened again
        rclpy.published.clear()
        sink.open(stream)
        sink.publish(moment_at(0.25, TOUCH))
        sink.publish(EVENT)
        sink.close()
    topics = [topic.removeprefix("/tomoskin/") for topic, _ in rclpy.published]
    assert topics == ["touch", "track", "touches", "image", "events"]
    pose = rclpy.published[0][1]
    assert pose.pose.pose.position.x == TOUCH.detection.x
    assert pose.header.stamp.sec == int(EPOCH)
    assert rclpy.log == ["tomoskin", "destroy", "shutdown"] * 2
    sink.close()


def test_without_ros_2_it_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(SinkError, match=r"rclpy.*setup\.bash.*--sink zenoh"):
        make_sink("ros2")
    for wrong in ("node", "namespace=left arm", "namespace=/arm", "frame=", "name=x"):
        with pytest.raises(SinkError, match="expected"):
            make_sink(f"ros2:{wrong}")
