"""Touches by the robot's own links: marked or left out in what leaves the program."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from files.session.runs import SKIN, TOUCH
from run.sinks.conftest import EPOCH, result_at
from tomoskin.core import SkinError
from tomoskin.extras.lerobot import FIELDS, Slots
from tomoskin.extras.lsl.lsl_sink import touch_sample
from tomoskin.extras.robot import Member, PlacedSkin, Robot, RobotRun
from tomoskin.files.exports import Export, export_touches
from tomoskin.files.messages import (
    Contacts,
    Naming,
    Stream,
    happenings,
    own_touches,
)
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.pipeline import prepare
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
def arm(tmp_path):
    """Robot: the hand stands at ``across``, 2 mm above the sheet."""

    def make(across=0.03, up=0.0, choice="mark"):
        (tmp_path / "arm.urdf").write_text(URDF)
        (tmp_path / "robot.toml").write_text(ROBOT.replace("CHOICE", choice))
        states = {"across": across, "up": up}.__getitem__
        return Robot.load(tmp_path / "robot.toml").moved_by(lambda _: states)

    return make


@pytest.fixture
def contacts(arm):
    """Contacts of a frame."""

    def make(*touches, happened=(), **stands):
        stream = Stream.of(PREPARED, "twin", EPOCH, arm(**stands).skins[0].place)
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
        assert [happening["id"] for happening in happenings(frame)] == kept
        assert len(frame.events) == len(kept)
    assert happening_marks(contacts(own, happened=happened[:1])) == [True]


def happening_marks(contacts):
    return [happening["self"] for happening in happenings(contacts)]


def test_samples_of_lsl_and_slots_of_policies_have_the_mark(contacts):
    frame = contacts(touch_at(0.03), touch_at(-0.03, 2), touch_at(0.03, 3))
    unplaced = replace(frame, stream=replace(frame.stream, place=None))
    for of, marked in ((frame, [1, 0, 1]), (unplaced, [np.nan] * 3)):
        sample = touch_sample(of)
        order = np.argsort(sample[:12:4])  # the strongest touches are first there
        assert sample[-6:-1][:3][order] == pytest.approx(marked, nan_ok=True)
        assert np.isnan(sample[-3:-1]).all()
        table = Slots().after(of).table
        known = np.isfinite(marked)
        assert table[:3, FIELDS.index("self_valid")].tolist() == known.tolist()
        assert table[:3, FIELDS.index("self")].tolist() == np.where(known, marked, 0).tolist()


@pytest.mark.parametrize("choice", ["mark", "leave-out"])
def test_tables_and_the_page_of_the_skin_have_the_mark(arm, tmp_path, choice):
    touches = touch_at(0.03), touch_at(-0.03, 2)
    with SessionWriter(tmp_path / "x-pad.mcap", SKIN, epoch=EPOCH) as writer:
        writer.touches(1.0, 7, touches)
    robot, table = arm(choice=choice), tmp_path / "x.csv"
    with SessionReader(tmp_path / "x-pad.mcap") as session:
        export_touches(Export(session, robot=robot), table)
        stream = Export(session, robot=robot).stream
        assert own_touches(stream, result_at(1.0, *touches)) == {1}
        export_touches(Export(session), tmp_path / "alone.csv")
    rows = [line.split(",") for line in table.read_text().splitlines()]
    marked = [(row[2], row[-1]) for row in rows]
    assert marked == [("id", "self"), ("1", "true"), ("2", "false")][:: 1 + (choice != "mark")]
    assert "self" not in (tmp_path / "alone.csv").read_text()


def test_all_who_listen_share_one_look_at_the_links(contacts):
    asked = []
    frame = contacts(touch_at(0.03), touch_at(-0.03, 2))
    states = frame.stream.place.joints(0.0)

    def joints(utc):
        return lambda joint: asked.append((utc, joint)) or states(joint)

    stream = replace(frame.stream, place=replace(frame.stream.place, joints=joints))
    result = result_at(1.0, *frame.tracked)
    for name in ("one", "two", "three"):
        assert marks(Contacts.of(stream.named(Naming(name)), result)) == [True, False]
    once = len(asked)
    assert once > 0
    assert own_touches(stream, result) == {1}
    assert len(asked) == once == len(set(asked))
    marks(Contacts.of(stream, result_at(2.0, *frame.tracked)))
    assert len(asked) == 2 * once


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
    return [PlacedSkin(replace(place, joints=None), SKIN.name), PlacedSkin(place, SKIN.name)]
