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

from files.session.runs import FOLD, TOUCH
from run.sinks.conftest import EPOCH, EVENT, MESH, VALUES, contacts_at, result_at, touch_of
from tomoskin.core import Amount, Event
from tomoskin.extras.ros2.ros_types import TYPES, encode_cdr, type_hash
from tomoskin.extras.ros2.ros_view import IMAGE, ODOMETRY, POSE, TEXT, TOPICS, ros_messages
from tomoskin.files.messages import Contact, Naming, Place, Reporter
from tomoskin.model.mesh import Cylinder, Pose
from tomoskin.pipeline import Cause, Diagnosis
from tomoskin.sensing.track import TouchEvent


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
    """Whether what was read has the fields that were written, and nothing in the others."""
    if isinstance(read, dict):
        named = {key: item for key, item in read.items() if key.islower() and key[0] != "_"}
        assert written.keys() <= named.keys()
        return all(same(v, written[k]) if k in written else empty(v) for k, v in named.items())
    if isinstance(read, list):
        return len(read) == len(written) and all(map(same, read, written))
    if isinstance(read, np.ndarray) and isinstance(written, bytes):
        return read.tobytes() == written
    return (
        np.allclose(read, written, equal_nan=True) if not isinstance(read, str) else read == written
    )


def empty(read):
    """Whether there is nothing in it: zeros, no text, no items."""
    if isinstance(read, dict):
        named = {key: item for key, item in read.items() if key.islower() and key[0] != "_"}
        return all(map(empty, named.values()))
    return not np.any(read) if isinstance(read, np.ndarray) else not read


def test_every_message_is_read_by_a_library_of_others(store, stream):
    mount = Place("", "tool0", Pose.of((0.1, 0.2, 0.3), (0.1, 0.2, 0.3)))
    points = np.column_stack([MESH.centroids, np.zeros(len(MESH.cells))])
    whole = replace(stream, points=points).named(Naming(mount=mount))
    read = []
    items = contacts_at(0.25, TOUCH, touch_of(5), stream=whole), EVENT
    for message in (message for item in items for message in ros_messages(whole, item)):
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


def messages_of(stream, *at):
    """Values by topic: of a time and its touches, or of what is given."""
    item = contacts_at(*at, stream=stream) if isinstance(at[0], float) else at[0]
    return {message.topic: message.value for message in ros_messages(stream, item)}


def test_a_touch_is_a_pose_with_covariance(stream):
    value = messages_of(stream, 0.25, TOUCH)["touch"]
    cdr = Cdr(encode_cdr(POSE, value))
    assert cdr.header() == (pytest.approx(EPOCH + 0.25), "skin")
    pose = [cdr.take("d") for _ in range(7)]
    assert pose == [TOUCH.detection.x, TOUCH.detection.y, 0, 0, 0, 0, 1]
    covariance = np.array([cdr.take("d") for _ in range(36)]).reshape(6, 6)
    assert cdr.ends()
    assert covariance[0, 0] == TOUCH.detection.sd_x**2
    turn = np.pi**2 / 3
    assert np.diag(covariance)[1:] == pytest.approx([1.0, 1e-4, turn, turn, turn])  # sd_y unknown
    assert (covariance == np.diag(np.diag(covariance))).all()
    reading = replace(TOUCH.detection, sd_y=2e-3, cov_xy=5e-7)
    value = messages_of(stream, 0.25, replace(TOUCH, detection=reading))["touch"]
    assert value["pose"]["covariance"][[1, 6]].tolist() == [5e-7, 5e-7]


def test_a_track_says_whose_pose_it_is(stream):
    named = stream.named(Naming("left_arm"))
    contacts = contacts_at(0.25, TOUCH, touch_of(5), stream=named)
    tracks = [m for m in ros_messages(named, contacts) if m.topic == "track"]
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
    value = messages_of(curved, 0.25, touch)
    pose = value["touch"]["pose"]
    place = np.array([*pose["pose"]["position"].values()])
    x, height = radius * np.sin(angle), radius * (np.cos(angle) - 1)
    assert place == pytest.approx([x, 0.02, height])
    turn = Rotation.from_quat([*pose["pose"]["orientation"].values()])
    assert turn.as_rotvec() == pytest.approx([0, angle, 0])  # about the cylinder's axis
    local = turn.as_matrix().T @ pose["covariance"].reshape(6, 6)[:3, :3] @ turn.as_matrix()
    assert np.diag(local) == pytest.approx([1e-6, 4e-6, 1e-4], rel=1e-3)
    (told,) = msgspec.json.decode(value["touches"]["data"])["touches"]
    assert told["position"] == pytest.approx(place.tolist())
    assert told["normal"] == pytest.approx([np.sin(angle), 0, np.cos(angle)])


