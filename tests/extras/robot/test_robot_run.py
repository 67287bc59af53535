"""Several skins in one program: none disturbs another, and one file holds them all."""

from __future__ import annotations

import threading
import time
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest
from mcap.reader import make_reader

from run.board import Board, samples_of
from tomoskin.board.wire import Ping
from tomoskin.core import DataError, OutputError, SourceError
from tomoskin.extras.robot import Member, PlaceOnRobot, RobotRun
from tomoskin.extras.robot.robot_run import board_problems
from tomoskin.files.session import SessionReader, repair, split, split_targets
from tomoskin.model.mesh import Pose
from tomoskin.run.intake import MOST_AT_ONCE
from tomoskin.run.publisher import Turns
from tomoskin.run.sinks import Contacts, Sink

PATIENCE = 300


class Kept(Sink):
    """Keeps whether touches were valid, and what was wrong."""

    name = "kept"

    def __init__(self):
        self.said, self.lost = [], threading.Event()

    def publish(self, item):
        if isinstance(item, Contacts):
            self.said.append((item.valid, item.problem))
            self.lost.set()


class Watch:
    """Waits for results of any skin."""

    def __init__(self, run):
        self._run, self._news = run, threading.Condition()

    def __call__(self):
        with self._news:
            self._news.notify_all()

    def until(self, true):
        with ExitStack() as stack, self._news:
            for runner in self._run.runners.values():
                stack.enter_context(runner.audience.watch(self))
            assert self._news.wait_for(true, PATIENCE)


@pytest.fixture
def boards(prepared):
    return {name: Board(samples_of(prepared)) for name in ("left", "right", "hand")}


@contextmanager
def running(members):
    run = RobotRun(members)
    try:
        run.start()
        yield run
    finally:
        run.stop()


def member(prepared, name, board, **more):
    return Member(PlaceOnRobot(name), prepared, board.open, **more)


def frames_of(run):
    return {name: runner.status().frames for name, runner in run.runners.items()}


def grown(run, names, by=40):
    """Whether so many frames more have come of each of these skins: a condition."""
    before = frames_of(run)
    return lambda: all(frames_of(run)[name] > before[name] + by for name in names)


def test_all_run_and_each_says_who_it_is(prepared, boards):
    pose = Pose.of((0, 0, 0.1), (0, 0, 0))
    members = [
        Member(PlaceOnRobot(n, f"{n}_link", pose), prepared, b.open) for n, b in boards.items()
    ]
    with running(members) as run:
        Watch(run).until(grown(run, boards))
        told = {c.skin: c.frame_id for c in (skin.latest() for skin in run.skins.values())}
    assert told == {"left": "left_link", "right": "right_link", "hand": "hand_link"}


def test_a_missing_board_and_a_lost_one_disturb_no_other(prepared, boards):
    boards["left"].lost = True
    members = [member(prepared, name, board) for name, board in boards.items()]
    with running(members) as run:
        watch = Watch(run)
        watch.until(grown(run, ["right", "hand"]))
        assert frames_of(run)["left"] == 0
        watch.until(lambda: "the port is gone" in run.statuses()["left"].problem)
        boards["hand"].lose()
        watch.until(grown(run, ["right"]))
        assert run.runners["right"].status().dropped == 0
        watch.until(lambda: run.statuses()["hand"].problem)  # the loss, or that none answers
        assert any("disconnected" in e.text for e in run.runners["hand"].events.since(0)[1])
        boards["left"].lost = boards["hand"].lost = False  # plugged in again
        watch.until(grown(run, ["left", "right", "hand"]))
        watch.until(lambda: run.runners["hand"].status().running)
        assert run.statuses()["hand"].problem is None


def test_a_board_that_was_missing_from_the_start_is_told_to_its_sinks(prepared, boards):
    boards["left"].lost = True
    sink = Kept()
    left = member(prepared, "left", boards["left"], sinks=[sink])
    with running([left, member(prepared, "right", boards["right"])]) as run:
        assert sink.lost.wait(PATIENCE)
        Watch(run).until(lambda: "the port is gone" in run.skins["left"].latest().problem)
        assert not run.statuses()["left"].running
        boards["left"].lost = False
        Watch(run).until(grown(run, ["left"]))
        assert len(run.runners["left"].status().sinks) == 1
    assert sink.said[0][0] is False
    assert any("the port is gone" in why for _, why in sink.said if why)
    assert sink.said[-1] == (True, None)


def test_without_any_board_it_says_so(prepared, boards):
    for board in boards.values():
        board.lost = True
    with pytest.raises(SourceError, match="the port is gone"):
        RobotRun([member(prepared, n, b) for n, b in boards.items()]).start()


def test_boards_of_one_number_are_said(prepared, boards):
    found = {"left": "0a", "right": "0a", "hand": "00"}
    wrong = board_problems(found, {"hand": "0b"})
    assert "same id as that of right" in wrong["left"]
    assert "expected 0b" in wrong["hand"]
    assert board_problems({"left": "00", "right": "00"}, {}) == {}  # boards without a number
    members = [Member(PlaceOnRobot(n), prepared, b.open, board="0102") for n, b in boards.items()]
    with running(members) as run:
        Watch(run).until(lambda: "expected 0102" in (run.statuses()["left"].problem or ""))


