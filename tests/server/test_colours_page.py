"""What the page draws a fall and a rise in, pixel by pixel, beside the library's own scale."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from run.board import AS_TAKEN, Board, pressed, samples_of
from run.test_runner import Watch
from server.serving import Site
from tomoskin.core import CHANGE, CHANGE_ON_DARK
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

FALL, RISE = (0.05, 0.0), (-0.05, 0.0)
DRAWN = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
SHOWN = """centroids => ({
    image: [...window.tomoskin.last.image],
    limit: window.tomoskin.scene.limit,
    places: centroids.map(([x, y]) => window.tomoskin.sheetToClient(x, y)),
})"""


@pytest.fixture(scope="module")
def still():
    return prepare(
        Skin.load("textile-disc-8").altered({"signal": AS_TAKEN, "touch": {"method": "image"}})
    )


@pytest.fixture(scope="module")
def site(still):
    """A skin that conducts less at FALL and more at RISE, and stays so; touches are regions."""
    board = Board(free=samples_of(still), period=0.02)
    runner = Runner(still, lambda: board)
    runner.start()
    until = Watch(runner).until
    until(lambda: runner.newest and runner.newest.result.ready)
    less, more = pressed(still, *FALL, loss=0.4), pressed(still, *RISE, loss=-0.6)
    board.free = samples_of(still, less * more / still.skin.conductivity)
    until(lambda: runner.newest.result.touches)
    board.period = 0.3  # nothing moves, and drawing it costs time
    site = Site(runner)
    yield site
    site.stop()
    runner.stop()


def pixels(page):
    """(h, w, 3) levels of a screenshot, a pixel a CSS pixel."""
    return np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")).astype(int)


@pytest.mark.parametrize(("scheme", "scale"), [("light", CHANGE), ("dark", CHANGE_ON_DARK)])
def test_each_cell_has_the_colour_of_its_value(opened, prepared, scheme, scale):
    """Marks of the touch cover some cells; all others are as the library would draw them."""
    page = opened.page
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    opened.until("last.touches.length > 0")
    page.keyboard.press("f")  # cell by cell
    page.evaluate(DRAWN)
    shown = page.evaluate(SHOWN, prepared.mesh.centroids.tolist())
    x, y = np.array([[place["x"], place["y"]] for place in shown["places"]]).astype(int).T
    drawn = pixels(page)[y, x]
    part = np.clip(np.array(shown["image"]) / shown["limit"], -1, 1)
    expected = scale.table[np.round((part + 1) / 2 * (len(scale.table) - 1)).astype(int)]
    near = np.abs(drawn - expected).max(axis=1) <= 4
    strong = np.abs(part) > 0.3
    assert (strong & (part < 0)).sum() > 10
    assert (strong & (part > 0)).sum() > 10
    assert near.mean() > 0.9
    assert near[strong].mean() > 0.7
    red, _, blue = drawn.T
    for place, by in ((FALL, blue - red), (RISE, red - blue)):
        inside = np.hypot(*(prepared.mesh.centroids - place).T) < 0.015
        assert np.median(by[inside]) > 60


@pytest.mark.parametrize(("scheme", "scale"), [("light", CHANGE), ("dark", CHANGE_ON_DARK)])
def test_the_legend_has_the_rise_on_top(opened, scheme, scale):
    page = opened.page
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    page.evaluate(DRAWN)
    box = page.locator(".legend .strip").bounding_box()
    column = pixels(page)[:, round(box["x"] + box["width"] / 2)]
    low, high = round(box["y"] + box["height"]) - 3, round(box["y"]) + 2
    middle = round(box["y"] + box["height"] / 2)
    for row, end in ((high, -1), (middle, len(scale.table) // 2), (low, 0)):
        assert column[row] == pytest.approx(scale.table[end], abs=8)