@pytest.mark.parametrize("turn", [(0, 0, 3.1), (0, 3.1, 0), (-3, 0.1, 0), (1, 2, -1)])
def test_an_orientation_is_that_of_its_axes(turn):
    wanted = Rotation.from_rotvec(turn)
    axes = tuple(wanted.as_matrix().T.tolist())
    contact = Contact(TOUCH, (0.0, 0.0, 0.0), axes, np.empty((3, 2)))
    found = Rotation.from_quat(contact.orientation)
    assert (found.inv() * wanted).magnitude() == pytest.approx(0, abs=1e-12)


def test_contacts_say_where_and_which_way(stream):
    radius, angle = 0.05, 0.6
    touch = replace(TOUCH, detection=replace(TOUCH.detection, x=radius * angle, y=0.02))
    curved = replace(stream, surface=Cylinder(radius), pixels=None)
    values = messages_of(curved, 0.25, touch)
    (contact,) = values["contacts"]["contacts"]
    assert contact["name"] == "skin/touch_4"
    assert [*contact["normal"].values()] == pytest.approx([np.sin(angle), 0, np.cos(angle)])
    forces = [*contact["wrench"]["force"].values()]
    assert np.isnan(forces).all()  # not measured, which is not zero
    assert np.isnan([*values["wrench"]["wrench"]["force"].values()]).all()


def pushing(touch, newtons):
    force = Amount(newtons, 0.5 * newtons, 2 * newtons)
    return replace(touch, detection=replace(touch.detection, force=force))


def test_a_wrench_is_that_of_all_touches_about_the_origin(stream):
    values = messages_of(stream, 0.0, pushing(TOUCH, 2.0), pushing(touch_of(5), 2.0))
    value = values["wrench"]["wrench"]
    assert [*value["force"].values()] == [0, 0, -4]
    x, y = TOUCH.detection.x, TOUCH.detection.y
    assert [*value["torque"].values()] == pytest.approx([-4 * y, 4 * x, 0])
    for contact in values["contacts"]["contacts"]:
        assert [*contact["wrench"]["torque"].values()] == pytest.approx([-2 * y, 2 * x, 0])
    weighed = Reporter(stream).of(result_at(0.0, calibrated=frozenset({"force"})))
    none = messages_of(stream, weighed)["wrench"]["wrench"]
    assert [*none["force"].values()] == [0, 0, 0]
    unknown = messages_of(stream, 0.0)["wrench"]["wrench"]
    assert np.isnan([*unknown["force"].values()]).all()


@pytest.mark.parametrize("blind", [{"ready": False}, {"has_image": False, "left_out": 40}])
def test_what_a_blind_skin_says_is_not_that_nothing_touches(stream, blind):
    values = messages_of(stream, Reporter(stream).of(result_at(0.0, **blind)))
    assert values["valid"] == {"data": False}
    assert not msgspec.json.decode(values["touches"]["data"])["valid"]
    assert "contacts" not in values
    for part in ("force", "torque"):
        assert np.isnan([*values["wrench"]["wrench"][part].values()]).all()
    assert values["/diagnostics"]["status"][0]["level"] == 2


