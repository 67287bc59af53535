"""Flows once in real Chromium: line of time, sessions, set-up, a server anew."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from server.looks import look_in_both
from server.serving import Site
from server.watching import Watched
from tomoskin.board.source import open_source
from tomoskin.run import Runner
from tomoskin.server import load_token, serve_requests

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sessions")


@pytest.fixture(scope="module")
def site(prepared, folder):
    runner = Runner(prepared, lambda: open_source("twin", prepared.skin))
    runner.start()
    site = Site(runner, folder=folder, take=lambda hub: serve_requests(hub, "twin"))
    yield site
    site.stop()
    runner.stop()


def looks_right(opened, name):
    assert look_in_both(opened.page, name) == {}


def test_a_recording_is_marked_listed_exported_played_and_left(opened, folder):
    page = opened.page
    assert opened.test_id("timeline").count() == 0
    before = opened.test_id("sheet").bounding_box()
    opened.test_id("do-record").click()
    opened.test_id("state").filter(has_text="Recording").wait_for()
    assert opened.test_id("do-record").get_attribute("aria-pressed") == "true"
    opened.test_id("timeline").wait_for()
    assert opened.test_id("sheet").bounding_box() == before, "the sheet moves under a finger"
    opened.press(0.03, 0.02)
    page.keyboard.press("m")
    opened.test_id("mark-text").fill("a finger")
    page.keyboard.press("Enter")
    opened.page.locator(".track-of-time .note").wait_for()
    opened.test_id("span").first.wait_for()
    looks_right(opened, "recording")
    page.mouse.up()
    opened.lifted()
    page.keyboard.press("c")
    opened.test_id("timeline").wait_for(state="detached")
    [path] = folder.glob("*.mcap")

    opened.test_id("open-sessions").click()
    row = opened.test_id("session").filter(has_text=path.name)
    row.get_by_role("button", name="Export").click()
    link = opened.test_id(f"get-{path.stem}-touches.csv")
    link.wait_for()
    with page.expect_download() as download:
        link.click()
    assert download.value.suggested_filename == f"{path.stem}-touches.csv"
    assert Path(download.value.path()).read_text().startswith("frame,time_s,id,")
    looks_right(opened, "sessions")
    row.get_by_role("button", name="Name and notes").click()
    opened.test_id("session-name").fill("Prüfung")
    opened.test_id("name-problem").filter(has_text="not ü").wait_for()
    assert opened.page.get_by_role("button", name="Rename").is_disabled()
    opened.test_id("session-notes").fill("the left hand, softly")
    looks_right(opened, "session")
    opened.page.get_by_role("button", name="Save notes").click()
    row.filter(has_text="the left hand").wait_for()
    _played_and_left(opened, row, path)


def _played_and_left(opened, row, path):
    page = opened.page
    row.get_by_role("button", name="Play").click()
    opened.test_id("state").filter(has_text="Playing").wait_for()
    opened.until(f"scene.source.endsWith('{path.name}')")
    opened.test_id("span").first.wait_for()
    assert page.locator(".track-of-time .note").get_attribute("title").endswith("a finger")
    opened.test_id("speed").select_option("0.5")
    opened.test_id("loop").click()
    page.locator("[data-testid=loop][aria-pressed=true]").wait_for()
    opened.test_id("loop").click()
    page.locator("[data-testid=loop][aria-pressed=false]").wait_for()
    opened.test_id("do-pause").click()
    opened.test_id("state").filter(has_text="Paused").wait_for()
    assert page.get_by_role("button", name="Go on").count() == 1, "there is one pause"
    span = opened.test_id("span").first.bounding_box()
    track = opened.test_id("track").bounding_box()
    page.mouse.click(span["x"] + span["width"] / 2, track["y"] + 6)
    before = opened.read()["sequence"]
    opened.test_id("step").click()
    opened.until("last.touches.length === 1")
    opened.until("last.truths.length === 1")
    opened.test_id("do-truth").click()
    opened.until(f"last.sequence !== {before}")
    looks_right(opened, "replay")
    opened.test_id("track").focus()
    page.keyboard.press("Home")
    opened.test_id("when").filter(has_text="0:00").wait_for()
    opened.test_id("do-truth").click()
    opened.test_id("go-live").click()
    opened.test_id("step").wait_for(state="detached")
    opened.until("scene.source.startsWith('twin')")


FOCUSED = """() => {
    const one = document.activeElement;
    if (!one.matches("a, button, input, select, textarea, [role=application]")) return "";
    return one.getAttribute("aria-label") ?? one.labels?.[0]?.textContent ?? one.textContent;
}"""
"""What a screen reader calls what has the focus."""


def focus_on(page, name, most=60):
    """Tab on until the focus is on what is called so."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if name in page.evaluate(FOCUSED):
            return
    raise AssertionError(f"no way by Tab to {name}")


