"""The robot file and its URDF: poses, and what cannot be meant."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tomoskin.core import SkinError
from tomoskin.extras.robot import Robot, Urdf, add_skin
from tomoskin.files.messages import Place
from tomoskin.model.mesh import Cylinder, Plane, Pose

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><visual><origin xyz="0 0 0.1"/><geometry><mesh filename="u.stl"/></geometry>
  </visual></link>
  <link name="fore"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.2" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.3 0 0"/></joint>
</robot>
"""
ROBOT = """format = 1
[robot]
name = "an arm"
urdf = "arm.urdf"

[[skin]]
name = "left"
skin = "textile-disc-8"
source = "twin:seed=1"
link = "fore"
position = ["10 mm", "0 mm", "30 mm"]
angles = ["0 deg", "90 deg", "0 deg"]
calibration = ["touch.npz", "bend.npz"]

[[skin]]
name = "right"
skin = "own.toml"
source = "replay:run.mcap@2"
board = "0102"
calibration = "force.npz"
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "robot.toml").write_text(ROBOT)
    return tmp_path


def test_a_robot_is_read_with_its_files_beside_it(files):
    robot = Robot.load(files / "robot.toml")
    left, right = robot.skins
    assert (left.name, left.skin, left.place.link) == ("left", "textile-disc-8", "fore")
    assert left.place.pose.position.tolist() == [0.01, 0, 0.03]
    assert right.skin == str(files / "own.toml")
    assert right.source == f"replay:{files / 'run.mcap@2'}"
    assert left.calibrations == (files / "touch.npz", files / "bend.npz")
    assert right.calibrations == (files / "force.npz",)
    assert robot.urdf.pose("fore").position == pytest.approx([0, 0.3, 0.2])
    assert right.place.in_root(0.0) is None
    assert robot.urdf.root == "base"
    assert robot.urdf.bones() == (("base", "upper"), ("upper", "fore"))
    assert robot.urdf.bones(without=["base"]) == (("upper", "fore"),)


@pytest.mark.parametrize("angles", [(0.1, 0, 0), (0, 0.5, -2), (3, -1, 0.2)])
def test_angles_are_a_urdfs(angles):
    pose = Pose.of((0.1, 0.2, 0.3), angles)
    assert pose.rotation == pytest.approx(Rotation.from_euler("xyz", angles).as_matrix())
    inner = Pose.of((0, 0, 1), (0.3, 0, 0))
    point = np.array([[1.0, 2.0, 3.0]])
    assert (pose @ inner)(point) == pytest.approx(pose(inner(point)))


def test_a_rotation_is_a_quaternion():
    for angles in ((0.3, -0.4, 1.2), (np.pi, 0, 0), (0, np.pi, 0.1), (0, 0, 3.1)):
        found = Rotation.from_quat(Pose.of((0, 0, 0), angles).quaternion())
        assert (found.inv() * Rotation.from_euler("xyz", angles)).magnitude() < 1e-7


def test_a_moved_surface_is_the_surface_moved():
    pose = Pose.of((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    cylinder = Cylinder(0.05)
    moved = Place("left", "fore", pose).moved(cylinder)
    uv = np.array([[0.01, 0.02], [-0.02, 0.0]])
    assert moved.point(uv) == pytest.approx(pose(cylinder.point(uv)))
    assert moved.normal(uv) == pytest.approx(cylinder.normal(uv) @ pose.rotation.T)
    assert moved.metric(uv) == pytest.approx(cylinder.metric(uv))
    step = 1e-6
    aside = np.array([step, 0.0])
    slope = (moved.point(uv + aside) - moved.point(uv - aside)) / (2 * step)
    assert moved.jacobian(uv)[:, :, 0] == pytest.approx(slope, abs=1e-6)
    plane = Plane()
    assert Place("left", "", pose).moved(plane) is plane


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "right"', 'name = "left"', "two skins have the same name left"),
        ('name = "right"', 'name = "Right arm"', "small letters"),
        ('source = "twin:seed=1"', 'source = "twin:seed=1"\nboard = "0102"', "the same board 0102"),
        ('link = "fore"', 'link = "four"', 'no link "four".*did you mean "fore"'),
        ('urdf = "arm.urdf"', "", 'expected a URDF that has the link "fore", got none'),
        ('link = "fore"', "", "needs the key link"),
        ('"arm.urdf"', '"leg.urdf"', "no such file|cannot be read"),
        ('board = "0102"', 'board = "x1"', "hexadecimal"),
        ('board = "0102"', 'bord = "0102"', 'did you mean "board"'),
        ('urdf = "arm.urdf"', 'joints = "ros2"', "needs the key urdf"),
        ('["10 mm", "0 mm", "30 mm"]', "[1, 2, 3]", "without a unit"),
        ('"bend.npz"', "3", '1 "left" calibration: entry 1: expected text'),
    ],
)
def test_what_cannot_be_meant_is_said(files, old, new, said):
    assert old in ROBOT
    (files / "robot.toml").write_text(ROBOT.replace(old, new))
    with pytest.raises(SkinError, match=said):
        Robot.load(files / "robot.toml")


@pytest.mark.parametrize("link", ["fore arm", "Unterarm-außen", "/fore"])
def test_a_link_that_can_be_no_frame_is_refused(files, link):
    (files / "arm.urdf").write_text(URDF.replace('"fore"', f'"{link}"'), encoding="utf-8")
    (files / "robot.toml").write_text(ROBOT.replace('"fore"', f'"{link}"'), encoding="utf-8")
    with pytest.raises(SkinError, match="frame_id of all messages") as error:
        Robot.load(files / "robot.toml")
    assert link in str(error.value)
    assert "arm.urdf" in str(error.value)


def test_one_port_by_two_paths_is_one_port(files):
    port, by_id = files / "ttyACM0", files / "by-id-usb-board"
    port.write_bytes(b"")
    by_id.symlink_to(port)
    text = ROBOT.replace("twin:seed=1", f"serial:{port}")
    for other in (f"serial:{by_id},baud=115200", f"serial:{port}"):
        (files / "robot.toml").write_text(text.replace("replay:run.mcap@2", other))
        with pytest.raises(SkinError, match=r"one for left .*ttyACM0.* and right") as error:
            Robot.load(files / "robot.toml")
        assert (f"both are {port}" in str(error.value)) == (str(by_id) in other)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<robot", "<robots", "expected <robot>|not valid XML"),
        ('<link name="fore"/>', "", 'no link "fore"'),
        ('<link name="fore"/>', '<link name="fore"/><link name="fore"/>', "twice"),
        ('<link name="fore"/>', '<link name="fore"/><link name="table"/>', "got 2: base, table"),
        ('parent link="base"', 'parent link="fore"', "got 2|ring|got 0"),
        (
            'xyz="0.3 0 0"',
            'xyz="${length} 0 0"',
            "needs the package xacro|expanded by xacro: .*length",
        ),
        ('xyz="0.3 0 0"', 'xyz="0.3 0"', "three numbers"),
        ('xyz="0.3 0 0"', 'xyz="nan 0 0"', "three numbers"),
        ("</robot>", "", "not valid XML"),
    ],
)
def test_a_bad_urdf_is_refused(files, old, new, said):
    assert old in URDF
    (files / "arm.urdf").write_text(URDF.replace(old, new))
    with pytest.raises(SkinError, match=said):
        Urdf.read(files / "arm.urdf")


XACRO = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="length" default="0.3"/>
<xacro:property name="half" value="${$(arg length) / 2}"/>
<xacro:macro name="arm" params="name parent *origin"><link name="${name}"/>
  <joint name="to_${name}" type="fixed"><parent link="${parent}"/><child link="${name}"/>
  <xacro:insert_block name="origin"/></joint></xacro:macro>
<link name="base"/>
<xacro:arm name="fore" parent="base"><origin xyz="${half} 0 0" rpy="0 0 ${pi / 2}"/></xacro:arm>
</robot>"""


