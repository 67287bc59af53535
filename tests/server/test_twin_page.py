"""The twin's drawer, in Chromium."""

from __future__ import annotations

import math

import pytest

from run.test_runner import Watch
from server.looks import look_in_both
from server.serving import Site
from server.watching import axe_finds
from tomoskin.board.source import open_source
from tomoskin.model.mesh import Hinge
from tomoskin.run import Runner
from tomoskin.server.handlers import TwinHandlers
from tomoskin.twin import Bent, Face

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

WIDTH, TRUE = 0.08, math.radians(40)


@pytest.fixture(scope="module")
def site(prepared):
    runner = Runner(prepared, lambda: open_source("twin:preset=ideal,seed=1", prepared.skin))
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def bend(opened, degrees):
    opened.test_id("bend-width").fill(str(round(1e3 * WIDTH)))
    opened.test_id("bend-angle").fill(str(degrees))


def test_the_twin_is_bent_by_keys(opened):
    opened.page.keyboard.press("w")
    flat = opened.page.evaluate("[...window.tomoskin.last.voltages]")
    bend(opened, 39)
    opened.test_id("bend-angle").press("ArrowRight")
    asked = (Bent(Hinge(TRUE, WIDTH)),)
    Watch(opened.site.runner).until(lambda: opened.site.runner.flow.twin.pose.pose == asked)
    opened.test_id("lay-flat").click()
    Watch(opened.site.runner).until(lambda: opened.site.runner.flow.twin.pose.pose == ())
    stretched(opened, flat)


def stretched(opened, flat):
    """And so is a stretch; last, since the reference learns from a sheet that stays stretched."""
    off = f"({flat}).reduce((most, v, k) => Math.max(most, Math.abs(now[k] / v - 1)), 0)"
    moved = f"() => {{ const now = window.tomoskin.last.voltages; return {off} %s 0.1; }}"
    opened.page.wait_for_function(moved % "<")
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
    assert axe_finds(opened.page, "#drawer") == []
    assert look_in_both(opened.page, "held") == {}
    opened.page.keyboard.press("Escape")
    opened.until("last.truths.length === 0")