def test_pressing_recording_and_setting_up_without_pointer_and_without_eyes(opened, folder):
    page, before = opened.page, set(folder.glob("*.mcap"))
    focus_on(page, "The sheet")
    opened.test_id("probe").filter(has_text="Probe at 0, 0 millimetres").wait_for(state="attached")
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("c")
    opened.test_id("state").filter(has_text="Recording").wait_for()
    page.keyboard.press("Enter")
    opened.test_id("probe").filter(has_text="Pressed at 30, 0 with").wait_for(state="attached")
    log = page.get_by_role("log")
    log.filter(has_text="millimetres").wait_for(state="attached")
    assert re.match(r"touch \d+ at (2|3)\d, −?\d+ millimetres", log.text_content())
    page.keyboard.press("Enter")
    log.filter(has_text="No touch").wait_for(state="attached")
    page.keyboard.press("c")
    opened.test_id("state").filter(has_text="Live").wait_for()
    [path] = set(folder.glob("*.mcap")) - before
    page.keyboard.press("s")
    opened.test_id("session").filter(has_text=path.name).wait_for()
    focus_on(page, f"Name and notes of {path.name}")
    page.keyboard.press("Enter")
    focus_on(page, "Name")
    page.keyboard.press("Control+a")
    page.keyboard.type("by-keys")
    page.keyboard.press("Enter")
    row = opened.test_id("session").filter(has_text="by-keys.mcap")
    row.wait_for()
    focus_on(page, "Name and notes of by-keys.mcap")
    page.keyboard.press("Enter")
    focus_on(page, "Delete")
    page.keyboard.press("Enter")
    assert path.with_name("by-keys.mcap").exists(), "it is asked twice"
    page.keyboard.press("Enter")
    row.wait_for(state="detached")
    page.keyboard.press("Escape")
    page.keyboard.press("u")
    focus_on(page, "3 Touch")
    page.keyboard.press("Enter")
    focus_on(page, "Begin")
    page.keyboard.press("Enter")
    opened.test_id("phase").wait_for()
    focus_on(page, "Leave")
    page.keyboard.press("Enter")
    opened.test_id("flow-begin").wait_for()
    page.keyboard.press("Escape")
    opened.test_id("drawer-setup").wait_for(state="detached")


def test_the_board_says_what_it_is_and_is_connected_anew(opened):
    opened.test_id("open-setup").click()
    opened.test_id("board").filter(has_text="Firmware").wait_for()
    opened.test_id("reference-words").filter(has_text="ago").wait_for()
    opened.page.get_by_role("button", name="reconnect").click()
    opened.test_id("reference-words").filter(has_text="keep hands off").wait_for()
    opened.test_id("reference-words").filter(has_text="ago").wait_for()
    opened.test_id("take-reference").click()
    opened.test_id("reference-words").filter(has_text="keep hands off").wait_for()
    opened.test_id("reference-words").filter(has_text="ago").wait_for()
    looks_right(opened, "board")


def test_a_page_finds_a_server_that_was_started_again_with_its_token(
    browser, site, prepared, tmp_path
):
    token = load_token(tmp_path / "token")
    first = Site(site.runner, token=token)
    watched = Watched(browser, first, prepared.mesh)
    watched.open()
    first.stop()
    watched.test_id("state").filter(has_text="Disconnected").wait_for()
    watched.test_id("warning").filter(has_text="Connection lost").wait_for()
    second = Site(site.runner, token=load_token(tmp_path / "token"), port=first.port)
    try:
        watched.test_id("state").filter(has_text="Live").wait_for()
    finally:
        second.stop()
    third = Site(site.runner, port=first.port)
    try:
        watched.test_id("warning").filter(has_text="started again and does not know").click()
        watched.test_id("warnings").filter(has_text="open the address").wait_for()
        looks_right(watched, "refused")
    finally:
        third.stop()
        watched.context.close()