def test_a_clock_that_is_set_is_said_and_nothing_stops(prepared, boards, monkeypatch):
    members = [member(prepared, "left", boards["left"])]
    with running(members) as run:
        monkeypatch.setattr("tomoskin.extras.robot.robot_run.epoch", lambda: 5e9)
        events = run.runners["left"].events
        Watch(run).until(lambda: any(e.kind == "clock-step" for e in events.since(0)[1]))


def test_a_board_whose_ticks_jump_goes_on(prepared, boards):
    board = boards["left"]
    with running([member(prepared, "left", board)]) as run:
        watch = Watch(run)
        watch.until(grown(run, ["left"]))
        for tick in (2**40, 160_000, 1):
            board.tick = tick  # the next frame is at number * tick: hours ahead, then back
            watch.until(grown(run, ["left"], by=5))
        newest = run.runners["left"].newest.result
        assert newest.ready
        assert newest.touches == ()


def test_one_file_holds_all_and_is_split(prepared, boards, tmp_path, tomoskin):
    path = tmp_path / "robot.mcap"
    seen = {name: [] for name in boards}
    members = [member(prepared, name, board) for name, board in boards.items()]
    with running(members) as run:
        run.record(path)
        Watch(run).until(grown(run, boards))
        assert run.recording == path
        run.stop_recording()
        assert run.recording is None
        with pytest.raises(OutputError):
            run.record(path)
    assert tuple(split_targets(path)) == ("left", "right", "hand")
    with pytest.raises(DataError, match="several skins: left right hand"):
        SessionReader(path)
    with pytest.raises(DataError, match="several skins"):
        repair(path, tmp_path / "mended.mcap")
    code, _, err = tomoskin("session", "export", path, tmp_path / "x.csv")
    assert code == 2
    assert "--skin" in err
    assert "left, right, hand" in " ".join(err.split())
    counts = split(path)
    for name in boards:
        with SessionReader(tmp_path / f"robot-{name}.mcap") as session:
            assert session.skin.identity == prepared.skin.identity
            seen[name] = [item.frame.sequence for item in session.frames()]
            assert session.device()["channels"] == 16
            assert not session.torn
        assert len(seen[name]) > 40
        assert np.all(np.diff(seen[name][25:]) == 1)  # nothing is lost
        with (tmp_path / f"robot-{name}.mcap").open("rb") as part:
            summary = make_reader(part).get_summary()
        assert counts[name] == summary.statistics.message_count > len(seen[name])
    with pytest.raises(OutputError):
        split(path)


def test_turns_are_taken_in_order_and_who_waits_does_something_else():
    turns, taken, asked = Turns(), [], threading.Semaphore(0)

    def take(name):
        with turns.turn(asked.release):
            taken.append(name)

    with turns.turn(asked.release):
        threads = []
        for name in "abc":
            thread = threading.Thread(target=take, args=name)
            thread.start()
            threads.append(thread)
            while len(turns._waiting) < len(threads):
                pass
        assert all(asked.acquire(timeout=PATIENCE) for _ in range(6))
        assert taken == []
    for thread in threads:
        thread.join(PATIENCE)
    assert taken == ["a", "b", "c"]


def test_who_waited_for_a_turn_computes_what_has_come_since(prepared, boards):
    members = [member(prepared, name, boards[name]) for name in ("left", "hand")]
    with running(members) as run, ExitStack() as calls:
        watch, hand, results = Watch(run), run.runners["hand"], []
        watch.until(grown(run, ["left", "hand"]))
        for _ in range(MOST_AT_ONCE):  # a host that stays behind computes the newest frame alone
            hand.flow.intake.backlog.late(2 * MOST_AT_ONCE, waited=1.0)
        turns = hand.audience.turns
        with turns.turn(lambda: None):
            while len(turns._waiting) < 2:
                pass
            before = hand.newest.result.sequence
            for _ in range(5):
                boards["hand"].send(boards["hand"].free)
            skipped = hand.status().dropped
            calls.enter_context(hand.audience.subscribe("results", results.append))
        watch.until(lambda: results)
        assert results[0].sequence >= before + 6
        watch.until(lambda: hand.status().dropped >= skipped + 5)


def test_a_source_that_is_lost_while_it_waits_loses_nothing_that_was_read(prepared, boards):
    members = [member(prepared, name, boards[name]) for name in ("left", "hand")]
    with running(members) as run:
        watch, left = Watch(run), run.runners["left"]
        watch.until(grown(run, ["left", "hand"]))
        turns = left.audience.turns
        with turns.turn(lambda: None):
            while len(turns._waiting) < 2:
                pass
            before = left.newest.result.sequence
            boards["left"].lose()
        watch.until(lambda: left.status().problem)
        assert left.newest.result.sequence == before + 1


def test_a_board_hears_its_host_while_another_skin_computes_for_long(prepared, boards):
    members = [member(prepared, name, board) for name, board in boards.items()]
    with running(members) as run:
        Watch(run).until(grown(run, boards))
        turns = run.runners["left"].audience.turns
        with turns.turn(lambda: None):
            before = len(boards["hand"].commands)
            end = time.monotonic() + PATIENCE
            while sum(isinstance(c, Ping) for c in boards["hand"].commands[before:]) < 3:
                assert time.monotonic() < end
                time.sleep(0.02)
