"""A server whose skin has one touch that never moves: for tests of looks and of the typeface."""

from __future__ import annotations

from contextlib import contextmanager

import pytest

from run.board import AS_TAKEN, Board, pressed, samples_of
from run.test_runner import Watch
from server.serving import Site
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner
from tomoskin.server import serve_requests

PANELS = {
    "now": "[data-testid=touch-row]",
    "setup": "[data-testid=board]",
    "sessions": "[data-testid=drawer-sessions] .flow",
    "twin": "[data-testid=lay-flat]",
    "signals": "[data-testid=signals-sum]",
    "signals unresolved": "dl[data-testid=signals-sum]",
    "settings": "[data-testid=set-alpha]",
}
"""Each drawer, and what of it is chosen, with what stands in it once it has something to say."""


class Bench(Board):
    """A board that can be bent and broken as far as a page can see, and always reads the same."""

    def set_faults(self, faults):
        """It stays as it is."""

    def set_noise(self, noise):
        """It has none."""

    def set_pose(self, pose):
        """It stays as it is."""


def serve_page(hub):
    hub.opener = lambda skin: Bench(free=samples_of(prepare(skin)))
    serve_requests(hub, "twin")


@contextmanager
def still_site(folder):
    """Its session files in ``folder``; no serial port is connected."""
    still = prepare(Skin.load("textile-disc-8").altered({"signal": AS_TAKEN}))
    board = Bench(free=samples_of(still), period=0.02)
    runner = Runner(still, lambda: board)
    runner.start()
    until = Watch(runner).until
    until(lambda: runner.newest and runner.newest.result.ready)
    board.free = samples_of(still, pressed(still, 0.03, 0.02))
    until(lambda: runner.newest.result.touches)
    board.period = 0.3  # nothing moves, and drawing it costs time
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tomoskin.server.source_handlers.list_ports", lambda: ())
        site = Site(runner, folder=folder, take=serve_page)
        yield site
        site.stop()
    runner.stop()


def show(opened, panel):
    """Open a panel, and wait until it says something."""
    if panel != "now":
        drawer, _, tab = panel.partition(" ")
        if opened.test_id(f"drawer-{drawer}").count() == 0:
            opened.test_id(f"open-{drawer}").click()
        if tab:
            opened.test_id(f"{drawer}-{tab}").click()
    opened.page.locator(PANELS[panel]).first.wait_for()
    opened.page.mouse.move(1, 1)
