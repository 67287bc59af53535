"""The page as an instrument: settings, signals, the broken twin, space, and who can use it."""

import gzip
import re
from functools import partial

import pytest

from server.looks import look_in_both
from server.serving import Site
from server.watching import Watched, axe_finds
from tomoskin.board.source import open_source
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner
from tomoskin.server.handlers import TwinHandlers
from tomoskin.server.server import STATIC
from tomoskin.server.settings_handlers import SettingsHandlers

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

MOST_GZIPPED = 120_000


def serve_page(hub):
    hub.opener = partial(open_source, "twin")
    SettingsHandlers(hub)
    TwinHandlers(hub)


@pytest.fixture(scope="module")
def site(prepared, tmp_path_factory):
    runner = Runner(prepared, lambda: open_source("twin", prepared.skin))
    runner.start()
    site = Site(runner, folder=tmp_path_factory.mktemp("session"), take=serve_page)
    yield site
    site.stop()
    runner.stop()


def test_a_setting_shows_in_the_picture_and_is_taken_back(opened):
    opened.page.keyboard.press("e")
    opened.test_id("set-touch-method").wait_for(state="attached")
    assert opened.test_id("set-touch-gamma1").count() == 0, "a fit has no thresholds"
    alpha = opened.test_id("alpha")
    opened.test_id("set-alpha").focus()
    opened.page.keyboard.press("ArrowRight")
    alpha.filter(has_text="by hand").wait_for()
    opened.test_id("undo").click()
    alpha.filter(has_text="light-touch").wait_for()
    opened.test_id("set-inverse-exponent").fill("7")
    opened.page.keyboard.press("Enter")
    opened.test_id("refused").filter(has_text="expected a number from 0 to 2, got 7").wait_for()
    assert opened.page.evaluate("window.tomoskin.last.referenceReady")


def test_every_setting_has_its_meaning_and_says_itself_what_is_wrong_with_it(opened):
    """With its unit, and with electrodes as on the bench; also where the sheet cannot be made."""
    opened.page.keyboard.press("e")
    opened.test_id("section-electrodes").locator("summary").click()
    field = opened.page.locator(".field", has=opened.test_id("set-electrodes-width"))
    assert field.locator(".unit").inner_text() == "mm"
    opened.test_id("set-electrodes-width").fill("90")
    opened.page.keyboard.press("Enter")
    refused = field.get_by_test_id("refused")
    refused.filter(has_text="E2: overlaps E1 by").wait_for()
    assert opened.test_id("refused").count() == 1
    assert opened.test_id("set-electrodes-width").get_attribute("aria-invalid") == "true"
    refused.get_by_role("button").click()
    refused.wait_for(state="detached")
    meanings = opened.page.locator(".settings .field").evaluate_all(
        "all => all.filter(each => !each.querySelector('.help')?.textContent.trim()).length"
    )
    assert meanings == 0


def edit_pattern(opened):
    """Open the table with the skin's own rows."""
    opened.page.keyboard.press("e")
    opened.test_id("section-drive").locator("summary").click()
    opened.test_id("set-pattern").select_option("table")
    opened.test_id("pattern-row").first.wait_for()


def cell(opened, row, column):
    return opened.page.get_by_label(f"Row {row}, {column}", exact=True)


def test_another_pattern_reaches_the_twin(opened):
    before = opened.page.evaluate("window.tomoskin.scene.pattern.n_meas")
    edit_pattern(opened)
    opened.test_id("pattern-start").select_option("opposite")
    opened.test_id("pattern-said").filter(has_text="under 4 drives").wait_for()
    rows = int(opened.test_id("pattern-said").inner_text().split()[0])
    opened.page.get_by_label("Remove row 2", exact=True).click()
    opened.test_id("apply-table").click()
    opened.until(f"scene.pattern.n_meas === {rows - 1}")
    opened.until(f"last?.voltages.length === {rows - 1} && window.tomoskin.last.referenceReady")
    opened.test_id("undo").click()
    opened.until(f"scene.pattern.n_meas === {before}")
    opened.until(f"last?.voltages.length === {before} && window.tomoskin.last.referenceReady")


def test_a_pattern_is_edited_by_keys_and_errors_stand_at_their_row(opened):
    edit_pattern(opened)
    said = opened.test_id("pattern-said")
    words = said.inner_text()
    cell(opened, 1, "drive +").focus()
    opened.test_id("electrode-2").filter(has_text="E2 I+").wait_for()
    opened.test_id("electrode-3").filter(has_text="E3 V+").wait_for()
    opened.page.keyboard.press("ArrowDown")
    opened.test_id("electrode-4").filter(has_text="E4 V+").wait_for()
    cell(opened, 3, "read +").fill("9")
    said.filter(has_text="Row 3: read +: this skin has E1 to E8, not E9").wait_for()
    assert cell(opened, 3, "read +").get_attribute("aria-invalid") == "true"
    assert opened.test_id("apply-table").is_disabled()
    opened.page.get_by_label("Duplicate row 3").press("Enter")
    said.filter(has_text="and 1 more").wait_for()
    opened.page.get_by_label("Remove row 3").press("Enter")
    opened.page.get_by_label("Remove row 3").press("Enter")
    opened.test_id("add-row").press("Enter")
    for electrode in ("2", "E1", "5", "6"):
        opened.page.keyboard.type(electrode)
        opened.page.keyboard.press("Tab")
    said.filter(has_text="rows under").wait_for()
    assert said.inner_text() == words


