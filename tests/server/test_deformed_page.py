"""A fold and a stretch that were never taught, as the page draws them, in Chromium."""

from __future__ import annotations

import math
import os

import pytest

from run.test_runner import Watch
from server.looks import look_in_both
from server.serving import Site
from tomoskin.board.source import open_source
from tomoskin.model.mesh import Hinge
from tomoskin.run import Runner
from tomoskin.server.handlers import TwinHandlers
from tomoskin.twin import Bent

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

AXIS, ANGLE, WIDTH = math.radians(60), math.radians(20), 0.06

INKED = """([x, y]) => {
    const canvas = document.querySelectorAll("[data-testid=sheet] canvas")[1];
    const box = canvas.getBoundingClientRect(), at = window.tomoskin.sheetToClient(x, y);
    const k = canvas.width / box.width;
    const [px, py] = [k * (at.x - box.left) - 4, k * (at.y - box.top) - 4];
    return canvas.getContext("2d").getImageData(px, py, 9, 9).data.some(part => part > 0);
}"""
"""Whether anything is drawn over the image at a place of the sheet, m."""


@pytest.fixture
def site(prepared):
    """Of each test its own: a sheet that was stretched keeps some of it for a while."""
    runner = Runner(prepared, lambda: open_source("twin:seed=1", prepared.skin))
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def picture(page, name):
    """Keep it where a person asks for it."""
    if folder := os.environ.get("PICTURES"):
        page.screenshot(path=f"{folder}/{name}.png")


def ask(opened, **sliders):
    for name, value in sliders.items():
        opened.test_id(name.replace("_", "-")).fill(str(value))


def places(axis, offset):
    """Places along a line of the sheet, and others well beside it."""
    along, right = (math.cos(axis), math.sin(axis)), (math.sin(axis), -math.cos(axis))
    for part in (-0.05, -0.02, 0.02, 0.05):
        for off in (0.0, 0.025, -0.025):
            x, y = (part * a + (offset + off) * r for a, r in zip(along, right, strict=True))
            yield (x, y), off == 0.0


def test_a_fold_is_a_line_with_its_angle_and_the_twins_own_beside_it(opened):
    page = opened.page
    page.keyboard.press("w")
    ask(opened, bend_axis=60, bend_width=60, bend_angle=19)
    opened.test_id("bend-angle").press("ArrowRight")
    asked = (Bent(Hinge(ANGLE, WIDTH, AXIS)),)
    Watch(opened.site.runner).until(lambda: opened.site.runner.flow.twin.pose.pose == asked)
    opened.until("last.deformation?.kind === 'fold'")
    axis = "window.tomoskin.last.deformation?.axis?.value"
    page.wait_for_function(f"() => Math.abs({axis} - {AXIS}) < 0.17")
    told = page.evaluate("window.tomoskin.last.deformation")
    assert abs(told["offset"]["value"]) < 0.015
    assert told["axis"]["low"] < told["axis"]["value"] < told["axis"]["high"]
    for place, on in places(told["axis"]["value"], told["offset"]["value"]):
        assert page.evaluate(INKED, list(place)) is on, place
    words = "the sheet is bent along a line"
    opened.test_id("warning").filter(has_text=words).wait_for()
    opened.test_id("do-truth").click()
    assert look_in_both(page, "fold") == {}
    picture(page, "fold")
    opened.test_id("lay-flat").click()
    opened.until("last.deformation === null")


def test_a_stretch_is_two_arrows_along_its_axis(opened):
    page = opened.page
    page.keyboard.press("w")
    ask(opened, stretch_axis=30, stretch_along=3)
    opened.until("last.deformation?.kind === 'stretch'")
    told = page.evaluate("window.tomoskin.last.deformation")
    assert abs(told["axis"]["value"] - math.radians(30)) < math.radians(10)
    axis = told["axis"]["value"]
    for part, on in ((0.05, True), (-0.05, True), (0.0, False)):
        place = [part * math.cos(axis), part * math.sin(axis)]
        assert page.evaluate(INKED, place) is on, part
    picture(page, "stretch")
    opened.test_id("lay-flat").click()
