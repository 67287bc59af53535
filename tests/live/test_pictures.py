"""Each panel of the page as it was looked at and found good: light and dark, wide and upright.

``TOMOSKIN_RENEW=1 pytest tests/live/test_pictures.py`` writes down what the panels look like now,
and with ``TOMOSKIN_PICTURES=FOLDER`` the screenshots, to be looked at before they are committed.
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from live.board import AS_TAKEN, Board, pressed, samples_of
from live.pictures import CUT_OFF, SMALLEST, Look
from live.serving import Site
from live.test_runner import Watch
from tomoskin.live import Runner, SettingsDesk, TwinDesk, prepare, take_flows
from tomoskin.skin import Skin

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

KNOWN = Path(__file__).parent / "pictures.json"
RENEW = os.environ.get("TOMOSKIN_RENEW") == "1"
PICTURES = os.environ.get("TOMOSKIN_PICTURES")
TRIES = 30
"""Pictures of a page until it looks as known: plots and messages come when they come."""

PANELS = {
    "now": "[data-testid=touch-row]",
    "setup": "[data-testid=board]",
    "sessions": "[data-testid=drawer-sessions] .flow",
    "twin": "[data-testid=lay-flat]",
    "signals": "[data-testid=signals-sum]",
    "settings": "[data-testid=set-alpha]",
}
SIZES = ((1280, 720), (820, 1180))
DRAWN = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


class Bench(Board):
    """A board that can be bent and broken as far as a page can see, and always reads the same."""

    def set_faults(self, faults):
        """It stays as it is."""

    def set_noise(self, noise):
        """It has none."""

    def set_pose(self, pose):
        """It stays as it is."""


def take_desks(hub):
    hub.opener = lambda skin: Bench(free=samples_of(prepare(skin)))
    hub.take(SettingsDesk(hub))
    hub.take(TwinDesk(hub))
    take_flows(hub, "twin")


@pytest.fixture(scope="module")
def still():
    return prepare(Skin.load("textile-disc-8").altered({"signal": AS_TAKEN}))


@pytest.fixture(scope="module")
def site(still, tmp_path_factory):
    """A skin with one touch that never moves."""
    board = Bench(free=samples_of(still), period=0.02)
    runner = Runner(still, lambda: board)
    runner.start()
    until = Watch(runner).until
    until(lambda: runner.newest and runner.newest.result.ready)
    board.free = samples_of(still, pressed(still, 0.03, 0.02))
    until(lambda: runner.newest.result.touches)
    board.period = 0.3  # nothing moves, and drawing it costs time
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tomoskin.live.stage.list_ports", lambda: ())
        site = Site(runner, folder=tmp_path_factory.mktemp("empty"), take=take_desks)
        yield site
        site.stop()
    runner.stop()


@pytest.fixture(scope="module")
def known():
    return json.loads(KNOWN.read_text()) if KNOWN.is_file() else {}


def shown(opened, panel):
    """Open a panel, and wait until it says something."""
    if panel != "now":
        opened.test_id(f"open-{panel}").click()
    opened.page.locator(PANELS[panel]).first.wait_for()
    opened.page.mouse.move(1, 1)
    opened.page.evaluate(DRAWN)


def compared(opened, name, known):
    """Nothing where the page comes to look as known, else what differs to the end."""
    for _ in range(TRIES):
        look = Look.of(opened.page)
        words = look.differs(Look.read(known[name])) if name in known else "not known yet"
        if not words or RENEW:
            return words, look
        opened.page.evaluate(DRAWN)
    return words, look


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_panels_look_as_they_were_found_good(opened, known, size, scheme):
    page = opened.page
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    looks, wrong = {}, {}
    for panel in PANELS:
        shown(opened, panel)
        name = f"{panel}-{size[0]}-{scheme}"
        wrong[name], looks[name] = compared(opened, name, known)
        assert page.evaluate(CUT_OFF) == [], f"{name}: cut off"
        if PICTURES:
            page.screenshot(path=Path(PICTURES) / f"{name}.png")
    if RENEW:
        known |= {name: look.told() for name, look in looks.items()}
        lines = (f"{json.dumps(name)}: {json.dumps(known[name])}" for name in sorted(known))
        KNOWN.write_text("{\n" + ",\n".join(lines) + "\n}\n")
        return
    assert not any(wrong.values()), {name: words for name, words in wrong.items() if words}


def test_what_matters_is_large(opened):
    """In CSS pixels, for somebody two metres away: figures of touches, the state."""
    opened.test_id("touch-row").first.wait_for()
    assert opened.page.evaluate(SMALLEST, "[data-testid=touch-row] .large") >= 24
    assert opened.page.evaluate(SMALLEST, "[data-testid=state] strong, .facts dd") >= 18
    assert opened.page.evaluate(SMALLEST, "body :not(svg *)") >= 12


def test_another_look_is_told_apart(known):
    """The comparison itself: another panel, scheme or place, a touch that is not there."""
    looks = {name: Look.read(told) for name, told in known.items()}
    now = looks["now-1280-light"]
    assert now.differs(now) == ""
    for name, look in looks.items():
        assert [other for other in looks if not look.differs(looks[other])] == [name]
    moved = now.parts | {"sheet": [0.0, 0.1, *now.parts["sheet"][2:]]}
    assert "sheet stands at" in replace(now, parts=moved).differs(now)
    bare = now.colours.copy()
    touched = np.abs(bare.astype(int) - bare[0, 0]).max(axis=-1) > 30
    bare[touched] = bare[0, 0]
    assert "other colours" in replace(now, colours=bare).differs(now)
