"""The built page in real Chromium, on the real server and the twin."""

import pytest

from live.serving import Site
from live.watching import Watched, distance
from tomoskin.live import Runner
from tomoskin.session import session_info
from tomoskin.source import open_source

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

NEAR = 0.015


@pytest.fixture
def site(prepared):
    runner = Runner(prepared, lambda: open_source("twin", prepared.skin))
    runner.start()
    site = Site(runner)
    yield site
    site.stop()
    runner.stop()


@pytest.fixture
def opened(browser, site, prepared):
    watched = Watched(browser, site, prepared.mesh)
    watched.open()
    yield watched
    watched.context.close()


def test_it_loads_and_says_that_it_is_live(opened, prepared):
    assert "(light-touch)" in opened.test_id("alpha").inner_text()
    state = opened.test_id("state")
    state.filter(has_text="Live").wait_for()
    assert "twin of textile-disc-8" in state.inner_text()
    assert opened.test_id("touch-row").count() == 0
    assert opened.page.evaluate("window.tomoskin.scene.points.length") == prepared.mesh.points.size
    assert "token" not in opened.page.url
    sizes = "[document.scrollingElement.scrollHeight, innerHeight]"
    height, room = opened.page.evaluate(sizes)
    assert height <= room
    assert opened.wrong == []


@pytest.mark.parametrize(
    "place", [(0.0, 0.0), (0.05, 0.02), (-0.04, 0.05), (0.02, -0.06), (-0.07, -0.03)]
)
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
    assert opened.wrong == []


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
    assert opened.wrong == []


def test_the_reference_and_pause_by_key(opened):
    opened.page.keyboard.press("r")
    opened.until("last.referenceReady === false")
    opened.until("last.referenceReady")
    opened.page.keyboard.press(" ")
    opened.test_id("state").filter(has_text="Paused").wait_for()
    opened.page.keyboard.press(" ")
    opened.test_id("state").filter(has_text="Live").wait_for()
    assert opened.wrong == []


def test_a_lost_server_is_said(opened):
    opened.test_id("state").filter(has_text="Live").wait_for()
    assert opened.wrong == []
    opened.site.stop()
    opened.test_id("state").filter(has_text="Connection lost").wait_for()


def test_presses_are_lifted_when_the_page_goes(opened):
    opened.press(0.03, 0.03)
    before = opened.site.runner.newest
    assert before.truth
    with opened.site.connect() as watcher:
        opened.page.close()
        for message in watcher:
            if isinstance(message, bytes) and not opened.site.runner.newest.truth:
                break


def test_the_record_button_records(opened, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    button = opened.test_id("do-record")
    button.click()
    opened.test_id("state").filter(has_text="Live, recording").wait_for()
    assert button.get_attribute("aria-pressed") == "true"
    opened.page.keyboard.press("c")
    opened.test_id("do-record").filter(has_text="Record").filter(has_not_text="End").wait_for()
    [path] = tmp_path.glob("*.mcap")
    assert session_info(path).frames > 0
    height, room = opened.page.evaluate("[document.scrollingElement.scrollHeight, innerHeight]")
    assert height <= room
