"""A session as a LeRobot dataset: by pyarrow, by Rerun's reader, and by LeRobot's own package."""

from __future__ import annotations

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from cli.conftest import tomoskin
from run.sinks.test_bag import SCRIPT
from tomoskin.files.exports import Export
from tomoskin.files.exports.lerobot import (
    FIELDS,
    MOST_TOUCHES,
    TOUCHES,
    VALID,
    VOLTAGES,
    write_lerobot,
)
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

__all__ = ["tomoskin"]

RATE = 20


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A short press."""
    path = tmp_path_factory.mktemp("lerobot") / "press.mcap"
    simulate(Script.from_toml(SCRIPT), Skin.load("textile-disc-8"), path, advance=nothing)
    return path


@pytest.fixture(scope="module")
def dataset(session):
    """Its folder, and the results that it was made from."""
    folder = session.with_name("press.lerobot")
    with SessionReader(session) as reader:
        write_lerobot(Export(reader, 1 / RATE, nothing), folder)
        return folder, [r for r in replayed(as_recorded(reader), reader) if r.ready]


def nothing(*_):
    """Nobody watches how far it is."""


def test_a_row_holds_the_newest_frame(dataset):
    folder, results = dataset
    table = pq.read_table(folder / "data/chunk-000/file-000.parquet").to_pydict()
    begun = results[0].host_time
    assert np.allclose(table["timestamp"], np.arange(len(table["index"])) / RATE)
    assert table["frame_index"] == table["index"] == list(range(len(table["index"])))
    for number, (voltages, touches) in enumerate(zip(table[VOLTAGES], table[TOUCHES], strict=True)):
        newest = [r for r in results if r.host_time - begun <= number / RATE + 1e-6][-1]
        assert np.allclose(voltages, newest.voltages - newest.reference, atol=1e-9)
        rows = np.reshape(touches, (MOST_TOUCHES, len(FIELDS)))
        assert rows[:, 0].sum() == len(newest.touches)
        for touch, row in zip(newest.touches, rows, strict=False):
            seen = touch.detection
            assert row == pytest.approx([1, seen.x, seen.y, 0, seen.peak], rel=1e-6)
    assert max(row[0] for row in table[TOUCHES]) == 1
    assert table[VALID] == [[1.0]] * len(table["index"])


def test_it_says_what_it_holds(dataset):
    folder, _ = dataset
    info = json.loads((folder / "meta/info.json").read_text())
    rows = pq.read_table(folder / "data/chunk-000/file-000.parquet")
    assert (info["codebase_version"], info["fps"], info["total_frames"]) == (
        "v3.0",
        RATE,
        len(rows),
    )
    assert info["features"].keys() == set(rows.column_names)
    voltages = info["features"][VOLTAGES]
    assert len(voltages["names"]) == voltages["shape"][0] == 40
    statistics = json.loads((folder / "meta/stats.json").read_text())
    assert statistics.keys() == info["features"].keys()
    column = np.array(rows[VOLTAGES].to_pylist())
    assert statistics[VOLTAGES]["mean"] == pytest.approx(column.mean(axis=0), rel=1e-4, abs=1e-9)
    (episode,) = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert (episode["length"], episode["dataset_to_index"]) == (len(rows), len(rows))


def test_what_cannot_be_written(tomoskin, dataset, session):
    folder, _ = dataset
    again = tomoskin("session", "export", session, folder, "--force")
    assert (again[0], "got a folder" in again[2]) == (2, True)
    other = session.with_name("other.lerobot")
    uneven = tomoskin("session", "export", session, other, "--every", "0.3")
    assert (uneven[0], "whole number of rows a second" in uneven[2]) == (1, True)
    assert not other.exists()
    assert not list(session.parent.glob(".tomoskin-*"))


def test_rerun_reads_it(dataset):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'tomoskin[rerun]'")
    from rerun.experimental import LeRobotReader

    folder, _ = dataset
    reader = LeRobotReader(folder)
    assert (reader.version, reader.episodes()) == ("v3", [0])
    paths = {chunk.entity_path for chunk in reader.stream(0).to_chunks()}
    assert {f"/{VOLTAGES}", f"/{TOUCHES}"} <= paths


@pytest.mark.slow
def test_lerobot_reads_it(dataset):
    module = pytest.importorskip(
        "lerobot.datasets.lerobot_dataset", reason="lerobot is not installed: pip install lerobot"
    )
    folder, _ = dataset
    found = module.LeRobotDataset("tomoskin/press", root=folder)
    row = found[len(found) // 2]
    rows = pq.read_table(folder / "data/chunk-000/file-000.parquet").to_pylist()
    assert len(found) == len(rows)
    assert np.allclose(row[VOLTAGES], rows[len(found) // 2][VOLTAGES])
    assert row["task"] == "tactile recording"
