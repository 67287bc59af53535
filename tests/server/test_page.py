"""The built page in real Chromium, on the real server and the twin."""

import time

import pytest

from run.test_runner import Watch
from server.serving import Site
from server.watching import TO_CLIENT, Watched, distance
from tomoskin.board.source import open_source
from tomoskin.run import Runner

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

NEAR = 0.015
RING = """() => {
    const canvas = [...document.querySelectorAll(".sheet canvas")].at(-1);
    const style = getComputedStyle(document.documentElement).getPropertyValue("--truth").trim();
    const [r, g, b] = [1, 3, 5].map(at => parseInt(style.slice(at, at + 2), 16));
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let k = 0; k < data.length; k += 4) {
        const off = Math.abs(data[k] - r) + Math.abs(data[k + 1] - g) + Math.abs(data[k + 2] - b);
        count += data[k + 3] > 250 && off < 6;
    }
    return count;
}"""
"""Pixels in the colour of the truth."""


def ring_colours(opened):
    return opened.page.evaluate(RING)


@pytest.fixture(scope="module")
def site(prepared):
    runner = Runner(prepared, lambda: open_source("twin", prepared.skin))
    runner.start()
    site = Site(runner)
    yield site
    site.stop()
    runner.stop()


def test_it_loads_and_says_that_it_is_live(opened, prepared):
    opened.test_id("state").filter(has_text="Live").wait_for()
    assert "textile-disc-8" in opened.page.locator(".top .skin").inner_text()
    opened.test_id("touch-list").filter(has_text="Press the sheet").wait_for()
    assert opened.page.evaluate("window.tomoskin.scene.points.length") == prepared.mesh.points.size
    assert "token" not in opened.page.url


@pytest.mark.parametrize("place", [(-0.04, 0.05), (-0.07, -0.03)])
def test_a_press_appears_where_it_was_pressed(opened, place):
    opened.press(*place)
    opened.until("last.touches.length === 1 && window.tomoskin.last.truths[0].force >= 5")
    read = opened.read()
    assert distance([read["truths"][0]["x"], read["truths"][0]["y"]], place) < 0.001
    assert distance([read["touches"][0]["x"], read["touches"][0]["y"]], place) < NEAR
    assert read["touches"][0]["kind"] == "decrease"
    assert distance(opened.extreme(), place) < NEAR
    opened.test_id("touch-row").first.wait_for()
    rows = opened.rows()
    assert len(rows) == 1
    assert distance(rows[0], place) < NEAR
    opened.page.mouse.up()
    opened.lifted()
    opened.test_id("touch-row").first.wait_for(state="detached")


def test_a_press_slides_and_keeps_its_number(opened):
    opened.press(0.04, 0.0)
    first = opened.read()["touches"][0]["id"]
    for step in range(1, 9):
        opened.move(0.04 - 0.01 * step, 0.005 * step)
        opened.until(f"last.truths[0].x < {0.041 - 0.01 * step}")
    opened.until("last.touches[0]?.x < -0.025")
    read = opened.read()
    assert [touch["id"] for touch in read["touches"]] == [first]
    assert distance([read["touches"][0]["x"], read["touches"][0]["y"]], (-0.04, 0.04)) < NEAR
    opened.page.mouse.up()
    opened.lifted()


def test_several_presses_stay_with_shift_and_escape_lifts_them(opened):
    places = [(-0.05, 0.0), (0.05, 0.0)]
    opened.page.keyboard.down("Shift")
    for count, place in enumerate(places, 1):
        opened.move(*place)
        opened.page.mouse.down()
        opened.until(f"last.truths.length === {count}")
        opened.until(f"last.truths[{count - 1}].force >= 6")
        opened.page.mouse.up()
    opened.page.keyboard.up("Shift")
    opened.until("last.touches.length === 2")
    opened.test_id("touch-row").nth(1).wait_for()
    rows = opened.rows()
    for place in places:
        assert min(distance(row, place) for row in rows) < NEAR
    opened.page.keyboard.press("Escape")
    opened.lifted()


def tap_twice(phone, place):
    """A tenth of a second apart by the events' own times, however busy the machine is."""
    session, begin = phone.context.new_cdp_session(phone.page), time.time()
    for step, kind in enumerate(("touchStart", "touchEnd") * 2):
        points = [place] if kind == "touchStart" else []
        event = {"type": kind, "touchPoints": points, "timestamp": begin + 0.05 * step}
        session.send("Input.dispatchTouchEvent", event)


def test_two_taps_of_a_finger_keep_a_press_and_two_more_lift_it(browser, site, prepared):
    """On a telephone, whose screen the skin fills from side to side."""
    phone = Watched(browser, site, prepared.mesh, (390, 844), touch=True)
    try:
        phone.open()
        left, right = (phone.page.evaluate(TO_CLIENT, [x, 0])["x"] for x in (-0.1, 0.1))
        assert right - left > 0.8 * 390
        place = phone.page.evaluate(TO_CLIENT, [0.03, 0.02])
        tap_twice(phone, place)
        phone.test_id("touch-row").wait_for()
        phone.until("last.truths.length === 1")  # the row may be of an older frame than the newest
        assert phone.read()["truths"][0]["x"] == pytest.approx(0.03, abs=2e-3)
        tap_twice(phone, place)
        phone.lifted()
        assert phone.wrong == []
    finally:
        phone.context.close()


def test_the_truth_shows_around_the_pointers_own_press(opened):
    """Its ring is drawn over what the press itself draws, outside of its rim."""
    opened.press(0.03, 0.02)
    opened.until("last.truths[0].force >= 5")
    opened.page.keyboard.press(" ")
    opened.test_id("state").filter(has_text="Paused").wait_for()
    assert ring_colours(opened) == 0
    opened.page.keyboard.press("t")
    opened.page.wait_for_function(f"() => ({RING})() > 100")
    opened.page.keyboard.press(" ")
    opened.page.mouse.up()
    opened.lifted()


def test_the_reference_and_pause_by_key(opened):
    opened.page.keyboard.press("r")
    opened.until("last.referenceReady === false")
    opened.until("last.referenceReady")
    opened.page.keyboard.press(" ")
    opened.test_id("state").filter(has_text="Paused").wait_for()
    opened.page.keyboard.press(" ")
    opened.test_id("state").filter(has_text="Live").wait_for()


def test_presses_are_lifted_when_the_page_goes(opened):
    opened.press(0.03, 0.03)
    runner = opened.site.runner
    assert runner.newest.truth
    opened.page.close()
    Watch(runner).until(lambda: not runner.newest.truth and not runner.newest.result.touches)
