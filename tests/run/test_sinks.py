"""Sinks beside a run: bad ones delay nothing, and everybody can see how they are."""

from __future__ import annotations

import threading
import time
from contextlib import closing
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from run.board import Board
from run.test_runner import PATIENCE, Watch
from server.serving import Site
from tomoskin.core import Event, SinkError
from tomoskin.files.messages import event_content, without_frame
from tomoskin.files.messages.reporter import WAITING
from tomoskin.files.session.replay import open_replay
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import Runner
from tomoskin.run.sinks import Contacts, Sink as Base

FRAMES = 3 * REFERENCE_FRAMES


class Sink(Base):
    """Keeps what it is given, and does to each what the test wants."""

    def __init__(self, name, does=lambda: None):
        self.name, self.does = name, does
        self.streams, self.items = [], []

    def open(self, stream):
        self.streams.append(stream)

    def publish(self, item):
        self.items.append(item)
        self.does()

    def close(self):
        pass


def fail():
    raise SinkError("the peer is gone")


@pytest.fixture
def gate():
    gate = threading.Event()
    yield gate
    gate.set()


@pytest.fixture
def sinks(gate):
    slow = threading.Semaphore(3)
    return {
        "good": Sink("good"),
        "dead": Sink("dead", fail),
        "hung": Sink("hung", lambda: gate.wait(PATIENCE)),
        "slow": Sink("slow", lambda: slow.acquire(timeout=PATIENCE)),
    }


@pytest.fixture
def runner(prepared, board, sinks, monkeypatch):
    monkeypatch.setattr("tomoskin.run.sinks.sink.GRACE", 0.1)
    runner = Runner(prepared, lambda: board, sinks=tuple(sinks.values()))
    yield runner
    runner.stop()


def test_bad_sinks_delay_nothing(runner, sinks):
    runner.start()
    Watch(runner).until(lambda: runner.status().frames >= FRAMES)
    assert runner.status().dropped == 0
    assert len(sinks["hung"].items) == 1
    runner.stop()
    told = [item for item in sinks["good"].items if isinstance(item, Contacts)]
    good = [item for item in told if item.sequence >= 0]
    assert [item.sequence for item in good] == list(range(runner.status().frames))
    assert good[-1].image is None or good[-1].valid
    assert [item.valid for item in good] == [
        number >= REFERENCE_FRAMES - 1 for number in range(len(good))
    ]
    kinds = [item.kind for item in sinks["good"].items if isinstance(item, Event)]
    assert {"connected", "sink-away"} <= set(kinds)
    (stream,) = sinks["good"].streams
    assert stream.source == "board on the table of textile-disc-8"


def test_how_they_are_is_said(runner, sinks, gate):
    runner.start()
    until = Watch(runner).until
    until(lambda: any(e.kind == "sink-away" for e in runner.events.since(0)[1]))
    until(lambda: len(sinks["good"].items) > 3)
    reports = {report.name: report for report in runner.status().sinks}
    assert reports["good"].well
    assert not reports["dead"].well
    assert reports["dead"].text.startswith("is not reachable: the peer is gone")
    site = Site(runner)
    try:
        with site.client() as client:
            told = client.get("/status").json()
        with site.client(entered=False) as stranger:
            assert stranger.get("/status").status_code == 403
    finally:
        site.stop()
    assert [sink["name"] for sink in told["sinks"]] == list(sinks)
    assert told["sinks"][1]["text"].startswith("is not reachable")
    gate.set()


def test_a_replay_is_published_with_the_times_of_its_day():
    old = Path(__file__).parents[1] / "files" / "session" / "of_0_1.mcap"
    skin, sink = Skin.load("textile-disc-8"), Sink("good")
    with closing(open_replay(f"{old}@max", skin)) as replay:
        runner = Runner(prepare(skin), lambda: replay, sinks=(sink,))
        runner.start()
        Watch(runner).until(lambda: sink.streams)
        runner.stop()
    (stream,) = sink.streams
    assert (stream.epoch, stream.replayed) == (1e9, True)
    event = Event(0.5, "connected", "board 01")
    frame = replace(without_frame(stream, "", 0.75), scanned=0.5)
    assert event_content(stream, event, frame)["utc_s"] == frame.utc == 1e9 + 0.5
    assert event_content(stream, event)["utc_s"] is None  # it is of today


def test_before_the_first_frame_every_sink_is_told_that_none_has_come(prepared):
    sink = Sink("good")
    runner = Runner(prepared, Board().open, sinks=(sink,))
    runner.start()
    begun = time.monotonic()
    while len(told := [item for item in sink.items if isinstance(item, Contacts)]) < 3:
        assert time.monotonic() - begun < PATIENCE
        time.sleep(0.1)
    runner.stop()
    assert told[0].host_time - begun < 0.5  # its board answers, and sends no frame
    assert {(c.valid, c.problem, c.touches) for c in told} == {(False, WAITING, ())}
    assert all(contacts.is_due and contacts.reports for contacts in told)
    assert min(b.host_time - a.host_time for a, b in pairwise(told)) > 0.5


def test_a_board_that_is_lost_is_said_on_every_sink(prepared, board):
    sink = Sink("good")
    runner = Runner(prepared, board.open, sinks=(sink,))
    runner.start()
    until = Watch(runner).until
    until(lambda: runner.status().reference.ready)
    board.lose()
    assert board.sought.acquire(timeout=PATIENCE)
    runner.stop()
    kinds = [item.kind if isinstance(item, Event) else item.valid for item in sink.items]
    lost = kinds.index("source-lost")
    frame, event, *after = sink.items[lost - 1 :]
    assert (frame.valid, event.kind) == (True, "source-lost")
    assert after  # said once, and again while the loss lasts
    for said in after:
        assert (said.valid, said.problem, said.touches) == (False, event.text, ())
        assert said.host_time >= frame.host_time
