"""Which of a robot's links are near a skin: against closed forms, and what cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest

from extras.robot.test_link_shapes import CORNERS, write_stl
from tomoskin.core import SkinError
from tomoskin.extras.robot import Robot

SHAPES = {
    "box": '<box size="0.2 0.1 0.06"/>',
    "sphere": '<sphere radius="0.05"/>',
    "cylinder": '<cylinder radius="0.04" length="0.2"/>',
    "capsule": '<capsule radius="0.04" length="0.2"/>',
}
MARGIN = 0.005
URDF = """<robot name="arm"><link name="base"/><link name="upper"/><link name="pad"/>
<link name="fore"/><link name="hand"><collision><geometry>SHAPE</geometry></collision></link>
<link name="cover"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/></joint>
<joint name="glue" type="fixed"><parent link="upper"/><child link="pad"/>
  <origin xyz="0 0 0.1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
  <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="wrist" type="prismatic"><parent link="fore"/><child link="hand"/>
  <origin rpy="0.3 0.2 0.1"/></joint>
<joint name="screws" type="fixed"><parent link="hand"/><child link="cover"/></joint></robot>"""
ROBOT = """format = 1
[robot]
urdf = "arm.urdf"
joints = "arm.mcap"
self_margin = "5 mm"
[[skin]]
name = "a"
skin = "textile-disc-8"
link = "pad"
"""
AT = {"shoulder": 1.0, "elbow": 0.5, "wrist": 0.1}


@pytest.fixture
def loaded(tmp_path):
    """A robot of these files, its joints as they are in AT."""

    def load(urdf=URDF, robot=ROBOT, joints=AT):
        (tmp_path / "arm.urdf").write_text(urdf)
        (tmp_path / "robot.toml").write_text(robot)
        return Robot.load(tmp_path / "robot.toml").moved_by(lambda _: joints.__getitem__)

    return load


def distance(kind, p):
    """m from points (n, 3) to a shape, 0 inside: closed forms."""
    x, y, z = np.abs(p).T
    if kind == "box":
        return np.linalg.norm(np.maximum(np.abs(p) - (0.1, 0.05, 0.03), 0), axis=1)
    if kind == "sphere":
        return np.maximum(np.linalg.norm(p, axis=1) - 0.05, 0)
    if kind == "cylinder":
        return np.hypot(np.maximum(np.hypot(x, y) - 0.04, 0), np.maximum(z - 0.1, 0))
    return np.maximum(np.linalg.norm([x, y, np.maximum(z - 0.1, 0)], axis=0) - 0.04, 0)


@pytest.mark.parametrize("kind", SHAPES)
def test_what_is_within_the_margin_is_near(loaded, kind):
    place = loaded(URDF.replace("SHAPE", SHAPES[kind])).skins[0].place
    near = place.near(0.0)
    urdf, positions = place.own.urdf, AT.__getitem__
    in_hand = np.random.default_rng(5).uniform(-0.16, 0.16, (3000, 3))
    points = urdf.pose("pad", positions).inside(urdf.pose("hand", positions)(in_hand))
    marked = near(points)
    far = distance(kind, in_hand)
    assert marked[far < MARGIN - 3e-4].all()  # a cylinder has 32 sides
    assert not marked[far > 1.8 * MARGIN].any()  # corners are sharp: planes go on beyond them
    assert (marked != (far < MARGIN)).mean() < 0.01
    assert marked.any()


def test_a_mesh_is_bounded_and_one_that_cannot_be_read_is_named(loaded, tmp_path):
    peak = np.concatenate([CORNERS, CORNERS + np.array([0.0, 0.0, 60.0])])
    write_stl(tmp_path / "hand.stl", peak)
    mesh = URDF.replace("SHAPE", '<mesh filename="hand.stl" scale="0.001 0.001 0.001"/>')
    place = loaded(mesh).skins[0].place
    inside = place.own.urdf.pose("hand", AT.__getitem__)(np.array([[0.03, 0.01, 0.03]]))
    assert place.near(0.0)(place.own.urdf.pose("pad", AT.__getitem__).inside(inside)).all()
    assert place.unmarked == ""
    place = loaded(mesh.replace("hand.stl", "none.stl")).skins[0].place
    assert place.unmarked.endswith("not marked: the shapes of hand cannot be read")


def test_own_body_and_what_one_joint_holds_are_never_near(loaded):
    robot = loaded(URDF.replace("SHAPE", SHAPES["box"]))
    assert robot.skins[0].place.own.others == ("hand", "cover")
    named = ROBOT + 'pressed_by = ["fore"]\n'
    assert loaded(URDF.replace("SHAPE", ""), named).skins[0].place.own.others == (
        "fore",
        "hand",
        "cover",
    )
    on_hand = ROBOT.replace('"pad"', '"cover"')
    assert loaded(robot=on_hand).skins[0].place.own.others == ("base", "upper", "pad")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('link = "pad"', 'link = "pad"\npressed_by = "four"', 'no link "four".*mean "fore"'),
        (
            'link = "pad"',
            'link = "pad"\npressed_by = ["fore", "upper"]',
            'expected links that move against "pad", got "upper"',
        ),
        ('link = "pad"', 'pressed_by = "fore"', "needs the key link"),
        ('"5 mm"', "5", "self_margin"),
        ('self_margin = "5 mm"', 'self_contacts = "hide"', '"mark" or "leave-out"'),
        ('joints = "arm.mcap"', "", "needs the key joints"),
    ],
)
def test_what_cannot_be_meant_is_said(loaded, old, new, said):
    assert old in ROBOT
    with pytest.raises(SkinError, match=said):
        loaded(robot=ROBOT.replace(old, new))


def test_a_joint_that_is_not_known_is_named(loaded):
    def unknown(joint):
        raise SkinError(f'pose unknown: the joint "{joint}" has not come')

    place = loaded(URDF.replace("SHAPE", SHAPES["box"])).moved_by(lambda _: unknown).skins[0].place
    with pytest.raises(SkinError, match='"shoulder" has not come'):
        place.near(0.0)