@pytest.fixture
def xacro():
    return pytest.importorskip("xacro", reason="a xacro: python -m pip install '.[xacro]'")


def test_a_xacro_is_expanded(files, xacro):
    assert xacro
    (files / "arm.urdf.xacro").write_text(XACRO)
    urdf = Urdf.read(files / "arm.urdf.xacro")
    assert urdf.links == ("base", "fore")
    assert urdf.joints["fore"].name == "to_fore"
    assert urdf.pose("fore").position == pytest.approx([0.15, 0, 0])
    turned = Rotation.from_euler("z", np.pi / 2).as_matrix()
    assert urdf.pose("fore").rotation == pytest.approx(turned, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("${half}", "${third}", r"arm\.urdf\.xacro: cannot be expanded by xacro: .*third"),
        ("${half}", "1 ${half}", "three numbers"),
        ('xacro:arm name="fore" parent="base"', 'xacro:leg name="fore"', "cannot be expanded"),
        ('parent="base"', 'parent="bass"', 'there is no link "bass"'),
    ],
)
def test_a_xacro_that_cannot_be_meant(files, xacro, old, new, said):
    assert xacro
    text = XACRO.replace(old, new)
    text = text.replace("</xacro:arm>", "</xacro:leg>") if "leg" in new else text
    (files / "arm.urdf.xacro").write_text(text)
    with pytest.raises(SkinError, match=said):
        Urdf.read(files / "arm.urdf.xacro")


