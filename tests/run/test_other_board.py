"""A board in the place of another is a skin of its own."""

from __future__ import annotations

from run.board import Board, samples_of
from run.test_runner import PATIENCE, Watch
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import Runner

ENOUGH = 4 * REFERENCE_FRAMES


def happened(runner: Runner, kind: str) -> bool:
    return any(event.kind == kind for event in runner.events.since(0)[1])


def change_boards(prepared, first: bytes, second: bytes) -> bool:
    """Whether it is said that another board answers, when a board is lost and ``second`` comes."""
    board = Board(samples_of(prepared))
    board.number = first
    runner = Runner(prepared, board.open)
    runner.start()
    try:
        watch = Watch(runner)
        watch.until(lambda: runner.status().frames >= ENOUGH)
        board.number = second
        board.lose()
        assert board.sought.acquire(timeout=PATIENCE)
        board.lost = False
        watch.until(lambda: runner.status().frames >= 2 * ENOUGH)
    finally:
        runner.stop()
    return happened(runner, "other-board")


def test_another_board_on_the_same_port_gets_its_own_reference(prepared):
    assert change_boards(prepared, b"board 07", b"board 08")


def test_the_same_board_that_comes_back_goes_on(prepared):
    assert not change_boards(prepared, b"board 07", b"board 07")
