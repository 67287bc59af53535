"""Arrays kept on disk: made once, and made again wherever the disk fails."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from tomoskin.core import Arrays, archive, kept, watch_stages


class Counted:
    """Makes an array, and counts how often."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> Arrays:
        self.times += 1
        return {"values": np.arange(3.0)}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(archive.VARIABLE, str(tmp_path / "new"))
    return tmp_path / "new"


def test_it_is_made_once(folder: Path) -> None:
    make = Counted()
    first, second = kept("a", make), kept("a", make)
    assert make.times == 1
    np.testing.assert_array_equal(first["values"], second["values"])
    assert [path.name for path in folder.iterdir()] == ["a.npz"]


@pytest.mark.parametrize("where", ["new", "off"])
def test_what_was_made_lies_in_memory_as_what_was_kept(
    where: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sums over other strides round otherwise: the first run would not replay to the bit."""
    monkeypatch.setenv(archive.VARIABLE, str(folder) if where == "new" else where)
    table = np.arange(24.0).reshape(2, 3, 4)

    def make() -> Arrays:
        return {"strided": table.transpose(2, 0, 1), "columns": np.asfortranarray(table[0])}

    for arrays in (kept("b", make), kept("b", make)):
        assert all(array.flags.c_contiguous for array in arrays.values())
        np.testing.assert_array_equal(arrays["strided"], table.transpose(2, 0, 1))


@pytest.mark.usefixtures("folder")
def test_another_name_is_another_result() -> None:
    make = Counted()
    kept("a", make)
    kept("b", make)
    assert make.times == 2


def test_a_torn_file_is_replaced(folder: Path) -> None:
    make = Counted()
    kept("a", make)
    whole = (folder / "a.npz").read_bytes()
    (folder / "a.npz").write_bytes(whole[:-20])
    np.testing.assert_array_equal(kept("a", make)["values"], np.arange(3.0))
    assert make.times == 2
    assert (folder / "a.npz").read_bytes() == whole


def test_a_folder_that_cannot_be_costs_time_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(archive.VARIABLE, str(tmp_path / "file"))
    make = Counted()
    for _ in range(2):
        np.testing.assert_array_equal(kept("a", make)["values"], np.arange(3.0))
    assert make.times == 2


def test_a_full_disk_costs_time_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_args: object, **_named: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    make = Counted()
    monkeypatch.setattr(np, "savez", full)
    for _ in range(2):
        np.testing.assert_array_equal(kept("a", make)["values"], np.arange(3.0))
    assert make.times == 2
    assert not list(folder.iterdir())


def test_of_two_that_need_the_same_one_makes_it_and_one_waits(folder: Path) -> None:
    begun, go_on = Event(), Event()

    def make() -> Arrays:
        begun.set()
        go_on.wait(60)
        return {"values": np.arange(3.0)}

    second = Counted()
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(kept, "a", make)
        assert begun.wait(60)
        other = pool.submit(kept, "a", second)
        time.sleep(3 * archive._POLL)
        assert not other.done()
        go_on.set()
        np.testing.assert_array_equal(first.result()["values"], other.result()["values"])
    assert second.times == 0
    assert [path.name for path in folder.iterdir()] == ["a.npz"]


def test_one_that_was_killed_while_it_made_it_holds_nobody_up(folder: Path) -> None:
    words = "import os; from tomoskin.core import kept; kept('a', lambda: os.kill(os.getpid(), 9))"
    killed = subprocess.run([sys.executable, "-c", words], check=False)
    assert killed.returncode == -9
    assert (folder / "a.lock").is_file()
    make = Counted()
    kept("a", make)
    assert make.times == 1
    assert [path.name for path in folder.iterdir()] == ["a.npz"]


def test_who_waits_too_long_makes_it_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "_WAIT", 0.0)
    inner = Counted()

    def make() -> Arrays:
        return kept("a", inner)  # held by this very call

    kept("a", make)
    assert inner.times == 1
    assert (folder / "a.npz").is_file()


def test_who_waits_may_be_stopped(folder: Path) -> None:
    class StoppedError(Exception):
        pass

    def stop(_stage: str) -> None:
        raise StoppedError

    def make() -> Arrays:
        with watch_stages(stop):
            return kept("a", make)

    assert not folder.exists()
    with pytest.raises(StoppedError):
        kept("a", make)
    assert not list(folder.iterdir())


def test_off_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(archive.VARIABLE, "off")
    assert archive.cache_folder() is None
    make = Counted()
    kept("a", make)
    kept("a", make)
    assert make.times == 2


def test_what_was_not_used_for_longest_goes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make = Counted()
    kept("old", make)
    size = (folder / "old.npz").stat().st_size
    monkeypatch.setattr(archive, "MOST_BYTES", 2 * size)
    kept("used", make)
    os.utime(folder / "old.npz", (1, 1))
    os.utime(folder / "used.npz", (2, 2))
    kept("new", make)
    assert sorted(path.name for path in folder.iterdir()) == ["new.npz", "used.npz"]


def test_the_users_own_folder_is_the_systems(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(archive.VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", "/elsewhere")
    folder = archive.cache_folder()
    assert folder is not None
    assert folder.name == "tomoskin"
