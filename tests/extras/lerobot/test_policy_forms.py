"""The forms in which policies take touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from extras.robot.test_joint_states import ROBOT, URDF
from tomoskin.core import Amount
from tomoskin.extras.lerobot import FIELDS, POSE, SLOTS, PolicyForms, Slots
from tomoskin.extras.robot import Robot
from tomoskin.files.messages import Contacts, Stream
from tomoskin.files.session import Session
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

SCRIPT = """format = 1
[script]
duration = "2 s"
[[press]]
id = "finger"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "500 ms"
force = "3 N"
hold = "600 ms"
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    path = tmp_path_factory.mktemp("forms") / "press.mcap"
    simulate(Script.from_toml(SCRIPT), Skin.load("textile-disc-8"), path, advance=lambda *_: None)
    return Session(path)


@pytest.fixture(scope="module")
def results(session):
    return [result for result in session if result.ready]


@pytest.fixture(scope="module")
def touched(results):
    return next(r for r in reversed(results) if r.touches)


def forced(result, newtons, depth=None):
    """The result with a force of its touch, and perhaps a depth."""
    (touch,) = result.touches
    force = Amount(newtons, 0.9 * newtons, 1.1 * newtons)
    detection = replace(touch.detection, force=force, depth=depth)
    return replace(result, touches=(replace(touch, detection=detection),))


def contacts_of(session, result):
    return Contacts.of(Stream.of(session.prepared, "", 0.0), result)


def column(table, name):
    return table[:, FIELDS.index(name)]


def test_points_are_touches_with_motion_and_force(session, results, touched):
    forms = PolicyForms(session.prepared)
    began = next(r for r in results if r.touches)
    forms.push(forced(began, 2.0))
    forms.push(forced(touched, 3.0))
    view = forms.at()
    found, onset = touched.touches[0].detection, began.touches[0].detection
    assert view.points.shape == (SLOTS, 9)
    assert view.points[0] == pytest.approx(
        [found.x, found.y, 0, found.x - onset.x, found.y - onset.y, 0, 0, 0, -3]
    )
    assert view.point_mask.tolist() == [[True, True]] + [[False, False]] * (SLOTS - 1)
    assert not view.points[1:].any()


def test_on_a_robot_the_pose_of_the_link_is_known_or_zeros(session, touched, tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "robot.toml").write_text(ROBOT.replace("JOINTS", "ros2"))
    place = Robot.load(tmp_path / "robot.toml").skins[0].place

    def pose_by(joints):
        forms = PolicyForms(session.prepared)
        stream = Stream.of(session.prepared, "", 1000.0, replace(place, joints=joints))
        forms.push(Contacts.of(stream, touched))
        return forms.at().pose

    half = np.sqrt(0.5)
    turned = pose_by(lambda _: {"shoulder": np.pi / 2, "elbow": 0.1}.get)
    assert turned == pytest.approx([1, 0, 0.4, 0.2, 0, 0, half, half])
    assert pose_by(None).tolist() == [0.0] * len(POSE)


def test_a_force_and_a_depth_that_are_not_calibrated_say_so(session, touched):
    forms = PolicyForms(session.prepared)
    forms.push(forced(touched, 3.0, Amount(5e-4, 4e-4, 7e-4)))
    known = [column(forms.at().slots, name)[0] for name in ("depth_valid", "depth", "force_valid")]
    assert known == [1, 5e-4, 1]
    forms.push(touched)
    assert forms.at().point_mask[0].tolist() == [True, False]
    assert column(forms.at().slots, "depth_valid")[0] == 0
    view = forms.at()
    assert (view.points[0, 8], view.map_valid) == (0, False)
    assert np.isfinite(view.map).all()


def test_messages_carry_a_depth_or_say_that_it_is_uncalibrated(session, touched):
    names = ("depth", "depth_interval", "depth_calibrated")
    deep = forced(touched, 3.0, Amount(5e-4, 4e-4, np.inf))
    (touch,) = contacts_of(session, deep).content()["touches"]
    assert [touch[name] for name in names] == [5e-4, (4e-4, np.inf), True]
    (touch,) = contacts_of(session, touched).content()["touches"]
    assert [touch[name] for name in names] == [None, None, False]


