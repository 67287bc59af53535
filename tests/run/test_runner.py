"""The thread between source and pages: newest result, losses, clean ends."""

import errno
import gc
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from run.board import Board
from tomoskin.board.source import Timing
from tomoskin.board.wire import FrameFlag, Ping, Start, Stop
from tomoskin.core import DataError, SourceError
from tomoskin.files.session import RawRead, session_info
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES, Pipeline
from tomoskin.run import Runner, commands
from tomoskin.run.intake import MOST_AT_ONCE
from tomoskin.run.publisher import EventLog
from tomoskin.run.recordings import Recordings
from tomoskin.twin import Press

PATIENCE = 300


class Watch:
    """Waits for results, woken by the runner itself."""

    def __init__(self, runner):
        self._runner = runner
        self._news = threading.Condition()

    def __call__(self):
        with self._news:
            self._news.notify_all()

    def until(self, true):
        with self._runner.audience.watch(self), self._news:
            assert self._news.wait_for(true, PATIENCE)


@pytest.fixture
def until(runner):
    return Watch(runner).until


def test_results_come_and_the_reference_stands(runner, until):
    runner.start()
    until(lambda: runner.newest and runner.newest.result.ready)
    status = runner.status()
    assert status.running
    assert status.problem is None
    assert status.reference.ready
    assert status.frames >= REFERENCE_FRAMES
    assert 0 < status.p50 <= status.p99
    assert status.source == "board on the table of textile-disc-8"


def test_a_source_that_cannot_be_opened_is_said_at_once(prepared):
    def refuse():
        raise SourceError("no such port", where="serial:/dev/none")

    with pytest.raises(SourceError, match="no such port"):
        Runner(prepared, refuse).start()


def test_stop_stops_the_board_and_closes_it(runner, board, until):
    runner.start()
    until(lambda: runner.newest)
    runner.stop()
    assert isinstance(board.commands[-1], Stop)
    assert board.closed
    runner.stop()


def test_stop_before_start_does_nothing(runner):
    runner.stop()


def test_a_lost_source_is_said_and_opened_again(prepared, idle):
    boards = [Board(free=idle), SourceError("still away"), Board(free=idle)]
    left = iter(boards)

    def reopen():
        found = next(left)
        if isinstance(found, SourceError):
            raise found
        return found

    runner = Runner(prepared, reopen)
    until = Watch(runner).until
    runner.start()
    until(lambda: runner.newest and runner.newest.result.ready)
    before = runner.newest
    boards[0].lose()
    until(lambda: runner.newest is not before and boards[2].scanning.is_set())
    until(lambda: runner.newest.result.host_time > before.result.host_time)
    runner.stop()
    kinds = [event.kind for event in runner.events.since(0)[1]]
    assert kinds.count("connected") == 2
    assert kinds.count("source-lost") == 1
    assert runner.newest.result.ready
    assert boards[0].closed


def test_while_the_source_is_away_it_is_the_problem(runner, board, until):
    runner.start()
    until(lambda: runner.newest)
    board.lose()
    for _ in range(2):  # what the first try said is known when the second begins
        assert board.sought.acquire(timeout=PATIENCE)
    status = runner.status()
    assert not status.running
    assert "the port is gone" in status.problem


def test_pause_and_reference(runner, until):
    runner.start()
    until(lambda: runner.newest and runner.newest.result.ready)
    first = runner.status().reference.since
    runner.ask(commands.TakeReference())
    until(lambda: runner.newest.result.ready and runner.status().reference.since != first)
    runner.ask(commands.SetPause(True))
    assert runner.status().paused
    assert not runner.contacts.valid
    assert "paused" in runner.contacts.problem
    assert [event.kind for event in runner.events.since(0)[1]].count("paused") == 1
    frames = runner.status().frames
    runner.ask(commands.SetPause(False))
    until(lambda: runner.status().frames > frames and runner.contacts.valid)


def test_presses_of_all_owners_reach_the_source(runner, board, until):
    one, two = Press(0, 0, 1, 0.01), Press(0.01, 0, 2, 0.01)
    runner.start()
    runner.ask(commands.HoldPresses("a", (one,)))
    runner.ask(commands.HoldPresses("b", (two,)))
    until(lambda: runner.newest and set(board.presses) == {one, two} == set(runner.newest.truth))
    runner.ask(commands.HoldPresses("a", ()))
    until(lambda: board.presses == (two,))
    runner.ask(commands.HoldPresses("b", ()))
    until(lambda: board.presses == () and runner.newest.truth == ())


