"""The page before the board's real firmware: a press on it is a press on the emulated board."""

from __future__ import annotations

import pytest

from firmware.emulator.conftest import programs
from server.serving import Site
from server.watching import distance
from tomoskin.run import Runner
from tomoskin.server.handlers import TwinHandlers
from tomoskin_emulator.source import open_emulator

__all__ = ["programs"]

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

PLACE = (0.03, 0.02)


@pytest.fixture
def site(programs, prepared, monkeypatch):
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: programs)
    runner = Runner(prepared, lambda: open_emulator("seed=1", prepared.skin))
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def test_a_press_on_the_page_is_a_press_on_the_emulated_board(opened):
    opened.test_id("state").filter(has_text="Live").wait_for()
    opened.until("scene.source.includes('emulator of textile-disc-8')")
    assert opened.read()["touches"] == []
    opened.page.keyboard.press("w")
    opened.test_id("stretch-along").wait_for()
    assert opened.test_id("cut-1").count() == 0, "wires of the emulated board do not break"
    opened.press(*PLACE)
    opened.until("last.truths[0].force >= 8 && window.tomoskin.last.touches.length === 1")
    read = opened.read()
    assert distance([read["truths"][0]["x"], read["truths"][0]["y"]], PLACE) < 1e-3
    assert distance([read["touches"][0]["x"], read["touches"][0]["y"]], PLACE) < 0.015
    opened.test_id("touch-row").first.wait_for()
    opened.page.mouse.up()
    opened.lifted()