@pytest.mark.parametrize("size", [32, 64])
def test_the_map_of_pressure_holds_all_of_the_force(session, touched, size):
    forms = PolicyForms(session.prepared, size=size)
    forms.push(forced(touched, 3.0))
    view = forms.at()
    extent = np.ptp(session.mesh.points, axis=0).max()
    pixel = (100 * extent / size) ** 2
    assert view.map_valid
    assert view.map.shape == view.map_mask.shape == (size, size)
    assert view.map.sum() * pixel == pytest.approx(3.0)
    assert not view.map[~view.map_mask].any()
    assert view.map_mask.mean() == pytest.approx(np.pi / 4, abs=0.03)  # a disc in its square
    row, col = np.argwhere(view.map > 0).mean(axis=0)
    step, (x, y) = extent / size, session.mesh.points.mean(axis=0)
    found = touched.touches[0].detection
    assert x + (col - (size - 1) / 2) * step == pytest.approx(found.x, abs=step)
    assert y - (row - (size - 1) / 2) * step == pytest.approx(found.y, abs=step)


def test_the_map_of_conductance_is_the_image(session, touched):
    forms = PolicyForms(session.prepared, newtons=False)
    forms.push(touched)
    view = forms.at()
    expected = touched.image.on_pixels(session.mesh.pixels(32))
    assert view.map_valid
    assert np.array_equal(view.map_mask, np.isfinite(expected))
    assert np.array_equal(view.map, np.nan_to_num(expected))


def test_the_vector_of_an_untouched_skin_is_white(session, results):
    forms = PolicyForms(session.prepared)
    begun = min(r.touches[0].since for r in results if r.touches)
    rows = []
    for result in results:
        if result.host_time < begun - 0.1:
            forms.push(result)
            rows.append(forms.at().vector)
    assert len(rows) > 5
    assert 0.5 < np.std(rows[1:]) < 2


def test_a_measurement_that_is_excluded_is_0(session, touched):
    lost = np.arange(40) < 2
    sick = replace(touched, health=replace(touched.health, lost=lost))
    change = contacts_of(session, sick).change
    assert (change == 0).tolist() == lost.tolist()


def test_a_window_ends_with_the_frame_of_a_slower_camera(session, results):
    forms = PolicyForms(session.prepared, count=4)
    assert forms.at() is None
    for result in results[:12]:
        forms.push(result)
    period = results[1].scanned - results[0].scanned
    late = results[9].scanned + 0.4 * period
    view = forms.at(late)
    expected = [r.voltages - r.reference for r in results[6:10]]
    assert np.allclose(view.window, expected, atol=1e-12)
    assert view.ages == pytest.approx((np.arange(3, -1, -1) + 0.4) * period)
    assert (view.valid, view.time) == (True, late)
    assert np.array_equal(forms.at().window[-1], results[11].voltages - results[11].reference)


def test_what_is_old_or_lost_is_not_valid(session, touched):
    forms = PolicyForms(session.prepared)
    forms.push(touched)
    assert forms.at(touched.scanned + 0.05).point_mask[0, 0]
    old = forms.at(touched.scanned + 0.5)
    assert (old.valid, old.map_valid, old.points.any(), old.map.any()) == (False,) * 4
    assert not forms.at(touched.scanned - 1).valid
    forms.push(contacts_of(session, touched).outdated("the board is gone"))
    assert not forms.at().valid


def test_slots_hold_through_a_blind_moment_and_a_merge(session, touched):
    (touch,) = touched.touches
    contacts = contacts_of(session, touched)

    def after(slots, *touches, valid=True):
        return slots.after(replace(contacts, tracked=touches, valid=valid))

    def numbered(number, **more):
        return replace(touch, id=number, **more)

    slots = after(Slots(), numbered(1), numbered(2))
    assert slots.ids[:2] == (1, 2)
    blind = after(slots, valid=False)
    assert (blind.ids, blind.table.any()) == (slots.ids, False)
    slots = after(blind, numbered(2), numbered(3))
    assert slots.ids[:3] == (3, 2, 0)  # 1 is released, and 3 has its place
    merged = after(slots, numbered(3, merged=(2, 3)))
    assert column(merged.table, "present")[:2].tolist() == [1, 0]
    assert after(merged, numbered(2), numbered(3)).ids == slots.ids
    full = after(slots, *map(numbered, range(2, 9)))
    assert full.ids == (3, 2, 4, 5, 6)
    assert after(full, *map(numbered, range(3, 9))).ids == (3, 7, 4, 5, 6)
