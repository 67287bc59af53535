"""Touches by the robot's own links: marked or left out in what leaves the program."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from files.session.runs import SKIN, TOUCH
from run.sinks.conftest import EPOCH, result_at
from tomoskin.core import SkinError
from tomoskin.files.messages import Contacts, Stream
from tomoskin.model.robot import Robot
from tomoskin.pipeline import prepare
from tomoskin.run import Member, RobotRun
from tomoskin.sensing.track import TouchEvent

URDF = """<robot name="arm"><link name="upper"/><link name="fore"/><link name="hand">
<collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision></link>
<joint name="across" type="prismatic"><parent link="upper"/><child link="fore"/>
  <origin xyz="0 -0.02 0.012"/></joint>
<joint name="up" type="prismatic"><parent link="fore"/><child link="hand"/>
  <axis xyz="0 0 1"/></joint></robot>"""
ROBOT = """format = 1
[robot]
urdf = "arm.urdf"
joints = "ros2"
self_contacts = "CHOICE"
[[skin]]
name = "pad"
skin = "textile-disc-8"
link = "upper"
"""
PREPARED = prepare(SKIN)


def touch_at(x, number=1, sd=1e-3):
    seen = replace(TOUCH.detection, x=x, y=-0.02, sd_x=sd, sd_y=1e-3, cov_xy=0.0)
    return replace(TOUCH, id=number, detection=seen)


@pytest.fixture
def contacts(tmp_path):
    """Contacts of a frame: the hand stands at ``across``, 2 mm above the sheet."""

    def make(*touches, across=0.03, up=0.0, choice="mark", happened=()):
        (tmp_path / "arm.urdf").write_text(URDF)
        (tmp_path / "robot.toml").write_text(ROBOT.replace("CHOICE", choice))
        states = {"across": across, "up": up}.__getitem__
        robot = Robot.load(tmp_path / "robot.toml").moved_by(lambda _: states)
        stream = Stream.of(PREPARED, "twin", EPOCH, robot.skins[0].place)
        return Contacts.of(stream, result_at(1.0, *touches, events=happened))

    return make


def marks(contacts):
    return [touch["self"] for touch in json.loads(json.dumps(contacts.content()))["touches"]]


def test_a_touch_where_a_link_is_near_is_the_robots_own(contacts):
    frame = contacts(touch_at(0.03), touch_at(-0.03, 2))
    assert marks(frame) == [True, False]
    assert [contact.is_self for contact in frame.touches] == [True, False]
    assert frame.content()["touches"][0]["self_problem"] is None
    assert marks(contacts(touch_at(0.03), up=0.004)) == [False]  # 6 mm above it
    assert marks(contacts(touch_at(0.05))) == [False]  # 10 mm beside it
    assert marks(contacts(touch_at(0.04, sd=8e-3))) == [True]
    assert marks(contacts(touch_at(0.03, sd=0.06))) == [False]  # it may be anywhere
    assert marks(contacts(touch_at(0.03, sd=np.nan))) == [True]  # as far as is known


def test_own_touches_can_be_left_out_with_what_happens_to_them(contacts):
    own, other = touch_at(0.03), touch_at(-0.03, 2)
    happened = tuple(TouchEvent("onset", touch, 1.0) for touch in (own, other))
    for choice, kept in (("mark", [1, 2]), ("leave-out", [2])):
        frame = contacts(own, other, choice=choice, happened=happened)
        assert [contact.touch.id for contact in frame.touches] == kept
        assert [touch.id for touch in frame.tracked] == kept
        assert [happening["id"] for happening in frame.happenings()] == kept
        assert len(frame.events) == len(kept)
    assert happening_marks(contacts(own, happened=happened[:1])) == [True]


def happening_marks(contacts):
    return [happening["self"] for happening in contacts.happenings()]


@pytest.mark.parametrize("choice", ["mark", "leave-out"])
def test_without_states_it_is_not_known(contacts, choice):
    frame = contacts(touch_at(0.03), choice=choice)

    def unknown(joint):
        raise SkinError(f'pose unknown: the nearest state of the joint "{joint}" is 0.7 s away')

    for joints, said in ((None, "no joint states are given"), (lambda _: unknown, "0.7 s away")):
        place = replace(frame.stream.place, joints=joints)
        stream = replace(frame.stream, place=place)
        (touch,) = Contacts.of(stream, result_at(1.0, touch_at(0.03))).content()["touches"]
        assert touch["self"] is None
        assert said in touch["self_problem"]


def test_a_skin_on_no_link_says_nothing_of_it(contacts):
    stream = replace(contacts().stream, place=None)
    (touch,) = Contacts.of(stream, result_at(1.0, touch_at(0.03))).content()["touches"]
    assert "self" not in touch


def test_a_run_without_states_says_so_once(contacts):
    place = contacts().stream.place
    twins = [Member.of(skin, SKIN, ()) for skin in _skins(place)]
    for member, said in zip(twins, (True, False), strict=True):
        with RobotRun([member]) as run:
            run.start()
            (runner,) = run.runners.values()
            told = [e.text for e in runner.events.since(0)[1] if e.kind == "self-contacts-unknown"]
        assert told == said * [
            "touches by the robot's own links are not marked: no joint states are given"
        ]


def _skins(place):
    from tomoskin.model.robot import PlacedSkin

    return [PlacedSkin(replace(place, joints=None), SKIN.name), PlacedSkin(place, SKIN.name)]