def test_a_lost_source_says_so_once_and_reports_on(stream):
    now = [1.0]
    live = replace(stream, clock=lambda: now[0])
    reporter = Reporter(live)
    reporter.of(result_at(0.9, TOUCH))
    assert reporter.silent() is None
    assert reporter.lost(EVENT) is None
    sent = [messages_of(live, reporter.lost(Event(0.95, "source-lost", "the cable is out")))]
    for now[0] in (1.9, 2.8):
        sent.append(messages_of(live, reporter.silent()))
    assert sent[0]["valid"] == {"data": False}
    assert msgspec.json.decode(sent[0]["touches"]["data"])["touches"] == []
    assert [set(values) for values in sent[1:]] == [{"rows", "/diagnostics"}] * 2
    status = [values["/diagnostics"]["status"][0] for values in sent]
    assert {(s["level"], s["message"]) for s in status} == {(2, "the cable is out")}
    stamps = [values["/diagnostics"]["header"]["stamp"] for values in sent]
    assert [stamp["sec"] + 1e-9 * stamp["nanosec"] - EPOCH for stamp in stamps] == pytest.approx(
        [1.0, 1.9, 2.8], abs=1e-6
    )
    back = messages_of(live, reporter.of(result_at(3.0)))
    assert (back["valid"]["data"], reporter.silent()) == (True, None)


def test_a_deformation_is_in_the_text_and_in_the_report(stream):
    bent = replace(contacts_at(0.25, TOUCH, stream=stream), deformation=FOLD)
    values = messages_of(stream, bent)
    told = msgspec.json.decode(values["touches"]["data"])["deformation"]
    assert (told["kind"], told["amount"]["high"], told["text"]) == ("fold", 0.4, FOLD.text)
    assert value_of(values, "deformation") == FOLD.text
    assert value_of(messages_of(stream, 0.5), "deformation") == "none"


def test_markers_replace_those_before(stream):
    shown = messages_of(stream, 0.25, TOUCH)["markers"]["markers"]
    assert [(m.get("ns"), m.get("action"), m.get("type")) for m in shown] == [
        (None, 3, None), ("touch", None, 2), ("label", None, 9),
    ]  # fmt: skip
    width = 2 * np.sqrt(TOUCH.detection.area / np.pi)
    assert [*shown[1]["scale"].values()] == pytest.approx([width, width, 0.2 * width])
    assert shown[2]["text"] == "4"


def test_points_lie_on_the_surface(stream):
    places = np.random.default_rng(3).normal(size=(len(VALUES), 3))
    value = messages_of(replace(stream, points=places), 0.0)["points"]
    cloud = np.frombuffer(value["data"], "<f4").reshape(value["width"], 4)
    assert np.allclose(cloud, np.column_stack([places, VALUES]), atol=1e-6)
    assert value["row_step"] == len(value["data"]) == value["width"] * value["point_step"]


def test_a_report_says_whether_touches_are_valid(stream):
    reporter = Reporter(stream)
    lost = {"has_image": False, "diagnoses": (Diagnosis(Cause.NO_IMAGE, "E4 is dead"),)}
    results = result_at(0.0), result_at(0.1, **lost), result_at(0.9, **lost), result_at(1.0)
    reports = [messages_of(stream, reporter.of(r)).get("/diagnostics") for r in results]
    levels = [(r["status"][0]["level"], r["status"][0]["message"]) for r in reports if r]
    assert [report is not None for report in reports] == [True, True, False, True]
    assert levels == [(0, "OK"), (2, "E4 is dead"), (0, "OK")]


def value_of(values, key):
    """What the report says of the skin by that name."""
    (status,) = values["/diagnostics"]["status"]
    (value,) = (row["value"] for row in status["values"] if row["key"] == key)
    return value


def test_what_is_not_known_is_drawn_in_the_size_of_a_skin(stream):
    unknown = replace(TOUCH, detection=replace(TOUCH.detection, sd_x=np.inf, sd_y=np.inf))
    covariance = messages_of(stream, 0.25, unknown)["touch"]["pose"]["covariance"].reshape(6, 6)
    assert 0.01 <= np.sqrt(np.diag(covariance))[:3].max() <= 1.0  # m
    assert np.sqrt(np.diag(covariance))[3:] == pytest.approx(np.pi / np.sqrt(3))