def test_without_the_package_a_xacro_says_what_to_install(files, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacro", None)
    (files / "arm.urdf.xacro").write_text(XACRO)
    with pytest.raises(SkinError, match=r"arm\.urdf\.xacro: needs the package xacro.*xacro"):
        Urdf.read(files / "arm.urdf.xacro")


MOVING = """<robot name="hand"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="a"/>
  <origin xyz="0.1 0 0" rpy="0.3 0 0.2"/><axis xyz="0 3 4"/></joint>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/>
  <origin xyz="0 0 0.2" rpy="0 1 0"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/>
  <axis xyz="0 0 1"/><mimic joint="turn" multiplier="-2" offset="0.5"/></joint></robot>"""


def homogeneous(rotation, position):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = rotation.as_matrix(), position
    return whole


def test_joints_move_links_about_and_along_their_axes(files):
    (files / "hand.urdf").write_text(MOVING)
    urdf, none = Urdf.read(files / "hand.urdf"), Rotation.identity()
    positions = {"turn": 0.7, "slide": 0.05}
    pose = urdf.pose("c", positions.__getitem__)
    expected = (
        homogeneous(Rotation.from_euler("xyz", (0.3, 0, 0.2)), (0.1, 0, 0))
        @ homogeneous(Rotation.from_rotvec(0.7 * np.array([0, 0.6, 0.8])), (0, 0, 0))
        @ homogeneous(Rotation.from_euler("xyz", (0, 1, 0)), (0, 0, 0.2))
        @ homogeneous(none, (0.05, 0, 0))
        @ homogeneous(Rotation.from_rotvec((0, 0, 0.5 - 2 * 0.7)), (0, 0, 0))
    )
    assert pose.rotation == pytest.approx(expected[:3, :3])
    assert pose.position == pytest.approx(expected[:3, 3])
    every = urdf.poses(positions.__getitem__)
    assert [*every] == ["base", "a", "b", "c"]
    assert every["c"].position == pytest.approx(pose.position)
    assert urdf.poses()["c"].position == pytest.approx(urdf.pose("c").position)


def test_a_joint_that_no_number_tells_has_no_pose(files):
    (files / "hand.urdf").write_text(MOVING.replace("continuous", "floating"))
    urdf = Urdf.read(files / "hand.urdf")
    with pytest.raises(SkinError, match='a joint state has no position of the floating "turn"'):
        urdf.pose("a", {}.__getitem__)
    assert urdf.pose("a").position.tolist() == [0.1, 0, 0]  # at rest


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("continuous", "revolut", 'joint "turn": expected a type among revolute, .*got "revolut"'),
        ('xyz="0 3 4"', 'xyz="0 0 0"', 'joint "turn": expected an axis with a direction'),
        ('xyz="0 3 4"', 'xyz="0 3"', "three numbers in <axis> xyz"),
        ('mimic joint="turn"', 'mimic joint="trun"', 'expected a joint to mimic, got "trun"'),
        ('multiplier="-2"', 'multiplier="x"', "a number in <mimic> multiplier"),
    ],
)
def test_a_joint_that_cannot_be_meant(files, old, new, said):
    assert old in MOVING
    (files / "hand.urdf").write_text(MOVING.replace(old, new))
    with pytest.raises(SkinError, match=said):
        Urdf.read(files / "hand.urdf")


XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
PARTS = f"""<robot {XMLNS}><xacro:include filename="$(find hand)/urdf/pad.xacro"/></robot>"""
PAD = f"""<robot {XMLNS}><xacro:macro name="pad" params="name"><link name="${{name}}"><visual>
<geometry><mesh filename="file://$(find arm)/meshes/pad.obj"/></geometry></visual></link>
</xacro:macro></robot>"""
FINDS = f"""<robot name="arm" {XMLNS}><xacro:include filename="$(find arm)/urdf/parts.xacro"/>
<link name="base"/><xacro:pad name="pad"/>
<joint name="j" type="fixed"><parent link="base"/><child link="pad"/></joint></robot>"""


@pytest.mark.parametrize("folder", ["arm", "arm-main"])
def test_a_xacro_finds_packages_in_the_folders_above(tmp_path, xacro, folder):
    """Its own by its folder's name, or by that in its package.xml; another beside it."""
    assert xacro
    own, other = tmp_path / folder, tmp_path / "hand"
    for made in (own / "urdf" / "deep", own / "meshes", other / "urdf"):
        made.mkdir(parents=True)
    if folder != "arm":
        (own / "package.xml").write_text("<package><name> arm </name></package>")
    (own / "urdf" / "deep" / "arm.urdf.xacro").write_text(FINDS)
    (own / "urdf" / "parts.xacro").write_text(PARTS)
    (other / "urdf" / "pad.xacro").write_text(PAD)
    (own / "meshes" / "pad.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    urdf = Urdf.read(own / "urdf" / "deep" / "arm.urdf.xacro")
    assert set(urdf.links) == {"base", "pad"}
    (solid,) = urdf.solids()
    assert (len(solid.triangles), solid.problems) == (1, ())
    (own / "urdf" / "parts.xacro").write_text(PARTS.replace("find hand", "find foot"))
    with pytest.raises(SkinError, match=r'expected the package "foot" in a folder above, or ROS'):
        Urdf.read(own / "urdf" / "deep" / "arm.urdf.xacro")


@pytest.mark.parametrize("kind", ["fixed", "floating"])
def test_what_a_type_does_not_use_is_not_read(files, kind):
    """As SolidWorks writes fixed joints; a limit or a law may be there too."""
    unused = '<axis xyz="0 0 0"/><limit lower="x"/><mimic joint="nothing" multiplier="none"/>'
    text = MOVING.replace('type="revolute"', f'type="{kind}"').replace(
        '<axis xyz="0 0 1"/><mimic joint="turn" multiplier="-2" offset="0.5"/>', unused
    )
    assert unused in text
    (files / "hand.urdf").write_text(text)
    urdf = Urdf.read(files / "hand.urdf")
    assert urdf.pose("c").position == pytest.approx(urdf.pose("b").position)


CHAIN = """<robot name="m"><link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/>
<joint name="c" type="revolute"><parent link="l2"/><child link="l3"/><axis xyz="0 0 1"/>
  <mimic joint="b" multiplier="-1" offset="0.05"/></joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
  <mimic joint="a" multiplier="2" offset="0.1"/></joint>
<joint name="a" type="continuous"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/></joint>
</robot>"""


def told(**positions):
    def of(joint):
        if joint not in positions:
            raise SkinError(f"pose unknown: {joint} has not come")
        return positions[joint]

    return of


def angle(pose):
    return np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])


