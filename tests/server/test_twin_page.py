"""The twin's drawer and the read-out of bends, in Chromium on the twin of a skin that bends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from run.test_runner import Watch
from server.bent import frames_bent
from server.looks import look_in_both
from server.serving import Site
from server.watching import axe_finds, distance
from tomoskin.board.source import open_source
from tomoskin.learning import BODY, CLASSES, BodyExamples, BodyModel, Classifier
from tomoskin.model.mesh import Hinge
from tomoskin.pipeline import voltage_covariance
from tomoskin.run import Runner
from tomoskin.run.commands import BendRequest, SetPose
from tomoskin.server.handlers import TwinHandlers
from tomoskin.twin import Bent, Face

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

WIDTH = 0.08
ANGLES = np.radians([0, 15, 30, 45, 60, 45, 30, 15] * 4 + [0])
TRUE, ROUGH = math.radians(40), math.radians(8)


def learnt(prepared):
    """The skin with its bends, and with the states straight and bent."""
    dv, pattern = frames_bent(prepared, ANGLES, WIDTH, seed=4), prepared.pattern
    axes, time = np.full(len(ANGLES), math.pi / 2), 0.1 * np.arange(len(ANGLES))
    examples = BodyExamples.checked(dv, time, angle=ANGLES, axis=axes)
    bends = BodyModel.learn(examples, voltage_covariance(prepared, None))
    labels = ["bent" if angle else "straight" for angle in ANGLES]
    states = Classifier.fit(dv, labels, pattern=pattern, skin_id=prepared.skin.identity)
    classes = CLASSES.of(states, pattern, prepared.skin)
    return prepared.calibrated(BODY.of(bends, pattern)).calibrated(classes)


@pytest.fixture(scope="module")
def site(prepared):
    runner = Runner(
        learnt(prepared), lambda: open_source("twin:preset=ideal,seed=1", prepared.skin)
    )
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def bend(opened, degrees):
    opened.test_id("bend-width").fill(str(round(1e3 * WIDTH)))
    opened.test_id("bend-angle").fill(str(degrees))


def test_the_twin_is_bent_by_keys_and_its_bend_is_read_beside_a_touch(opened):
    opened.until("last.bend?.state === 'idle'")
    opened.page.keyboard.press("w")
    bend(opened, 39)
    opened.test_id("bend-angle").press("ArrowRight")
    asked = (Bent(Hinge(TRUE, WIDTH)),)
    Watch(opened.site.runner).until(lambda: opened.site.runner.flow.twin.pose.pose == asked)
    opened.until(
        "last.bend?.state === 'bend' && "
        f"Math.abs(window.tomoskin.last.bend.angle - {TRUE}) < {ROUGH}"
    )
    opened.page.locator("[data-testid=bend][title*='about an axis 90° from x']").wait_for()
    opened.press(0.04, 0.02)
    opened.until("last.bend?.state === 'bend and touch'")
    touch = opened.read()["touches"][0]
    assert distance([touch["x"], touch["y"]], (0.04, 0.02)) < 0.015
    opened.page.mouse.up()
    opened.lifted()
    opened.test_id("lay-flat").click()
    opened.until("last.bend?.state === 'idle'")
    assert opened.site.runner.flow.twin.pose.pose == ()
    assert opened.site.runner.status().bend.state == "idle"
    stretched(opened)


def place(element):
    """Where its upper left corner is, and how high it is."""
    box = element.bounding_box()
    return box["x"], box["y"], box["height"]


def test_the_class_is_said_on_one_line_that_does_not_move(opened):
    said, runner = opened.test_id("sheet-class"), opened.site.runner
    said.filter(has_text="straight").wait_for()
    straight = place(said)
    runner.ask(SetPose(BendRequest(TRUE, length=WIDTH)))
    said.filter(has_text="bent").wait_for()
    assert place(said) == straight
    assert said.get_attribute("title").startswith("Class")
    runner.ask(SetPose())
    said.filter(has_text="straight").wait_for()


def stretched(opened):
    """And so is a stretch; last, since the reference learns from a sheet that stays stretched."""
    before = opened.page.evaluate("[...window.tomoskin.last.voltages]")
    off = f"({before}).reduce((most, v, k) => Math.max(most, Math.abs(now[k] / v - 1)), 0)"
    moved = f"() => {{ const now = window.tomoskin.last.voltages; return {off} %s 0.1; }}"
    opened.test_id("stretch-along").fill("8")
    opened.page.wait_for_function(moved % ">")
    opened.test_id("lay-flat").click()
    opened.page.wait_for_function(moved % "<")


def test_presses_of_any_face_stand_in_a_list(opened):
    page = opened.page
    page.keyboard.press("w")
    opened.test_id("face-triangle").click()
    opened.test_id("probe-angle").fill("30")
    page.keyboard.press("5")
    opened.test_id("sheet").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Shift+ArrowRight")
    opened.until("last.truths.length === 1")
    (press,) = opened.site.runner.newest.truth
    assert isinstance(press.shape, Face)
    assert press.angle == pytest.approx(math.radians(30))
    row = opened.test_id("held")
    row.filter(has_text="Triangle, 0, 0 mm").filter(has_text="3.0 N").wait_for()
    page.get_by_label("More force on press 1").press("Enter")
    row.filter(has_text="3.5 N").wait_for()
    opened.until("last.truths[0].force === 3.5")
    page.get_by_label("Lift press 1").press("Enter")
    opened.lifted()
    assert row.count() == 0


def test_axe_finds_nothing_in_the_drawer_and_it_looks_right(opened):
    opened.page.keyboard.press("w")
    opened.test_id("face-bar").click()
    opened.test_id("sheet").focus()
    opened.page.keyboard.press("Enter")
    opened.test_id("held").wait_for()
    assert axe_finds(opened.page, "#drawer", "[data-testid=bend]") == []
    assert look_in_both(opened.page, "held") == {}
    opened.page.keyboard.press("Escape")
    opened.until("last.truths.length === 0")
