"""The flows in which someone presses the skin, each once in real Chromium, on a twin in a hurry."""

from __future__ import annotations

from contextlib import closing
from functools import partial

import pytest

from server.looks import look_in_both
from server.serving import Site
from server.test_play import Page
from server.watching import Watched
from tomoskin.board.source import open_source
from tomoskin.learning import DEPTH, FORCE, TOUCH
from tomoskin.model.skin import Skin
from tomoskin.run import Runner, commands
from tomoskin.server import serve_requests

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("learnt")


@pytest.fixture(scope="module")
def site(prepared, folder):
    runner = Runner(prepared, lambda: open_source("twin:fast", prepared.skin))
    runner.start()

    def take(hub):
        hub.opener = partial(open_source, "twin:fast")
        serve_requests(hub, "twin")

    site = Site(runner, folder=folder, take=take)
    yield site
    site.stop()
    runner.stop()


@pytest.fixture(autouse=True)
def as_it_was(site, prepared):
    """What a test has learnt serves no other."""
    yield
    site.runner.ask(commands.Change(prepared))


def looks_right(opened, name):
    assert look_in_both(opened.page, name) == {}


def press_dot(opened, done):
    """Press with the pointer where the dot is; until the press is taken."""
    opened.test_id("phase").filter(has_text="where the dot is").wait_for()
    box = opened.page.locator(".target .core").bounding_box()
    opened.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    opened.page.mouse.down()
    opened.test_id("taken").filter(has_text=f"{done + 1} press").wait_for()
    opened.page.mouse.up()


def guided(opened, kind, count):
    opened.test_id("open-setup").click()
    opened.test_id(f"step-{kind}").click()
    opened.test_id("flow-begin").click()
    for _ in range(20):
        opened.page.keyboard.press("+")
    for done in range(count):
        press_dot(opened, done)
    opened.page.wait_for_function(
        "() => !document.querySelector('[data-testid=flow-keep]').disabled"
    )


def in_sight(opened, *names):
    """Each is seen in the drawer without scrolling."""
    drawer = opened.page.locator(".drawn").bounding_box()
    for name in names:
        box = opened.test_id(name).bounding_box()
        assert box["y"] + box["height"] <= drawer["y"] + drawer["height"], name


def test_touch_is_taught_by_pressing_dots(opened, folder):
    guided(opened, "touch", 6)
    opened.test_id("flow-text").filter(has_text="Median error").wait_for()
    in_sight(opened, "phase", "flow-undo", "flow-end", "flow-keep")
    looks_right(opened, "touch")
    opened.test_id("flow-keep").click()
    opened.test_id("calibration").filter(has_text="touch.npz").wait_for()
    in_sight(opened, "calibration", "flow-begin")
    assert len(TOUCH.read(folder / "touch.npz").model.presses) == 6
    opened.press(0.03, 0.03)
    looks_right(opened, "calibrated")
    opened.page.mouse.up()
    opened.lifted()


def test_the_wires_are_found_by_pressing_dots(opened, folder):
    guided(opened, "mapping", 3)
    opened.test_id("flow-text").filter(has_text="as the skin file says").wait_for()
    looks_right(opened, "mapping")
    opened.test_id("flow-keep").click()
    opened.test_id("flow-begin").wait_for()
    assert Skin.load(folder / "mapped.toml").n_electrodes == 8


def test_a_kept_press_is_on_the_twin_after_its_pattern_has_changed(opened, site):
    before = opened.page.evaluate("window.tomoskin.scene.pattern.name")
    opened.page.keyboard.down("Shift")
    opened.press(0.03, 0.03)
    opened.page.mouse.up()
    opened.page.keyboard.up("Shift")
    with site.connect() as socket:
        page = Page(socket)
        page.ask("settings", changes={"drive": {"pattern": "opposite"}})
        page.told("scene", lambda m: m["pattern"]["name"] != before)
        page.told("settings", lambda m: not m["busy"])
        opened.until("last?.truths.length === 1")
        opened.page.keyboard.press("Escape")
        opened.until("last?.truths.length === 0")
        page.ask("undo")
        page.told("scene", lambda m: m["pattern"]["name"] == before)


def lay(opened, newtons, place, done):
    """Say a weight and lay it on with the pointer; until it is taken."""
    opened.test_id("label").fill(f"{newtons:g}")
    opened.page.keyboard.press("Enter")
    opened.test_id("label-now").filter(has_text=f"{newtons:g} N").wait_for()
    opened.test_id("phase").filter(has_text="Put the weight on").wait_for()
    opened.move(*place)
    opened.page.mouse.down()
    opened.test_id("taken").filter(has_text=f"{done + 1} press").wait_for()
    opened.page.mouse.up()


