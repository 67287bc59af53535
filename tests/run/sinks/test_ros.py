"""Messages of ROS 2: their fields, their bytes, and the types' hashes.

No ROS 2 was there to try them on: hashes and bytes are compared with those of a library of others
(``rosbags``), which holds the types of each release.
"""

from __future__ import annotations

import struct
from dataclasses import fields, is_dataclass, replace

import msgspec
import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

from files.session.runs import TOUCH
from run.sinks.conftest import EPOCH, EVENT, MESH, VALUES, moment_at, touch_of
from tomoskin.core import Event, Force
from tomoskin.model.mesh import Cylinder
from tomoskin.model.robot import Place, Pose
from tomoskin.run.sinks import Contacts, Naming, ros_messages
from tomoskin.run.sinks.cdr import encode_cdr
from tomoskin.run.sinks.contact import contact_of
from tomoskin.run.sinks.ros import IMAGE, ODOMETRY, POSE, TEXT, TOPICS, RosView
from tomoskin.run.sinks.ros_types import TYPES, type_hash
from tomoskin.run.sinks.space import SpacePose


@pytest.fixture(scope="module", params=[Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY])
def store(request):
    """Types of a release of ROS 2, and those of tactile_msgs, which are not in it."""
    store = get_typestore(request.param)
    for kind in sorted(TYPES):
        if kind.startswith("tactile_msgs"):
            store.register(get_types_from_msg("\n".join(definition_of(kind)), kind))
    return store


def definition_of(kind):
    """Of tactile_msgs, as its authors have written it."""
    contact = (
        "std_msgs/Header header\nstring name\ngeometry_msgs/Point position\n"
        "geometry_msgs/Vector3 normal\ngeometry_msgs/Wrench wrench"
    )
    whole = "tactile_msgs/TactileContact[] contacts"
    return [whole if kind.endswith("Contacts") else contact]


@pytest.mark.parametrize("kind", sorted(TYPES))
def test_hashes_are_those_of_ros_2(store, kind):
    assert type_hash(kind) == store.hash_rihs01(kind)


def plain(value):
    """A message that was read, as fields by name."""
    if is_dataclass(value):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    return [plain(item) for item in value] if isinstance(value, list) else value


def same(read, written):
    """Whether what was read has the fields that were written."""
    if isinstance(read, dict):
        named = {key: item for key, item in read.items() if key.islower() and key[0] != "_"}
        return named.keys() == written.keys() and all(same(named[k], written[k]) for k in named)
    if isinstance(read, list):
        return len(read) == len(written) and all(map(same, read, written))
    if isinstance(read, np.ndarray) and isinstance(written, bytes):
        return read.tobytes() == written
    return (
        np.allclose(read, written, equal_nan=True) if not isinstance(read, str) else read == written
    )


def test_every_message_is_read_by_a_library_of_others(store, stream):
    whole = replace(stream, points=np.column_stack([MESH.centroids, np.zeros(len(MESH.cells))]))
    view = RosView(
        whole, Naming(mount=Place("", "tool0", Pose.of((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))))
    )
    read = []
    for message in [*view.of(moment_at(0.25, TOUCH, touch_of(5))), *view.of(EVENT)]:
        kind = TOPICS[message.topic]
        found = store.deserialize_cdr(encode_cdr(kind, message.value), kind)
        assert same(plain(found), message.value), message.topic
        read.append(message.topic)
    assert set(read) == TOPICS.keys()


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


def test_contacts_say_where_and_which_way(stream):
    radius, angle = 0.05, 0.6
    touch = replace(TOUCH, detection=replace(TOUCH.detection, x=radius * angle, y=0.02))
    curved = replace(stream, surface=Cylinder(radius), pixels=None)
    values = messages_of(curved, moment_at(0.25, touch))
    (contact,) = values["contacts"]["contacts"]
    assert contact["name"] == "skin/touch_4"
    assert [*contact["normal"].values()] == pytest.approx([np.sin(angle), 0, np.cos(angle)])
    forces = [*contact["wrench"]["force"].values()]
    assert np.isnan(forces).all()  # not measured, which is not zero
    assert np.isnan([*values["wrench"]["wrench"]["force"].values()]).all()


def pushing(touch, newtons):
    force = Force(newtons, 0.5 * newtons, 2 * newtons)
    return replace(touch, detection=replace(touch.detection, force=force))


def test_a_wrench_is_that_of_all_touches_about_the_origin(stream):
    touches = [contact_of(stream, pushing(touch, 2.0)) for touch in (TOUCH, touch_of(5))]
    found = replace(Contacts.of(stream, Naming(), moment_at(0.0)), touches=tuple(touches))
    value = ros_messages.wrench(ros_messages.header(0, "skin"), found)["wrench"]
    assert [*value["force"].values()] == [0, 0, -4]
    x, y = TOUCH.detection.x, TOUCH.detection.y
    assert [*value["torque"].values()] == pytest.approx([-4 * y, 4 * x, 0])
    none = ros_messages.wrench({}, Contacts.of(stream, Naming(), moment_at(0.0)))
    assert [*none["wrench"]["force"].values()] == [0, 0, 0]


def test_markers_replace_those_before(stream):
    shown = messages_of(stream, moment_at(0.25, TOUCH))["markers"]["markers"]
    assert [(m["ns"], m["action"], m["type"]) for m in shown] == [
        ("", 3, 0), ("touch", 0, 2), ("label", 0, 9),
    ]  # fmt: skip
    width = 2 * np.sqrt(TOUCH.detection.area / np.pi)
    assert [*shown[1]["scale"].values()] == pytest.approx([width, width, 0.2 * width])
    assert shown[2]["text"] == "4"


