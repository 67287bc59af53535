"""End to end: a press on the sheet before the emulated converter, a touch where it was."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

import pytest

from firmware.boards import PATIENCE
from tomoskin.core import Touch
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, prepare
from tomoskin.run import Runner, commands
from tomoskin.twin import Press
from tomoskin_emulator.program import Programs
from tomoskin_emulator.source import open_emulator

MOST_FRAMES = 400
FORCE, RADIUS = 8.0, 0.01

# Skin, place of the press in m, how far the touch may be off in m: the discs are 200 mm across.
PLACES = [
    ("textile-disc-8", (0.03, 0.02), 0.012),
    ("textile-disc-16", (0.02, -0.05), 0.008),
]


@pytest.mark.parametrize(("name", "place", "most"), PLACES)
def test_a_press_is_found_where_it_is(
    programs: Programs,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    place: tuple[float, float],
    most: float,
) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: programs)
    skin = Skin.load(name)
    runner, came = Runner(prepare(skin), lambda: open_emulator("seed=1", skin)), threading.Event()
    with runner.audience.watch(came.set):
        runner.start()
        try:
            before = _wait(runner, came, lambda result: result.ready)
            assert before.touches == ()
            runner.ask(commands.HoldPresses(object(), (Press(*place, FORCE, RADIUS),)))
            _wait(runner, came, lambda result: len(result.touches) == 1)
            touch = _after(runner, came, 15)
        finally:
            runner.stop()
    reading = touch.detection
    assert math.hypot(reading.x - place[0], reading.y - place[1]) < most


def _wait(
    runner: Runner, came: threading.Event, enough: Callable[[FrameResult], bool]
) -> FrameResult:
    """The first result that is ``enough``."""
    for _ in range(MOST_FRAMES):
        assert came.wait(PATIENCE), runner.status().problem
        came.clear()
        if runner.newest is not None and enough(runner.newest.result):
            return runner.newest.result
    raise AssertionError(f"not within {MOST_FRAMES} frames: {runner.status()}")


def _after(runner: Runner, came: threading.Event, frames: int) -> Touch:
    """The only touch, that many frames later: the picture has settled."""
    for _ in range(frames):
        came.clear()
        assert came.wait(PATIENCE)
    assert runner.newest is not None
    (touch,) = runner.newest.result.touches
    return touch
