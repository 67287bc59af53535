"""A skin that is rubbed on the page, in real Chromium."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from run.board import Board, pressed, samples_of
from server.looks import look_in_both
from server.serving import Site
from server.watching import Watched
from tomoskin.learning import TOUCH
from tomoskin.run import Runner
from tomoskin.server import serve_requests

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "learnt"


LAPS, REACH, STEP = 4.5, 0.085, 0.008
"""Of a spiral, m: so far out, and so far on in each frame, a third of a metre a second."""


def spiral():
    """x + iy m of a finger that rubs a disc."""
    n = round(np.pi * LAPS * REACH / STEP)
    part = np.sqrt(np.arange(1, n) / n)
    return REACH * part * np.exp(2j * np.pi * LAPS * part)


class RubbedBoard(Board):
    """Once it is ``rubbed`` a finger goes about on it, out to the rim and in again."""

    def __init__(self, prepared):
        super().__init__(free=samples_of(prepared), period=0.025)
        self.rubbed = False
        out = [samples_of(prepared, pressed(prepared, z.real, z.imag)) for z in spiral()]
        self._slides = itertools.cycle(out + out[::-1])

    def read(self, timeout):
        if self.rubbed:
            self.free = next(self._slides)
        return super().read(timeout)


@pytest.fixture
def rubbed(browser, prepared, folder):
    """(board, page) of a skin that waits to be rubbed."""
    folder.mkdir()
    board = RubbedBoard(prepared)
    runner = Runner(prepared, lambda: board)
    runner.start()
    site = Site(runner, folder=folder, take=lambda hub: serve_requests(hub, "twin"))
    watched = Watched(browser, site, prepared.mesh)
    watched.open()
    yield board, watched
    watched.context.close()
    site.stop()
    runner.stop()
    assert watched.wrong == []


def test_a_rubbed_skin_is_learnt_and_used(rubbed, folder):
    board, opened = rubbed
    opened.test_id("open-setup").click()
    opened.test_id("step-touch").click()
    opened.test_id("flow-begin-rub").click()
    opened.test_id("taken").filter(has_text="150 more to learn from").wait_for()
    assert opened.test_id("flow-learn").is_disabled()
    board.rubbed = True
    opened.page.wait_for_function(
        "() => !document.querySelector('[data-testid=flow-learn]').disabled"
    )
    opened.page.wait_for_function(  # the map goes on to fill while the rubbing goes on
        """() => {
            const all = [...document.querySelectorAll('[data-testid=covered] circle')];
            return all.filter(c => c.classList.contains('full')).length > 0.7 * all.length;
        }"""
    )
    opened.test_id("flow-learn").click()
    opened.test_id("flow-stop").click()
    opened.test_id("flow-learn").click()
    opened.test_id("flow-text").filter(has_text="uncertain by about").wait_for()
    assert look_in_both(opened.page, "rubbed") == {}
    opened.test_id("flow-keep").click()
    opened.test_id("calibration").filter(has_text="rubbed.npz").wait_for()
    opened.test_id("calibration-health").wait_for()
    assert len(TOUCH.read(folder / "rubbed.npz").model.presses) >= 150
