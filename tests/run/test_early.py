"""Touches that a run tells of before their scan ends, and a recording that holds whole frames."""

from __future__ import annotations

import threading
from functools import partial
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest

from tomoskin.board.source import open_source
from tomoskin.files.session import SessionReader, replayed
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.run import Runner, commands
from tomoskin.twin import Press

PATIENCE = 300
PRESS = Press(0.02, 0.01, 3.0, 0.006)


@pytest.fixture(scope="module")
def skin():
    return Skin.load("textile-disc-8")


@pytest.fixture(scope="module")
def results(skin, tmp_path_factory):
    """All results of a run that is pressed and released, and its recording."""
    path = tmp_path_factory.mktemp("early") / "early.mcap"
    opener = partial(open_source, "twin:seed=3", skin)
    runner, every, news = Runner(prepare(skin), opener, early=True), [], threading.Condition()

    def take(result):
        with news:
            every.append(result)
            news.notify_all()

    def until(true):
        with news:
            assert news.wait_for(lambda: every and true(every[-1]), PATIENCE)

    with runner.audience.subscribe("test", take):
        runner.start()
        runner.submit(commands.Record(path)).result(PATIENCE)
        until(lambda result: result.ready)
        settled = every[-1].sequence + 40  # the noise that drives need has been worked out
        until(lambda result: result.sequence > settled)
        runner.submit(commands.HoldPresses("test", (PRESS,)))
        until(lambda result: result.touches)
        pressed = every[-1].sequence + 4
        until(lambda result: result.touches and result.sequence > pressed)
        runner.submit(commands.HoldPresses("test", ()))
        until(lambda result: not result.touches)
        runner.stop()
    return every, path


def of_drive(result):
    """Whether it is what a drive told, which takes an eighth of a scan."""
    return result.scan_time < 0.02


def test_drives_tell_of_a_touch_between_frames(results):
    every, _ = results
    early = [result for result in every if of_drive(result)]
    assert any(result.touches for result in early)
    assert {t.id for result in early for t in result.touches} >= {
        t.id for result in every if not of_drive(result) for t in result.touches
    }


def test_where_a_touch_is_told_of_first_no_frame_has_it_yet(results):
    every, _ = results
    first = next(n for n, result in enumerate(every) if result.touches)
    assert of_drive(every[first])
    (touch,) = every[first].touches
    assert touch.detection.sd_x > 3e-3  # a drive or two do not say more


def test_the_recording_holds_the_frames_alone(results):
    every, path = results
    frames = {r.sequence: r for r in every if not of_drive(r)}
    with SessionReader(path) as session:
        again = {r.sequence: r for r in replayed(prepare(session.skin), session)}
    shared = frames.keys() & again.keys()
    assert len(shared) > 40
    for number in shared:  # but where a touch begins or ends, of which drives have told before
        mine = {t.id: t for t in frames[number].touches if not t.provisional}
        recorded = {t.id: t for t in again[number].touches}
        assert mine.keys() <= recorded.keys()
        for key, touch in mine.items():
            assert touch.detection.x == recorded[key].detection.x
    assert sum(len(again[n].touches) != len(frames[n].touches) for n in shared) <= 6


def test_no_touch_is_told_of_that_has_just_been_lifted_or_hidden_while_it_is_new(results):
    every, _ = results
    there = [bool(result.touches) for result in every]
    assert sum(one != other for one, other in pairwise(there)) == 2


def test_a_drive_that_fails_is_counted_and_frames_go_on(skin, monkeypatch):
    monkeypatch.setattr(Pipeline, "push_drive", Mock(side_effect=np.linalg.LinAlgError("singular")))
    opener, every = partial(open_source, "twin:seed=3", skin), []
    runner, enough = Runner(prepare(skin), opener, early=True), threading.Event()

    def take(result):
        every.append(result)
        if result.ready:
            enough.set()

    with runner.audience.subscribe("test", take):
        runner.start()
        assert enough.wait(PATIENCE)
        runner.submit(commands.HoldPresses("test", ())).result(PATIENCE)
        dropped, events = runner.status().dropped, runner.events.since(0)[1]
        runner.stop()
    assert dropped
    assert "a drive was left out: singular" in [event.text for event in events]
