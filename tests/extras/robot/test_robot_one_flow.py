"""One skin of a robot's recording: its touches are the same by every way."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.conftest import tomoskin
from cli.test_one_flow import fitted, test_all_ways_are_the_same
from extras.robot.test_robot_run import Watch, grown, member, running
from run.board import Board, samples_of
from tomoskin.files.session import split
from tomoskin.pipeline import Prepared

__all__ = ["fitted", "test_all_ways_are_the_same", "tomoskin"]


@pytest.fixture(scope="module")
def session(tmp_path_factory, fitted: Prepared) -> Path:
    """The recording of one of two skins."""
    path = Path(tmp_path_factory.mktemp("flow") / "robot.mcap")
    boards = {name: Board(samples_of(fitted)) for name in ("left", "right")}
    with running([member(fitted, name, board) for name, board in boards.items()]) as run:
        run.record(path)
        Watch(run).until(grown(run, boards))
        run.stop_recording()
    split(path)
    return path.with_name(f"{path.stem}-right.mcap")
