"""A board that is started again comes back with its reference, or says why it does not."""

from __future__ import annotations

import numpy as np
import pytest

from run.board import Board, pressed, samples_of
from run.test_runner import PATIENCE, Watch
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import BoardMemory, Runner, commands

ENOUGH = 4 * REFERENCE_FRAMES
PLACE = (0.03, -0.02)


class Numbered(Board):
    """A board with a number, whose samples waver."""

    def __init__(self, free, number=b"board 07", seed=0):
        super().__init__(free)
        self.number, self._random = number, np.random.default_rng(seed)

    def send(self, samples, **more):
        noise = self._random.integers(-2, 3, len(samples))
        super().send((samples.astype(int) + noise).astype(np.uint16), **more)


def run_of(prepared, board, memory, *, frames=ENOUGH, record=None):
    """A run of so many frames: its events by kind, its last result, and the runner."""
    runner = Runner(prepared, board.open, memory=memory)
    if record is not None:
        runner.ask(commands.Record(record))
    runner.start()
    try:
        Watch(runner).until(lambda: runner.status().frames >= frames)
        newest = runner.newest.result
        status = runner.status()
    finally:
        runner.stop()
    return {event.kind: event.text for event in runner.events.since(0)[1]}, newest, status


@pytest.fixture
def memory(tmp_path):
    return BoardMemory(tmp_path / "boards")


@pytest.fixture
def samples(prepared):
    return samples_of(prepared)


@pytest.fixture
def once(prepared, samples, memory):
    """The board has run once."""
    happened, _, _ = run_of(prepared, Numbered(samples), memory)
    assert "recalled" not in happened
    assert "not-kept" not in happened


def test_a_reference_comes_back(prepared, samples, memory, once):
    del once
    board = Numbered(samples, seed=1)
    happened, newest, status = run_of(prepared, board, memory, frames=REFERENCE_FRAMES - 5)
    assert "recalled" in happened
    assert newest.ready  # after fewer frames than a reference takes
    assert newest.touches == ()
    assert status.problem is None


def test_a_skin_that_is_touched_at_the_start_shows_its_touch(prepared, samples, memory, once):
    del once
    board = Numbered(samples_of(prepared, pressed(prepared, *PLACE)), seed=1)
    happened, newest, status = run_of(prepared, board, memory)
    assert "reference-renewed" not in happened
    (touch,) = newest.touches
    assert (touch.detection.x, touch.detection.y) == pytest.approx(PLACE, abs=0.02)
    assert "take a new reference" in status.problem
    again, _, _ = run_of(prepared, Numbered(samples, seed=2), memory)  # nothing of it was kept
    assert "reference-renewed" not in again


def test_a_skin_that_has_changed_gets_a_new_reference_and_it_is_said(prepared, memory, once):
    del once
    rng = np.random.default_rng(3)
    other = prepared.skin.conductivity * np.exp(0.4 * rng.standard_normal(len(prepared.mesh.cells)))
    other *= 1.6
    board = Numbered(samples_of(prepared, other), seed=1)
    happened, newest, _ = run_of(prepared, board, memory, frames=3 * ENOUGH)
    assert "reference-renewed" in happened
    assert newest.ready
    assert newest.touches == ()


def test_of_another_board_or_a_twin_nothing_is_known(prepared, samples, memory, once):
    del once
    for number in (b"board 08", bytes(8), b"twin\0\0\0\7"):
        for _ in range(2 if number != b"board 08" else 1):
            happened, _, _ = run_of(prepared, Numbered(samples, number), memory)
            assert "recalled" not in happened


def test_a_damaged_file_is_said_and_replaced(prepared, samples, memory, once):
    del once
    (path,) = memory.folder.iterdir()
    path.write_bytes(path.read_bytes()[:300])
    happened, newest, _ = run_of(prepared, Numbered(samples, seed=1), memory)
    assert "cannot be used" in happened["not-recalled"]
    assert newest.ready
    happened, _, _ = run_of(prepared, Numbered(samples, seed=2), memory)
    assert "recalled" in happened


def test_another_board_on_the_same_port_gets_its_own_reference(prepared, samples):
    board = Numbered(samples)
    runner = Runner(prepared, board.open)
    runner.start()
    try:
        watch = Watch(runner)
        watch.until(lambda: runner.status().frames >= ENOUGH)
        board.number = b"board 08"
        board.lose()
        assert board.sought.acquire(timeout=PATIENCE)
        board.lost = False
        watch.until(
            lambda: (
                any(e.kind == "other-board" for e in runner.events.since(0)[1])
                and runner.status().frames >= 2 * ENOUGH
            )
        )
    finally:
        runner.stop()


def test_a_replay_of_a_run_that_came_back_is_the_same_to_the_bit(prepared, memory, once, tmp_path):
    del once
    path = tmp_path / "run.mcap"
    board = Numbered(samples_of(prepared, pressed(prepared, *PLACE)), seed=1)
    _, newest, _ = run_of(prepared, board, memory, record=path)
    with SessionReader(path) as session:
        results = list(replayed(as_recorded(session), session))
    same = next(r for r in results if r.sequence == newest.sequence)
    assert same.ready
    assert np.array_equal(same.image.values, newest.image.values)
    assert [t.detection.x for t in same.touches] == [t.detection.x for t in newest.touches]
