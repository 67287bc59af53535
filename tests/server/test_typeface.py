"""The page's own typeface: all that is shown is drawn with it, in Chromium, on any machine."""

from __future__ import annotations

import ast
from itertools import chain
from pathlib import Path

import pytest
from playwright.sync_api import Error

import tomoskin
from server.still import PANELS, show, still_site
from server.watching import Watched
from tomoskin.server.server import STATIC

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

FAMILY = "Source Sans 3"
MOST = 60_000
SAYING = ("core", "pipeline", "run", "server", "model/skin")
"""Rooms whose words a page shows: of units, of the server, of a skin's settings."""
WEIGHTS = (400, 500, 600, 700)
WIDTHS = """weights => weights.map(weight => {
    const pen = document.createElement('canvas').getContext('2d');
    pen.font = `${weight} 100px ${getComputedStyle(document.body).fontFamily}`;
    return [...'0123456789\\u2212+'].map(sign => pen.measureText(sign).width);
})"""

MARKED = """() => {
    for (const each of document.querySelectorAll('body *')) {
        const words = [...each.childNodes].some(node => node.nodeType === 3 && node.data.trim());
        each.toggleAttribute('data-said', words || each.matches('input, select'));
    }
}"""
SPELT = """signs => {
    const line = document.createElement('p');
    line.id = 'spelt';
    line.style.cssText = 'position: fixed; top: 0';
    line.append(...signs.map(sign => {
        const part = document.createElement('span');
        part.textContent = sign;
        return part;
    }));
    document.body.append(line);
}"""
ARRIVED = """() => performance.getEntriesByType('resource')
    .filter(each => each.name.endsWith('.woff2')).map(each => each.responseEnd)"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with still_site(tmp_path_factory.mktemp("empty")) as site:
        yield site


class Typeset:
    """Which typefaces Chromium really drew a part of a page with."""

    def __init__(self, page):
        self._session = page.context.new_cdp_session(page)
        for domain in ("DOM", "CSS"):
            self._session.send(f"{domain}.enable")

    def fonts(self, selector):
        """Of each element that ``selector`` names: what it and its words are drawn with."""
        root = self._session.send("DOM.getDocument", {"depth": 0})["root"]["nodeId"]
        asked = {"nodeId": root, "selector": selector}
        nodes = self._session.send("DOM.querySelectorAll", asked)["nodeIds"]
        drawn = (self._drawn_with(node) for node in nodes)
        return [fonts for fonts in drawn if fonts is not None]

    def _drawn_with(self, node):
        """None where the page has taken the element away meanwhile: its numbers go on."""
        try:
            return self._session.send("CSS.getPlatformFontsForNode", {"nodeId": node})["fonts"]
        except Error as error:
            if "Could not find node" not in error.message:
                raise
            return None


def ours(fonts):
    return all(font["familyName"].startswith(FAMILY) and font["isCustomFont"] for font in fonts)


def words_of(source):
    """The texts in a Python module that are no docstrings."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    return "".join(
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said
    )


def characters():
    """All that the page, its server and a skin's schema may write."""
    built = [path for path in STATIC.rglob("*") if path.suffix in {".js", ".css", ".html"}]
    rooms = [Path(tomoskin.__file__).parent / room for room in SAYING]
    modules = [path for room in rooms for path in room.rglob("*.py")]
    texts = [*(path.read_text(encoding="utf-8") for path in built), *map(words_of, modules)]
    return sorted(sign for sign in set("".join(texts)) if sign.isprintable() and sign != " ")


def test_every_panel_is_set_in_it(opened):
    typeset = Typeset(opened.page)
    for panel in PANELS:
        show(opened, panel)
        opened.page.evaluate(MARKED)
        fonts = list(chain.from_iterable(typeset.fonts("[data-said]")))
        assert len(fonts) > 20
        assert ours(fonts), panel


def test_it_has_every_character_that_the_page_may_write(opened):
    signs = [*characters(), "σ", "Ω", "²", "語"]
    opened.page.evaluate(SPELT, signs)
    drawn = Typeset(opened.page).fonts("#spelt span")
    strange = [sign for sign, fonts in zip(signs, drawn, strict=True) if not ours(fonts)]
    assert all(drawn)
    assert strange == ["語"], "as nobody writes on the page"


def test_canvases_are_written_in_it(opened):
    opened.test_id("touch-row").first.wait_for()
    opened.page.wait_for_function("() => looks.canvasTexts().some(text => text.words === '1')")
    written = opened.page.evaluate("looks.canvasTexts()")
    assert {"now", "0", "2–1", "1"} <= {text["words"] for text in written}, "axes, lines, touches"
    for text in written:
        assert f'px "{FAMILY}"' in text["font"]
        assert text["ready"], f"{text['words']} was drawn before the typeface was there"


def test_its_figures_and_signs_are_of_one_width(opened):
    for widths in opened.page.evaluate(WIDTHS, WEIGHTS):
        assert len(set(widths)) == 1


def test_it_comes_once_and_moves_nothing(browser, site, prepared):
    watched = Watched(browser, site, prepared.mesh)
    fonts = []

    def note(answer):
        if answer.url.endswith(".woff2"):
            fonts.append(answer)

    watched.page.on("response", note)
    watched.open()
    arrived = watched.page.evaluate(ARRIVED)
    shown = watched.page.evaluate("performance.getEntriesByName('first-contentful-paint')[0]")
    watched.context.close()
    assert len(fonts) == len({answer.url for answer in fonts}) == len(arrived) == 2
    assert all(answer.headers["content-type"] == "font/woff2" for answer in fonts)
    assert max(arrived) <= shown["startTime"], "words are shown only once the typeface is there"


def test_it_is_small():
    files = list(STATIC.rglob("*.woff2"))
    assert len(files) == 2
    assert sum(path.stat().st_size for path in files) <= MOST