def test_a_press_that_cannot_be_solved_is_refused_and_the_source_goes_on(runner, board, until):
    good, bad = Press(0, 0, 1, 0.01), Press(0.01, 0, 2, 0.01)
    take = board.set_presses

    def solve(presses):
        if bad in presses:
            raise ZeroDivisionError("float division by zero")
        take(presses)

    board.set_presses = solve
    runner.start()
    for _ in range(3):
        runner.ask(commands.HoldPresses("a", (bad, good)))
    until(lambda: runner.newest and runner.newest.truth == (good,) == board.presses)
    _, happened = runner.events.since(0)
    refused = [event.text for event in happened if event.kind == "press-refused"]
    assert refused == ["a press is left out: ZeroDivisionError: float division by zero"]
    assert not [event for event in happened if event.kind == "source-lost"]
    runner.ask(commands.HoldPresses("a", ()))
    until(lambda: board.presses == ())


class Silent(Board):
    """A port behind which nobody speaks, that knows why."""

    def __init__(self):
        super().__init__()
        self._out.clear()
        self.diagnosed = threading.Semaphore(0)

    def _answer(self, _command):
        return b""

    def diagnose(self, heard):
        assert heard == b""
        self.diagnosed.release()
        return SourceError("likely the wrong port", where="port", hint="try another")


def test_why_no_board_answers_is_said_once_and_stands_until_one_does(prepared, monkeypatch):
    monkeypatch.setattr(
        "tomoskin.board.source.link.Timing", lambda: Timing(0.01, 0.01, 1, goodbye=0.01)
    )
    board = Silent()
    runner = Runner(prepared, lambda: board)
    runner.start()
    for _ in range(3):
        assert board.diagnosed.acquire(timeout=PATIENCE)
    status = runner.status()
    _, happened = runner.events.since(0)
    runner.stop()
    assert not status.running
    assert status.problem == "port: likely the wrong port (try another)"
    assert [event.kind for event in happened] == ["no-answer"]


def test_losses_are_counted(prepared, idle):
    board = Board()
    runner = Runner(prepared, lambda: board)
    until = Watch(runner).until
    runner.start()
    assert board.scanning.wait(PATIENCE)
    board.raw(b"\x03abc\x00not a message\x00")
    board.send(idle)
    board.send(idle, skip=3, drops=2)
    board.send(idle, drops=2, flags=int(FrameFlag.LATE | FrameFlag.DEAF))
    until(lambda: runner.status().gaps == 3)
    until(lambda: runner.newest and runner.newest.result.sequence == 5)
    status = runner.status()
    runner.stop()
    assert status.corrupt == 2
    assert (status.late, status.deaf) == (1, 1)
    assert status.dropped == 2
    assert any("3 frames lost" in event.text for event in runner.events.since(0)[1])


def test_a_backlog_is_skipped_and_counted(prepared, idle):
    board = Board()
    runner = Runner(prepared, lambda: board)
    until = Watch(runner).until
    runner.start()
    assert board.scanning.wait(PATIENCE)
    with board._news:
        for _ in range(MOST_AT_ONCE + 10):
            board.send(idle)
    until(lambda: runner.newest and runner.newest.result.sequence == MOST_AT_ONCE + 9)
    assert runner.status().dropped == 10
    runner.stop()


def test_a_board_hears_its_host_between_frames_that_take_long(prepared, idle, monkeypatch):
    ahead, push = [0.0], Pipeline.push

    def slow(*given):
        ahead[0] += 0.3
        return push(*given)

    monkeypatch.setattr(Pipeline, "push", slow)
    board = Board()
    runner = Runner(prepared, lambda: board, clock=lambda: time.monotonic() + ahead[0])
    until = Watch(runner).until
    runner.start()
    assert board.scanning.wait(PATIENCE)
    with board._news:
        heard = len(board.commands)
        for _ in range(MOST_AT_ONCE):
            board.send(idle)
    until(lambda: runner.newest and runner.newest.result.sequence == MOST_AT_ONCE - 1)
    pings = [command for command in board.commands[heard:] if isinstance(command, Ping)]
    runner.stop()
    assert len(pings) >= MOST_AT_ONCE // 3


def test_a_fault_of_our_own_is_said(runner, until, monkeypatch, caplog):
    pushed = threading.Event()

    def broken(*_):
        pushed.set()
        raise ZeroDivisionError("oh")

    runner.start()
    until(lambda: runner.newest)
    monkeypatch.setattr(Pipeline, "push", broken)
    assert pushed.wait(PATIENCE)
    runner.stop()
    status = runner.status()
    assert not status.running
    assert "internal error" in status.problem
    assert "ZeroDivisionError" in caplog.text