def test_a_frame_on_a_robot_is_a_transform(stream):
    turn = (0.3, -0.4, 1.2)
    mount = Place("", "tool0", Pose.of((0.1, 0.2, 0.3), turn))
    value = messages_of(stream.named(Naming("left_arm", mount=mount)), 0.0)["/tf_static"]
    (found,) = value["transforms"]
    assert (found["header"]["frame_id"], found["child_frame_id"]) == ("tool0", "left_arm/skin")
    wanted = Rotation.from_euler("xyz", turn)
    rotation = Rotation.from_quat([*found["transform"]["rotation"].values()])
    assert (rotation.inv() * wanted).magnitude() == pytest.approx(0, abs=1e-12)
    alone = messages_of(stream, 0.0)
    assert "/tf_static" not in alone
    assert value_of(alone, "parent").startswith("none: parent=LINK")
    mounted = messages_of(stream.named(Naming(mount=mount)), 0.0)
    assert value_of(mounted, "parent") == "tool0"


def test_an_image_is_of_floats_with_the_top_row_first(stream):
    cdr = Cdr(encode_cdr(IMAGE, messages_of(stream, 0.0)["image"]))
    cdr.header()
    height, width = cdr.take("I"), cdr.take("I")
    assert (cdr.text(), cdr.take("B"), cdr.take("I")) == ("32FC1", 0, 4 * width)
    values = np.frombuffer(cdr.data[cdr.place + 4 :], "<f4").reshape(height, width)
    assert cdr.take("I") == values.nbytes
    expected = stream.pixels.spread(VALUES).astype("f4")
    assert np.array_equal(values, expected, equal_nan=True)


def test_what_is_sent_when(stream):
    reporter = Reporter(stream, image_period=0.0)
    release = TouchEvent("release", TOUCH, 0.3)
    sent = [
        [m.topic for m in ros_messages(stream, reporter.of(result))]
        for result in (
            result_at(0.0, TOUCH), result_at(0.1), result_at(0.2),
            result_at(0.3, events=(release,)), result_at(0.4, has_image=False), result_at(1.5),
        )
    ]  # fmt: skip
    first = ["touches", "valid", "contacts", "wrench"]
    always = [*first, "markers"]
    seen, report = ["voltages", "image"], ["rows", "/diagnostics"]
    assert sent[0] == [*first, "touch", "track", "/tf", "markers", *seen, *report]
    assert sent[1] == [*always, *seen]  # the last touch has ended
    assert sent[2] == seen
    assert sent[3] == ["events", *seen]
    assert sent[4] == ["touches", "valid", "wrench", "markers", "voltages", *report]  # it is blind
    assert sent[5] == [*always, *seen, *report]  # once a second in any case


def test_texts_are_json(stream):
    live = replace(stream, clock=lambda: 0.262)
    first = contacts_at(0.25, TOUCH, touch_of(5), sequence=7, stream=live)
    touched = messages_of(live, first)
    told = msgspec.json.decode(touched["touches"]["data"])
    assert [t.pop("id") for t in told["touches"]] == [4, 5]
    (found, _) = told.pop("touches")
    assert told == {
        "host_time": 0.25, "utc_s": EPOCH + 0.25, "scan_s": None, "frame_id": "skin",
        "skin": stream.skin, "sequence": 7, "latency_s": 0.012, "valid": True, "problem": None,
        "deformation": None,
    }  # fmt: skip
    assert found["position"] == [TOUCH.detection.x, TOUCH.detection.y, 0]
    assert (found["normal"], found["covariance"], found["force"]) == ([0, 0, 1], None, None)
    reading = replace(TOUCH.detection, sd_x=1e-3, sd_y=2e-3, cov_xy=5e-7)
    sure = contacts_at(0.3, replace(TOUCH, detection=reading))
    expected = [[1e-6, 5e-7, 0], [5e-7, 4e-6, 0], [0, 0, 0]]
    assert sure.touches[0].content()["covariance"] == pytest.approx(np.array(expected))
    assert sure.latency is None  # the stream has no clock
    (event,) = ros_messages(live, EVENT)
    cdr = Cdr(encode_cdr(TEXT, event.value))
    assert msgspec.json.decode(cdr.text()) == {
        "time_s": 0.5, "kind": "connected", "text": "board 01",
        "utc_s": EPOCH + 0.5, "skin": stream.skin, "frame_id": "skin",
    }  # fmt: skip
