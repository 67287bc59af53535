"""The dent of touches as the relief of the sheet: on the wire while a page asks; in Chromium."""

from __future__ import annotations

import struct
from functools import partial

import numpy as np
import pytest

from server.looks import look_in_both
from server.serving import Site
from server.test_amount_flow import PLACES, touch
from server.test_play import Page
from server.watching import Watched
from tomoskin.board.source import open_source
from tomoskin.learning import DEPTH, AmountModel, LabelledPresses
from tomoskin.pipeline import prepare
from tomoskin.run import Runner
from tomoskin.server import serve_requests

DEPTHS = 1e-4 * np.array([2, 8, 4, 6, 3, 9, 5, 7, 2.5, 4.5])


@pytest.fixture(scope="module")
def soft(prepared):
    """A skin on a layer, with depths that made-up presses teach."""
    prepared = prepare(prepared.skin.altered({"surface": {"layer": "3 mm"}}))
    presses = [
        touch(k, 1e4 * depth, *place).detection
        for k, (depth, place) in enumerate(zip(DEPTHS, PLACES, strict=False))
    ]
    number = np.arange(len(presses))
    labelled = LabelledPresses.of(presses, DEPTHS, number, number.astype(float), "depth")
    model = AmountModel.fit(labelled, prepared.skin)
    return prepared.calibrated(DEPTH.of(model, prepared.pattern, prepared.skin))


@pytest.fixture
def served():
    """Serve the twin of a prepared skin."""
    ending = []

    def serve(prepared):
        runner = Runner(prepared, lambda: open_source("twin:fast", prepared.skin))
        runner.start()

        def take(hub):
            hub.opener = partial(open_source, "twin:fast")
            serve_requests(hub, "twin")

        site = Site(runner, take=take)
        ending.extend([runner.stop, site.stop])
        return site

    yield serve
    for end in reversed(ending):
        end()


def n_dent(socket):
    """Nodes of the dent in the next frame with a touch."""
    while True:
        frame = socket.recv(timeout=300)
        if isinstance(frame, bytes) and struct.unpack_from("<H", frame, 24)[0]:
            return struct.unpack_from("<I", frame, 36)[0]


def test_a_frame_has_a_dent_while_a_page_asks(served, soft):
    press = {"x": 0.03, "y": 0.03, "force": 6.0, "radius": 0.01}
    with served(soft).connect() as socket:
        page = Page(socket)
        page.told("state", lambda m: m["reference"]["ready"])
        page.ask("presses", presses=[press])
        assert n_dent(socket) == 0
        page.ask("dent", on=True)
        assert page.told("dent")["problem"] == ""
        assert n_dent(socket) == len(soft.mesh.points)
        page.ask("dent", on=False)
        page.told("dent")
        while n_dent(socket):
            pass


@pytest.mark.parametrize("layer", ["", "3 mm"])
def test_why_there_is_no_relief_is_said(served, soft, prepared, layer):
    """Without a calibration of depth, and without a layer."""
    if layer:
        given = prepare(prepared.skin.altered({"surface": {"layer": layer}}))
    else:
        given = prepared.calibrated(soft.calibrations[DEPTH.name])
    with served(given).connect() as socket:
        page = Page(socket)
        page.ask("dent", on=True)
        problem = page.told("dent")["problem"]
    assert ("uncalibrated" if layer else 'add layer = "3 mm" to [surface]') in problem


@pytest.mark.page
@pytest.mark.usefixtures("built_page")
def test_dents_are_drawn_to_a_scale_that_is_said(browser, served, soft):
    opened = Watched(browser, served(soft), soft.mesh)
    opened.open()
    opened.press(0.03, 0.03)
    assert opened.page.evaluate("window.tomoskin.last.dent") is None
    opened.page.keyboard.press("z")
    opened.until("last.dent")
    assert opened.test_id("do-space").get_attribute("aria-pressed") == "true"
    opened.test_id("relief").filter(has_text="mm deep, drawn ×20").wait_for()
    opened.test_id("deep").filter(has_text="mm deep").wait_for()
    assert look_in_both(opened.page, "relief") == {}
    opened.page.keyboard.press("z")
    opened.test_id("relief").filter(has_text="true to scale").wait_for()
    opened.page.keyboard.press("z")
    opened.test_id("relief").wait_for(state="detached")
    opened.page.mouse.up()
    opened.context.close()
    assert opened.wrong == []
