"""Each panel in light and dark, wide and narrow, with a mouse and with fingers: nothing is cut off,
overlaps, stands out of order, is too small to hit or to read, or too faint; nothing scrolls.

With ``TOMOSKIN_PICTURES=FOLDER`` the pictures of all that is looked at go there, for a person.
"""

from __future__ import annotations

import pytest

from server.looks import look, look_in_both
from server.still import PANELS, show, still_site
from server.watching import Watched, axe_finds

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

SIZES = {
    (1280, 720): False,
    (1440, 900): False,
    (820, 1180): True,
    (390, 844): True,
}
"""Whether it is pressed with fingers."""

AXE_LOOKS = ((1280, 720), (390, 844))
"""Where axe-core looks too."""

PLANTED = {
    "cutOff": [".choice", "width: 90px; overflow: hidden"],
    "overlapping": ["[data-testid=do-pause]", "margin-left: -60px"],
    "spilling": [".lamp", "position: relative; top: 60px"],
    "outOfOrder": [".controls", "flex-direction: row-reverse"],
    "tooSmallToHit": [".choice button", "min-height: 0; height: 18px; padding: 0; line-height: 1"],
    "tooSmallToRead": [".facts dt", "font-size: 11px"],
    "tooFaint": [".legend .unit", "color: #bbb"],
    "scrolling": ["#page", "min-height: 900px"],
}
WRITTEN = {
    "cutOff": [-20, "16px sans-serif", "#000"],
    "overlapping": [300, "16px sans-serif", "#000"],
    "tooSmallToRead": [300, "9px sans-serif", "#000"],
    "tooFaint": [300, "16px sans-serif", "#ccc"],
}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with still_site(tmp_path_factory.mktemp("empty")) as site:
        yield site


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_every_panel_looks_right(browser, site, prepared, size):
    watched = Watched(browser, site, prepared.mesh, size, touch=SIZES[size])
    watched.open()
    wrong, sheets = {}, []
    for panel in PANELS:
        show(watched, panel)
        name = f"{panel}-{size[0]}"
        wrong |= {
            f"{name}: {fact}": what for fact, what in look_in_both(watched.page, name).items()
        }
        sheets.append(under_the_top_line(watched))
        if size in AXE_LOOKS:
            wrong |= {f"{name}: {rule}": where for rule, where in axe_finds(watched.page)}
    watched.context.close()
    assert not wrong
    assert watched.wrong == []
    assert sheets == [sheets[0]] * len(sheets), "a drawer moves the sheet"
    if size[0] > size[1]:
        assert sheets[0]["width"] > 0.6 * size[0]


def under_the_top_line(watched):
    """Where the sheet is; a warning, as when a busy machine sends no frame, moves it with all."""
    sheet = watched.test_id("sheet").bounding_box()
    top = watched.page.locator("header").first.bounding_box()
    return sheet | {"y": round(sheet["y"] - top["y"] - top["height"], 2)}


def test_what_matters_is_large(opened):
    """In CSS pixels, for somebody two metres away: figures of touches, the state."""
    opened.test_id("touch-row").first.wait_for()
    assert opened.page.evaluate("looks.least('[data-testid=touch-row] .large')") >= 24
    assert opened.page.evaluate("looks.least('[data-testid=state] strong, .facts dd')") >= 18


def test_planted_faults_are_found(opened):
    """Every fact can be broken, by the page and by what a canvas shows."""
    page = opened.page
    opened.test_id("touch-row").first.wait_for()
    assert look(page, "planted") == {}
    for fact, planted in PLANTED.items():
        assert fact in page.evaluate("planted => looks.faultsWith(...planted)", planted)
    for fact, words in WRITTEN.items():
        assert look(page, "planted") == {}, "the next frame clears the canvas"
        assert fact in page.evaluate("words => looks.faultsWithWords(...words)", words)
