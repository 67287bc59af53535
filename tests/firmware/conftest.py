from __future__ import annotations

import shutil

import pytest

from conftest import missing
from firmware.boards import built, running


def need(programs, packages):
    """Skip unless all programs are there; under CI=true fail."""
    absent = [program for program in programs if shutil.which(program) is None]
    if absent:
        advice = f"Debian: apt-get install {packages}"
        missing(f"the firmware: no {', '.join(absent)} ({advice})")


@pytest.fixture(scope="session")
def board_program():
    need(["make", "cc"], "make gcc libc6-dev")
    return built("host", "tomoskin-board")


@pytest.fixture
def board(board_program, tmp_path):
    with running(board_program, tmp_path / "port") as process:
        yield process