def test_joints_that_mimic_joints_that_mimic_follow_the_law(files):
    (files / "chain.urdf").write_text(CHAIN)
    urdf = Urdf.read(files / "chain.urdf")
    for states in ({"a": 0.3}, {"a": 0.3, "b": 0.7, "c": -0.65}, {"a": 0.3, "c": -0.62}):
        assert angle(urdf.pose("l3", told(**states))) == pytest.approx(0.35)
    with pytest.raises(SkinError, match="a has not come"):
        urdf.pose("l3", told(b=0.7))
    both = told(a=0.3, b=0.4)
    assert angle(urdf.pose("l1", both)) == pytest.approx(0.3)
    for link in ("l2", "l3"):
        with pytest.raises(SkinError, match=r'"b" is reported at 0\.400.*"a", .* at 0\.700'):
            urdf.pose(link, both)


def test_a_joint_is_placed_by_its_own_state_where_what_it_mimics_is_not_told(files):
    text = CHAIN.replace('<parent link="l1"/>', '<parent link="l0"/>')
    (files / "chain.urdf").write_text(text)
    urdf = Urdf.read(files / "chain.urdf")
    assert angle(urdf.pose("l3", told(b=0.7))) == pytest.approx(0.7 - 0.65)
    with pytest.raises(SkinError, match="a has not come"):
        urdf.pose("l2", told(c=0.7))


def test_a_ring_of_mimicking_joints_is_refused(files):
    text = CHAIN.replace("</joint>\n</robot>", '<mimic joint="c"/></joint>\n</robot>')
    assert text != CHAIN
    (files / "chain.urdf").write_text(text)
    with pytest.raises(SkinError, match="a ring of <mimic>"):
        Urdf.read(files / "chain.urdf")


def test_the_page_draws_a_chain_whose_states_contradict_it(files):
    from tomoskin.extras.robot.overview import Stance

    (files / "chain.urdf").write_text(CHAIN)
    (files / "chain.toml").write_text(
        'format = 1\n[robot]\nurdf = "chain.urdf"\n[[skin]]\nname = "palm"\n'
        'skin = "textile-disc-8"\nlink = "l3"\n'
    )
    robot = Robot.load(files / "chain.toml").moved_by(lambda _: told(a=0.3, c=0.4))
    assert angle(Stance(robot).poses(0.0)["l3"]) == pytest.approx(0.35)
    floating = CHAIN.replace("continuous", "floating")
    (files / "chain.urdf").write_text(floating)
    robot = Robot.load(files / "chain.toml").moved_by(lambda _: told())
    assert angle(Stance(robot).poses(0.0)["l3"]) == pytest.approx(0.0)


def test_a_mesh_lies_on_its_link(files):
    urdf = Urdf.read(files / "arm.urdf")
    assert [*urdf.meshes] == ["upper"]
    assert urdf.meshes["upper"].position.tolist() == [0, 0, 0.1]


def test_a_skin_is_added_to_a_file_or_a_new_one(files):
    path = files / "new.toml"
    given = {"name": "hand", "skin": "textile-disc-8", "link": "fore"}
    path.write_text(add_skin(path, given, "arm.urdf"))
    path.write_text(add_skin(path, given | {"name": "palm", "link": "upper"}, "arm.urdf"))
    robot = Robot.load(path)
    assert [(skin.name, skin.place.link) for skin in robot.skins] == [
        ("hand", "fore"),
        ("palm", "upper"),
    ]
    with pytest.raises(SkinError, match=r"to the URDF arm\.urdf"):
        add_skin(path, given, "leg.urdf")
    with pytest.raises(SkinError, match="unknown key"):
        add_skin(path, given | {"lnk": "fore"})


def test_twins_of_which_no_more_is_said_are_two() -> None:
    skins = [{"name": name, "skin": "textile-disc-8"} for name in ("palm", "back")]
    robot = Robot.of({"skin": skins}, "robot.toml", Path())
    assert [skin.source for skin in robot.skins] == ["twin:seed=1", "twin:seed=2"]