def test_weights_are_laid_on_and_forces_are_shown(opened, folder):
    opened.test_id("open-setup").click()
    opened.test_id("step-force").click()
    opened.test_id("flow-begin").click()
    opened.test_id("label-unit").select_option("N")
    opened.test_id("label").fill("200")
    opened.page.keyboard.press("Enter")
    opened.test_id("flow-asked").filter(has_text="Did you mean 200 g (1.96 N)?").wait_for()
    places = [(0.03, 0.03), (-0.04, 0.02), (0.0, -0.05), (-0.02, -0.02), (0.04, -0.03)]
    for done, (newtons, place) in enumerate(zip((2, 8, 4, 6, 3), places, strict=True)):
        lay(opened, newtons, place, done)
    opened.test_id("flow-text").filter(has_text="forces are missed by").wait_for()
    in_sight(opened, "phase", "label-set", "flow-end", "flow-keep")
    looks_right(opened, "force")
    opened.test_id("flow-keep").click()
    opened.test_id("calibration").filter(has_text="force.npz").wait_for()
    forces = FORCE.read(folder / "force.npz")
    learnt = forces.model.presses
    assert learnt.amount[learnt.labelled].tolist() == [2, 8, 4, 6, 3]
    opened.press(0.03, 0.03)
    opened.test_id("force").wait_for()
    looks_right(opened, "forces")
    opened.test_id("strength-unit").filter(has_text="Force, N").press("Enter")
    opened.test_id("strength-unit").filter(has_text="Strength, S").wait_for()
    assert opened.test_id("force").count() == 0, "the list and the chart show the same"
    opened.page.mouse.up()
    opened.page.get_by_label("Calibration").select_option("")
    opened.test_id("calibration").filter(has_text="No weights").wait_for()


def test_depths_are_read_off_the_twin_and_shown(opened, site, folder):
    twin = site.runner.flow.twin
    opened.test_id("open-setup").click()
    opened.test_id("step-depth").click()
    opened.test_id("calibration-of-depth").filter(has_text="uncalibrated").wait_for()
    opened.test_id("flow-begin").click()
    places = [(0.03, 0.03), (-0.04, 0.02), (0.0, -0.05), (-0.02, -0.02), (0.04, -0.03)]
    depths = []
    for done, place in enumerate(places):
        opened.test_id("phase").filter(has_text="Press anywhere, and hold").wait_for()
        for _ in range(2):
            opened.page.keyboard.press("+")
        opened.move(*place)
        opened.page.mouse.down()
        opened.test_id("taken").filter(has_text=f"{done + 1} press").wait_for()
        depths.append(twin.depth)
        opened.page.mouse.up()
    opened.test_id("flow-text").filter(has_text="depths are missed by").wait_for()
    in_sight(opened, "phase", "flow-end", "flow-keep")
    looks_right(opened, "depth")
    opened.test_id("flow-keep").click()
    opened.test_id("calibration-of-depth").filter(has_text="depth.npz").wait_for()
    learnt = DEPTH.read(folder / "depth.npz").model.presses
    assert learnt.amount[learnt.labelled] == pytest.approx(depths, abs=1e-6)
    opened.press(0.03, 0.03)
    opened.test_id("depth").wait_for()
    opened.test_id("strength-unit").filter(has_text="Depth, mm").wait_for()
    opened.page.mouse.up()
    opened.page.get_by_label("Depths from").select_option("")
    opened.test_id("calibration-of-depth").filter(has_text="uncalibrated").wait_for()


def test_a_flow_whose_drawer_is_closed_is_paused_and_named(opened):
    opened.test_id("open-setup").click()
    opened.test_id("step-force").click()
    opened.test_id("flow-begin").click()
    opened.test_id("label-unit").select_option("N")
    lay(opened, 2, (0.03, 0.03), 0)
    opened.test_id("state").filter(has_text="Teaching forces").wait_for()
    opened.test_id("label").fill("0")
    opened.page.keyboard.press("Enter")
    opened.test_id("remark").filter(has_text="expected a weight").wait_for()
    opened.test_id("remark").filter(has_text="Teaching forces: 1 recorded").wait_for()
    opened.test_id("open-setup").click()
    opened.test_id("state").filter(has_text="Teaching paused").wait_for()
    opened.test_id("remark").filter(has_text="Teaching forces is paused, 1 recorded").wait_for()
    looks_right(opened, "flow-paused")
    opened.press(-0.03, 0.03)
    held = "() => window.tomoskin.last.truths[0]?.force > 5"
    opened.page.wait_for_function(held)  # the weight that was said counts no more
    opened.page.mouse.up()
    opened.lifted()
    opened.page.reload()
    opened.until("last?.referenceReady")
    opened.test_id("state").filter(has_text="Teaching paused").wait_for()
    opened.test_id("open-setup").click()
    opened.test_id("taken").filter(has_text="1 press recorded").wait_for()
    opened.test_id("state").filter(has_text="Teaching forces").wait_for()
    assert opened.test_id("label").input_value() == "2"
    assert opened.test_id("label-unit").input_value() == "N"
    opened.test_id("flow-end").click()
    opened.test_id("flow-end").filter(has_text="Forget all of it").click()
    opened.test_id("state").filter(has_text="Live").wait_for()


def test_on_a_telephone_a_drawer_leaves_the_touch_in_sight(browser, site, prepared):
    phone = Watched(browser, site, prepared.mesh, (390, 844), touch=True)
    with closing(phone.context):
        phone.open()
        phone.page.keyboard.down("Shift")
        phone.press(0.03, 0.03)
        phone.page.mouse.up()
        phone.page.keyboard.up("Shift")
        phone.test_id("open-setup").click()
        drawer = phone.test_id("drawer-setup").bounding_box()
        row = phone.test_id("touch-row").bounding_box()
        side = phone.page.locator(".side").bounding_box()
        assert side["y"] <= row["y"] < row["y"] + row["height"] <= drawer["y"] + 1
        looks_right(phone, "phone-drawer")
        phone.page.keyboard.press("Escape")
        phone.page.keyboard.press("Escape")
        phone.lifted()
        assert phone.wrong == []