def test_a_cut_electrode_is_said_in_words_and_by_shape(opened):
    opened.page.keyboard.press("w")
    opened.test_id("cut-3").click()
    warning = opened.test_id("warning").filter(has_text="E3 is open")
    warning.click()
    opened.test_id("warnings").filter(has_text="E3 is open").wait_for()
    warning.click()
    opened.test_id("warnings").wait_for(state="detached")
    electrode = opened.test_id("electrode-3")
    assert electrode.locator("rect").count() == 1
    assert "no current" in electrode.get_attribute("aria-label")
    assert opened.test_id("electrode-4").locator("rect").count() == 0
    opened.test_id("cut-3").click()
    electrode.locator("circle").wait_for()


def points_at(opened, electrode):
    """Whether the current's arrow has its head nearer to that electrode than its tail."""
    ends = opened.page.evaluate(
        """id => {
            const path = document.querySelector("[data-testid=current] path");
            const tail = path.getPointAtLength(0);
            const head = path.getAttribute("d").match(/L([\\d.]+) ([\\d.]+)/);
            const [x, y] = head.slice(1).map(Number);
            const arc = document.querySelector(`[data-testid=${id}] .arc`).getBBox();
            const middle = [arc.x + arc.width / 2, arc.y + arc.height / 2];
            const far = (px, py) => Math.hypot(px - middle[0], py - middle[1]);
            return [far(x, y), far(tail.x, tail.y)];
        }""",
        electrode,
    )
    return ends[0] < 0.5 * ends[1]


def test_signals(opened):
    opened.page.keyboard.press("g")
    assert "E2 to E1" in opened.test_id("drive").inner_text(), "from the source to the sink"
    assert "E2: good, source" in opened.test_id("electrode-2").text_content()
    assert "E1: good, sink" in opened.test_id("electrode-1").text_content()
    assert points_at(opened, "electrode-1")
    opened.test_id("signals-noise").click()
    opened.test_id("signals-sum").filter(has_text="µV").wait_for()
    opened.test_id("signals-reciprocity").click()
    opened.test_id("signals-sum").filter(has_text="%").wait_for()


def test_the_latency_of_every_stage(opened):
    opened.page.keyboard.press("g")
    opened.test_id("signals-latency").click()
    for stage in ("sample", "decode", "reconstruct", "publish", "paint"):
        known = opened.test_id(f"stage-{stage}").locator("td").filter(has_text=re.compile(r"\d"))
        known.last.wait_for()
        assert known.count() == 2
    assert opened.page.evaluate("window.tomoskin.ready") > 0


def test_the_value_under_the_pointer(opened):
    opened.move(0.02, -0.03)
    opened.test_id("reading").filter(has_text="20, −30 mm").wait_for()


def test_a_bent_sheet_is_pressed_in_space(browser):
    changes = {
        "surface": {"shape": "cylinder", "radius": "90 mm"},
        "mesh": {"cells": 800},
    }
    skin = Skin.load("textile-disc-8").altered(changes)
    prepared = prepare(skin)
    runner = Runner(prepared, lambda: open_source("twin", skin))
    runner.start()
    site = Site(runner)
    bent = Watched(browser, site, prepared.mesh)
    try:
        bent.open()
        assert bent.test_id("do-space").get_attribute("aria-pressed") == "true"
        bent.press(0.02, 0.01)
        x, y = bent.page.evaluate(
            "[window.tomoskin.last.truths[0].x, window.tomoskin.last.truths[0].y]"
        )
        assert (x, y) == pytest.approx((0.02, 0.01), abs=2e-3)
        bent.page.mouse.up()
        assert bent.wrong == []
    finally:
        bent.context.close()
        site.stop()
        runner.stop()


def test_axe_finds_nothing_in_a_pattern_with_a_fault(opened):
    edit_pattern(opened)
    cell(opened, 2, "read +").fill("99")
    opened.test_id("pattern-said").filter(has_text="Row 2").wait_for()
    assert axe_finds(opened.page, ".own") == []
    assert look_in_both(opened.page, "pattern") == {}


def test_the_bundle_is_small():
    parts = [path for path in STATIC.rglob("*") if path.suffix in {".js", ".css", ".html", ".svg"}]
    assert sum(len(gzip.compress(path.read_bytes())) for path in parts) < MOST_GZIPPED
