"""Sets of labelled frames: the same whoever makes them, and never a half shard."""

from __future__ import annotations

import shutil
import signal
import subprocess
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
    fingerprint,
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


OLD = """
import sys, types
old = types.ModuleType("tomoskin")
old.__version__, old.__file__ = "0.0.9", __file__
sys.modules["tomoskin"] = old
"""


@pytest.fixture
def two_workers(tmp_path) -> Iterator[str]:
    """A scheduler with a worker of ours and one of a tomoskin 0.0.9, each a process."""
    distributed = pytest.importorskip("distributed")
    (tmp_path / "old.py").write_text(OLD)
    with distributed.LocalCluster(
        n_workers=0, processes=True, dashboard_address=None, protocol="tcp", host="127.0.0.1"
    ) as cluster:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address]
        command += ["--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", "--no-nanny"]
        workers = [
            subprocess.Popen([*command, *more], cwd=tmp_path, stderr=subprocess.DEVNULL)
            for more in ([], ["--preload", str(tmp_path / "old.py")])
        ]
        try:
            with distributed.Client(cluster) as client:
                client.wait_for_workers(2, timeout=60)
            yield cluster.scheduler_address
        finally:
            for worker in workers:
                worker.kill()
                worker.wait()


@pytest.mark.slow
def test_workers_of_another_version_are_refused(plan, two_workers):
    """Before any frame: a version whose numbers have other units would go unnoticed."""
    said = "got 1 others: tcp://127.0.0.1:[0-9]+ has tomoskin 0.0.9 instead of 0.1.0, code"
    with pytest.raises(SourceError, match=said):
        list(on_cluster(two_workers)(plan, [0]))


def test_other_code_of_the_same_version_is_refused(plan):
    ours = fingerprint.fingerprint()
    assert ours["code"] != "none"
    theirs = ours | {"code": "0" * 12, "numpy": "none"}
    told = fingerprint.differences(ours, theirs)
    assert (
        told
        == f"numpy none instead of {ours['numpy']}, code 000000000000 instead of {ours['code']}"
    )
    with pytest.raises(SourceError, match="got 1 others: a has numpy none"):
        labelled._check_workers({"a": theirs, "b": ours}, ours, "tcp://x")
    with pytest.raises(RuntimeError, match="instead of 000000000000"):
        fingerprint.made_alike(theirs, plan, 0)


def test_a_fingerprint_changes_with_the_code_that_computes(tmp_path, monkeypatch):
    import tomoskin

    before = fingerprint.fingerprint()["code"]
    root = tmp_path / "tomoskin"
    for room in fingerprint.ROOMS:
        shutil.copytree(Path(tomoskin.__file__).parent / room, root / room)
    (root / "cli").mkdir()
    monkeypatch.setattr(tomoskin, "__file__", str(root / "__init__.py"))
    (root / "cli" / "app.py").write_text("0")
    assert fingerprint.fingerprint()["code"] == before
    (root / "twin" / "material.py").write_text("0")
    assert fingerprint.fingerprint()["code"] != before


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
