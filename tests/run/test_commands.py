"""What a run is asked: by whom it is carried out, in what order, and who is told of an error."""

from __future__ import annotations

import threading

import pytest

from run.test_runner import PATIENCE, Watch
from tomoskin.core import DataError, SourceError, WireError
from tomoskin.run import SetPose, SetTwin, commands
from tomoskin.run.commands import RunCommands


class Taker:
    """Carries commands out, and notes which thread did."""

    def __init__(self):
        self.done = []

    def __call__(self, command):
        self.done.append((command, threading.current_thread()))
        if isinstance(command, Exception):
            raise command


@pytest.fixture
def taker():
    return Taker()


def test_while_no_thread_takes_them_who_asks_carries_them_out(taker):
    queue = RunCommands(taker)
    assert queue.put("one").done()
    queue.begin()
    later = queue.put("two")
    assert not later.done()
    queue.end()
    assert later.done()
    assert [command for command, _ in taker.done] == ["one", "two"]


def test_they_are_carried_out_in_order_by_the_thread_that_takes_them(taker):
    queue = RunCommands(taker)
    queue.begin()
    futures = [queue.put(number) for number in range(5)]
    thread = threading.Thread(target=queue.carry_out)
    thread.start()
    for future in futures:
        future.result(PATIENCE)
    assert taker.done == [(number, thread) for number in range(5)]


def test_an_error_is_for_who_asked_and_the_rest_goes_on(taker):
    queue = RunCommands(taker)
    queue.begin()
    bad, good = queue.put(DataError("no")), queue.put("yes")
    queue.carry_out()
    with pytest.raises(DataError, match="no"):
        bad.result(PATIENCE)
    assert good.result(PATIENCE) is None


def test_one_that_nobody_waits_for_any_more_is_left_out(taker):
    queue = RunCommands(taker)
    queue.begin()
    queue.put("gone").cancel()
    queue.carry_out()
    assert taker.done == []


def test_presses_do_not_put_off_the_next_attempt_to_open_a_lost_source(runner, board):
    """They come sixty times a second."""
    runner.start()
    Watch(runner).until(lambda: runner.newest)
    board.lose()
    while not board.sought.acquire(timeout=0.01):
        runner.submit(commands.HoldPresses("a", ()))


def test_what_is_asked_while_the_source_is_away_is_carried_out(runner, board):
    runner.start()
    Watch(runner).until(lambda: runner.newest)
    board.lose()
    assert board.sought.acquire(timeout=PATIENCE)
    runner.ask(commands.SetPause(True))
    assert runner.status().paused


def test_a_change_that_waits_gives_way_to_a_newer_one(runner, prepared, board):
    runner.start()
    gate, entered = threading.Event(), threading.Event()

    def slow():
        entered.set()
        assert gate.wait(PATIENCE)
        return board

    first = runner.submit(commands.Change(prepared, slow))
    assert entered.wait(PATIENCE)
    second, third = (runner.submit(commands.Change(prepared, lambda: board)) for _ in range(2))
    gate.set()
    first.result(PATIENCE)
    with pytest.raises(SourceError, match="replaced by a newer choice"):
        second.result(PATIENCE)
    third.result(PATIENCE)


def test_what_the_source_cannot_do_is_said(runner):
    runner.start()
    for command, words in (
        (commands.Seek(1.0), "is not a replay"),
        (SetTwin((), None), "cannot simulate faults"),
        (SetPose(), "cannot be bent"),
    ):
        with pytest.raises(WireError, match=words):
            runner.ask(command)
