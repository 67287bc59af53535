"""One prepared skin for all tests of the room, and a runner on a board of the test's own."""

from __future__ import annotations

import pytest

from live.board import Board, samples_of
from tomoskin.live import Runner, prepare
from tomoskin.skin import Skin


@pytest.fixture(scope="session")
def prepared():
    return prepare(Skin.load("textile-disc-8"))


@pytest.fixture(scope="session")
def idle(prepared):
    """Samples of the untouched skin."""
    return samples_of(prepared)


@pytest.fixture
def board(idle):
    return Board(free=idle)


@pytest.fixture
def runner(prepared, board):
    runner = Runner(prepared, lambda: board)
    yield runner
    runner.stop()