def test_commands_start_with_a_handshake(runner, board, until):
    runner.start()
    until(lambda: runner.newest)
    assert any(isinstance(command, Start) for command in board.commands)


def test_the_event_log_is_bounded_and_numbered():
    log = EventLog(size=3)
    for n in range(5):
        log.add(n)
    assert log.since(0) == (5, (2, 3, 4))
    assert log.since(4) == (5, (4,))
    assert log.since(5) == (5, ())


class FullPath(type(Path())):
    """A path on a disk that is full after the file has been made."""

    def open(self, mode="r", buffering=-1, **_):
        file = super().open(mode, buffering)
        return NoRoom(file) if "x" in mode else file


class NoRoom:
    """A file with room for 20 kB."""

    def __init__(self, file):
        self._file = file

    def __getattr__(self, name):
        return getattr(self._file, name)

    def write(self, data):
        if self._file.tell() + len(data) > 20_000:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._file.write(data)


def test_a_full_disk_ends_the_recording_but_not_the_run(runner, until, tmp_path, monkeypatch):
    monkeypatch.setattr("tomoskin.files.session.session_writer.Path", FullPath)
    path = tmp_path / "x.mcap"
    runner.ask(commands.Record(path))
    assert runner.status().recording == path
    runner.start()
    until(lambda: runner.status().recording is None)
    before = runner.status().frames
    until(lambda: runner.status().frames > before + 20)
    status = runner.status()
    assert status.running
    assert status.problem is None
    events = {event.kind: event.text for event in runner.events.since(0)[1]}
    assert "No space left" in events["recording-stopped"]


def test_a_recording_can_be_ended_and_another_begun(runner, until, tmp_path):
    runner.start()
    until(lambda: runner.newest)
    runner.ask(commands.Record(tmp_path / "one.mcap"))
    until(lambda: runner.status().frames > 30)
    runner.ask(commands.Record(tmp_path / "two.mcap"))
    until(lambda: runner.status().frames > 60)
    runner.ask(commands.StopRecording())
    assert runner.status().recording is None
    for name in ("one.mcap", "two.mcap"):
        assert session_info(tmp_path / name).torn == ""
        assert session_info(tmp_path / name).frames > 0


def test_a_recording_that_cannot_begin_is_said(runner, tmp_path):
    with pytest.raises(DataError, match="cannot be"):
        runner.ask(commands.Record(tmp_path / "none" / "x.mcap"))


def test_a_recording_has_its_path_while_its_first_messages_are_made(prepared, tmp_path):
    """Another thread may ask for it at any moment, and takes None for the end."""
    path, paths = tmp_path / "x.mcap", []

    def numbered():
        paths.append(recordings.path)
        return 0

    recordings = Recordings(prepared, lambda *_: None, time.monotonic, numbered)
    recordings.begin(path).result(PATIENCE)
    recordings.put(RawRead(0.0, b""))
    recordings.end().result(PATIENCE)
    assert paths
    assert set(paths) == {path}
    assert recordings.path is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda idle: idle // 8, "check the skin, its current and its sheet resistance"),
        (lambda idle: np.roll(idle, len(idle) // 2 + 3), "check the skin and the order of"),
    ],
)
def test_a_reference_that_is_not_the_skins_is_said(prepared, idle, change, words):
    runner = Runner(prepared, Board(free=change(idle)).open)
    runner.start()
    Watch(runner).until(lambda: runner.newest and runner.newest.result.ready)
    assert words in runner.status().problem
    runner.stop()


def test_a_skin_that_saturates_is_said_before_its_electrodes_are_blamed(board):
    skin = Skin.load("textile-disc-8").altered(
        {"mesh": {"cells": 150}, "material": {"sheet_resistance": "800 ohm/sq"}}
    )
    runner = Runner(prepare(skin), lambda: board)
    runner.start()
    Watch(runner).until(lambda: runner.newest)
    assert " mA with a gain of 0.7" in runner.status().problem
    runner.stop()
    assert "saturated" in [event.kind for event in runner.events.since(0)[1]]


def test_python_holds_up_no_frame_for_long_while_a_run_lasts(runner, until):
    turn = sys.getswitchinterval()
    runner.start()
    until(lambda: runner.newest)
    assert gc.get_freeze_count() > 10_000  # what is there is not looked through while frames come
    assert sys.getswitchinterval() <= 1e-3 < turn
    runner.stop()
    assert gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == turn
