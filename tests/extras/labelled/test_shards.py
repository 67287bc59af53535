"""Sets of labelled frames: the same whoever makes them, and never a half shard."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import ScriptError, SourceError
from tomoskin.extras.labelled import (
    COMMON_PRESSES,
    Population,
    SetPlan,
    in_processes,
    in_this_process,
    make_set,
    on_cluster,
    population,
    shards as labelled,
)
from tomoskin.model.skin import Skin

SKIN = Skin.load("textile-disc-8").altered({"mesh": {"cells": 300}}).to_toml()
CROWD = Population.read(
    {"count": 8, "size": "10 mm", "force": "1 N", "apart": "100 mm"}, "[presses]"
)


def quiet(done: int, total: int) -> None:
    assert done <= total


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch) -> SetPlan:
    """Seven frames in three shards."""
    monkeypatch.setattr(population, "SHARD_FRAMES", 3)
    return SetPlan(SKIN, COMMON_PRESSES, "textile", 1, 7)


@pytest.fixture
def whole(plan: SetPlan, tmp_path: Path) -> list[bytes]:
    """Its files, made in one go."""
    return contents(make_set(plan, tmp_path / "whole", in_this_process, quiet).files)


@pytest.fixture
def scheduler() -> Iterator[str]:
    """Address of a cluster of one worker in this process."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        dashboard_address=None,
        protocol="tcp",
        host="127.0.0.1",
    ) as cluster:
        yield cluster.scheduler_address


def contents(files: tuple[Path, ...]) -> list[bytes]:
    return [file.read_bytes() for file in files]


def interrupted_at(frames: int) -> Callable[[int, int], None]:
    def advance(done: int, _: int) -> None:
        if done >= frames:
            signal.raise_signal(signal.SIGINT)

    return advance


def test_ctrl_c_leaves_whole_shards_and_the_same_command_goes_on(plan, whole, tmp_path):
    out = tmp_path / "set"
    with pytest.raises(KeyboardInterrupt):
        make_set(plan, out, in_this_process, interrupted_at(6))
    assert contents(tuple(sorted(out.iterdir()))) == whole[:2]
    made = make_set(plan, out, in_this_process, quiet)
    assert (made.kept, made.made) == (2, 1)
    assert contents(made.files) == whole


def test_ctrl_c_while_a_shard_is_written(plan, whole, tmp_path, monkeypatch):
    out, save = tmp_path / "set", np.savez_compressed

    def stopped(file, **arrays):
        save(file, **arrays)
        file.truncate(100)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(np, "savez_compressed", stopped)
    with pytest.raises(KeyboardInterrupt):
        make_set(plan, out, in_this_process, quiet)
    monkeypatch.setattr(np, "savez_compressed", save)
    assert not list(out.glob("part-*.npz"))
    assert contents(make_set(plan, out, in_this_process, quiet).files) == whole
    assert len(list(out.iterdir())) == 3


def test_one_file_that_was_interrupted_goes_on_too(plan, tmp_path):
    out, other = tmp_path / "set.npz", tmp_path / "other.npz"
    with pytest.raises(KeyboardInterrupt):
        make_set(plan, out, in_this_process, interrupted_at(3))
    assert not out.exists()
    made = make_set(plan, out, in_this_process, quiet)
    assert (made.kept, made.made) == (1, 2)
    make_set(plan, other, in_this_process, quiet)
    assert out.read_bytes() == other.read_bytes()
    assert sorted(tmp_path.iterdir()) == [other, out]


def test_a_cluster_makes_the_same_bytes(plan, whole, tmp_path, scheduler):
    seen = []
    made = make_set(plan, tmp_path / "set", on_cluster(scheduler), lambda *at: seen.append(at))
    assert contents(made.files) == whole
    assert seen[0] == (0, 7)
    assert seen[-1] == (7, 7)
    again = make_set(plan, tmp_path / "set", on_cluster(scheduler), quiet)
    assert (again.kept, again.made) == (3, 0)


def test_ctrl_c_before_a_cluster(plan, whole, tmp_path, scheduler):
    with pytest.raises(KeyboardInterrupt):
        make_set(plan, tmp_path / "set", on_cluster(scheduler), interrupted_at(1))
    made = make_set(plan, tmp_path / "set", on_cluster(scheduler), quiet)
    assert made.kept >= 1
    assert contents(made.files) == whole


def test_what_a_worker_of_a_cluster_cannot_do_is_said_here(scheduler, monkeypatch):
    monkeypatch.setattr(population, "_TRIES", 5)
    crowd = SetPlan(SKIN, CROWD, "textile", 1, 7)
    with pytest.raises(ScriptError, match="found no position 5 mm from the rim and 100 mm from"):
        list(on_cluster(scheduler)(crowd, [0]))


def test_what_a_process_cannot_do_is_said_here():
    crowd = SetPlan(SKIN, CROWD, "textile", 1, 7)
    with pytest.raises(ScriptError, match="found no position 5 mm from the rim and 100 mm from"):
        list(in_processes(1)(crowd, [0]))


def test_no_scheduler(plan, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(labelled, "_PATIENCE", 0.2)
    with pytest.raises(SourceError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers"):
        list(on_cluster("tcp://127.0.0.1:1")(plan, [0]))


def test_without_dask_it_says_what_to_install(plan, monkeypatch):
    monkeypatch.setitem(sys.modules, "dask", None)
    with pytest.raises(SourceError, match=r"-m pip install .*distributed"):
        list(on_cluster("tcp://127.0.0.1:1")(plan, [0]))
