"""The read-out of bends, in Chromium on the twin of a skin that bends."""

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
from tomoskin.extras.body import BODY, BodyExamples, BodyModel
from tomoskin.model.mesh import Hinge
from tomoskin.pipeline import voltage_covariance
from tomoskin.run import Runner
from tomoskin.server.handlers import TwinHandlers
from tomoskin.twin import Bent

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

WIDTH = 0.08
ANGLES = np.radians([0, 15, 30, 45, 60, 45, 30, 15] * 4 + [0])
TRUE = math.radians(40)


def learnt(prepared):
    """The skin with its bends."""
    dv, pattern = frames_bent(prepared, ANGLES, WIDTH, seed=4), prepared.pattern
    axes, time = np.full(len(ANGLES), math.pi / 2), 0.1 * np.arange(len(ANGLES))
    examples = BodyExamples.checked(dv, time, angle=ANGLES, axis=axes)
    bends = BodyModel.learn(examples, voltage_covariance(prepared, None))
    return prepared.calibrated(BODY.of(bends, pattern))


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


def until_read(opened, words):
    opened.test_id("bend-words").filter(has_text=words).wait_for()


def test_the_bend_of_a_twin_is_read_beside_a_touch(opened):
    until_read(opened, "not bent")
    opened.page.keyboard.press("w")
    opened.test_id("bend-width").fill(str(round(1e3 * WIDTH)))
    opened.test_id("bend-angle").fill("39")
    opened.test_id("bend-angle").press("ArrowRight")
    asked = (Bent(Hinge(TRUE, WIDTH)),)
    Watch(opened.site.runner).until(lambda: opened.site.runner.flow.twin.pose.pose == asked)
    near = "Math.abs(parseFloat(window.tomoskin.last.readings.bend.value) - 40) < 8"
    opened.until(f"last.readings?.bend && {near}")
    opened.page.locator("[data-testid=bend][title*='about an axis 90° from x']").wait_for()
    assert axe_finds(opened.page, "[data-testid=bend]") == []
    assert look_in_both(opened.page, "bend") == {}
    opened.press(0.04, 0.02)
    until_read(opened, "bent and touched")
    touch = opened.read()["touches"][0]
    assert distance([touch["x"], touch["y"]], (0.04, 0.02)) < 0.015
    opened.page.mouse.up()
    opened.lifted()
    opened.test_id("lay-flat").click()
    until_read(opened, "not bent")
    assert opened.site.runner.status().readings["body"].state == "idle"
