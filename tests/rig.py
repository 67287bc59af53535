"""One prepared skin for all tests of the room, and a runner on a board of the test's own."""

from __future__ import annotations

import pytest
from playwright.sync_api import sync_playwright

from run.board import Board, samples_of
from server.watching import ARGUMENTS, Watched
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner


@pytest.fixture(scope="session")
def prepared():
    return prepare(Skin.load("textile-disc-8"))


@pytest.fixture(scope="session")
def idle(prepared):
    """Samples of the untouched skin."""
    return samples_of(prepared)


@pytest.fixture
def board(idle):
    return Board(free=idle)


@pytest.fixture
def runner(prepared, board):
    runner = Runner(prepared, board.open)
    yield runner
    runner.stop()


@pytest.fixture(scope="module")  # its event loop must not outlive it: others run their own
def browser(chromium):
    """One Chromium for all tests of a module."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def opened(browser, site, prepared):
    """A page of the module's ``site``, on which nothing may go wrong."""
    watched = Watched(browser, site, prepared.mesh)
    watched.open()
    yield watched
    watched.context.close()
    assert watched.wrong == []
