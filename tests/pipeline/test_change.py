"""Another skin or source while the runner runs."""

from __future__ import annotations

import pytest

from run.board import Board, samples_of
from run.test_runner import Watch
from tomoskin.core import SourceError
from tomoskin.files.session import session_info
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner, commands


@pytest.fixture(scope="module")
def other():
    return prepare(Skin.load("textile-square-16"))


def refuse():
    raise SourceError("no such port", where="serial:none")


def test_another_skin_and_source(runner, board, other, tmp_path):
    until = Watch(runner).until
    runner.ask(commands.Record(tmp_path / "first.mcap"))
    runner.start()
    until(lambda: runner.newest and runner.newest.result.ready)
    second = Board(free=samples_of(other))
    runner.ask(commands.Change(other, lambda: second))
    assert board.closed
    assert runner.prepared is other
    assert runner.status().source == f"board on the table of {other.skin.name}"
    assert runner.status().recording is None
    assert session_info(tmp_path / "first.mcap").frames > 0
    until(lambda: runner.newest and runner.newest.result.ready)
    assert runner.newest.result.image.mesh_id == other.mesh.identity


def test_what_cannot_be_opened_leaves_the_old_one(prepared, idle, other):
    boards = iter([Board(free=idle), Board(free=idle)])
    runner = Runner(prepared, lambda: next(boards))
    until = Watch(runner).until
    runner.start()
    until(lambda: runner.newest and runner.newest.result.ready)
    with pytest.raises(SourceError, match="no such port"):
        runner.ask(commands.Change(other, refuse))
    before = runner.newest
    until(lambda: runner.newest is not before)
    assert runner.prepared is prepared
    assert runner.status().reference.ready
    runner.stop()


def test_a_lost_source_is_left_for_another(prepared, idle):
    lost, found = Board(free=idle), Board(free=idle)
    tried = iter([lost])

    def open_first():
        board = next(tried, None)
        if board is None:
            raise SourceError("gone")
        return board

    runner = Runner(prepared, open_first)
    until = Watch(runner).until
    runner.start()
    until(lambda: runner.newest)
    lost.lose()
    runner.ask(commands.Change(prepared, lambda: found))
    until(lambda: runner.newest and runner.newest.result.ready)
    assert runner.status().problem is None
    runner.stop()


def test_nothing_is_changed_in_what_does_not_run(runner, prepared, board):
    with pytest.raises(SourceError, match="the run has ended"):
        runner.ask(commands.Change(prepared, lambda: board))