def test_points_lie_on_the_surface(stream):
    places = np.random.default_rng(3).normal(size=(len(VALUES), 3))
    value = messages_of(replace(stream, points=places), moment_at(0.0))["points"]
    cloud = np.frombuffer(value["data"], "<f4").reshape(value["width"], 4)
    assert np.allclose(cloud, np.column_stack([places, VALUES]), atol=1e-6)
    assert value["row_step"] == len(value["data"]) == value["width"] * value["point_step"]


def test_a_report_says_whether_touches_are_valid(stream):
    view = RosView(stream, Naming())
    lost = replace(moment_at(0.1), valid=False, problem="E4 is dead")
    reports = {
        moment.host_time: [m.value for m in view.of(moment) if m.topic == "/diagnostics"]
        for moment in (moment_at(0.0), lost, replace(lost, host_time=0.9), moment_at(1.0))
    }
    assert [len(report) for report in reports.values()] == [1, 1, 0, 1]
    levels = [
        (r[0]["status"][0]["level"], r[0]["status"][0]["message"]) for r in reports.values() if r
    ]
    assert levels == [(0, "OK"), (2, "E4 is dead"), (0, "OK")]


def test_a_frame_on_a_robot_is_a_transform(stream):
    turn = (0.3, -0.4, 1.2)
    mount = Place("", "tool0", Pose.of((0.1, 0.2, 0.3), turn))
    view = RosView(stream, Naming("left_arm", mount=mount))
    (value,) = (m.value for m in view.of(moment_at(0.0)) if m.topic == "/tf_static")
    (found,) = value["transforms"]
    assert (found["header"]["frame_id"], found["child_frame_id"]) == ("tool0", "left_arm/skin")
    wanted = Rotation.from_euler("xyz", turn)
    rotation = Rotation.from_quat([*found["transform"]["rotation"].values()])
    assert (rotation.inv() * wanted).magnitude() == pytest.approx(0, abs=1e-12)
    assert not [m for m in RosView(stream, Naming()).of(moment_at(0.0)) if m.topic == "/tf_static"]


def test_an_image_is_of_floats_with_the_top_row_first(stream):
    cdr = Cdr(encode_cdr(IMAGE, messages_of(stream, moment_at(0.0))["image"]))
    cdr.header()
    height, width = cdr.take("I"), cdr.take("I")
    assert (cdr.text(), cdr.take("B"), cdr.take("I")) == ("32FC1", 0, 4 * width)
    values = np.frombuffer(cdr.data[cdr.place + 4 :], "<f4").reshape(height, width)
    assert cdr.take("I") == values.nbytes
    expected = stream.pixels.spread(VALUES).astype("f4")
    assert np.array_equal(values, expected, equal_nan=True)


def test_what_is_sent_when(stream):
    view = RosView(stream, Naming())
    sent = [
        [m.topic for m in view.of(moment)]
        for moment in (
            moment_at(0.0, TOUCH), moment_at(0.1), moment_at(0.2),
            replace(moment_at(0.3), messages=(Event(0.3, "touch-release", "touch 4 ends"),)),
            replace(moment_at(0.4), valid=False), moment_at(1.5),
        )
    ]  # fmt: skip
    always = ["touches", "contacts", "wrench", "markers"]
    assert sent[0] == ["touch", "track", *always, "image", "/diagnostics"]
    assert sent[1] == [*always, "image"]  # the last touch has ended
    assert sent[2] == ["image"]
    assert sent[3] == ["events", "image"]
    assert sent[4] == [*always, "image", "/diagnostics"]  # it cannot be said any more
    assert sent[5] == [*always, "image", "/diagnostics"]  # once a second in any case


def test_texts_are_json(stream):
    view = RosView(replace(stream, clock=lambda: 0.262), Naming())
    first = moment_at(0.25, TOUCH, touch_of(5), sequence=7)
    touched = {m.topic: m.value for m in view.of(first)}
    told = msgspec.json.decode(touched["touches"]["data"])
    assert [t.pop("id") for t in told["touches"]] == [4, 5]
    (found, _) = told.pop("touches")
    assert told == {
        "host_time": 0.25, "utc_s": EPOCH + 0.25, "skin": stream.skin, "frame_id": "skin",
        "sequence": 7, "latency_s": 0.012, "valid": True, "problem": None,
    }  # fmt: skip
    assert found["position"] == [TOUCH.detection.x, TOUCH.detection.y, 0]
    assert (found["normal"], found["covariance"], found["force"]) == ([0, 0, 1], None, None)
    reading = replace(TOUCH.detection, sd_x=1e-3, sd_y=2e-3, cov_xy=5e-7)
    sure = Contacts.of(stream, Naming(), moment_at(0.3, replace(TOUCH, detection=reading)))
    expected = [[1e-6, 5e-7, 0], [5e-7, 4e-6, 0], [0, 0, 0]]
    assert sure.touches[0].content()["covariance"] == pytest.approx(np.array(expected))
    assert sure.latency is None  # the stream has no clock
    (event,) = view.of(EVENT)
    cdr = Cdr(encode_cdr(TEXT, event.value))
    assert msgspec.json.decode(cdr.text()) == {
        "time_s": 0.5, "kind": "connected", "text": "board 01",
        "utc_s": EPOCH + 0.5, "skin": stream.skin, "frame_id": "skin",
    }  # fmt: skip
