"""Sessions as a LeRobot dataset: by pyarrow, by Rerun's reader, and by LeRobot's own package."""

from __future__ import annotations

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cli.conftest import tomoskin
from extras.robot.test_joint_states import ROBOT, URDF, write_bag
from prose import ROOT
from tomoskin.core import DataError
from tomoskin.extras.lerobot import FIELDS, SLOTS, Like, write_lerobot
from tomoskin.extras.lerobot.dataset import TIME, TIME_PARTS, Episode, Rows, _counted, utc_of
from tomoskin.files.exports import Export
from tomoskin.files.session import (
    SessionReader,
    SessionWriter,
    as_recorded,
    replayed,
    robot_logs,
    skins_in,
    split,
    split_targets,
)
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

__all__ = ["tomoskin"]

SCRIPT = """format = 1
[script]
duration = "2600 ms"
lead_in = "1.2 s"
[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "0 s"
force = "3 N"
hold = "600 ms"
[[press]]
id = "b"
radius = "15 mm"
at = ["-30 mm", "30 mm"]
start = "400 ms"
force = "6 N"
hold = "1200 ms"
[[mark]]
at = "0 s"
text = "episode press the left"
[[mark]]
at = "1 s"
text = "end"
[[mark]]
at = "1200 ms"
text = "Episode"
"""
RATE = 20
PREFIX = "observation.tactile."
TOUCHES, WINDOW, AGES = PREFIX + "touches", PREFIX + "window", PREFIX + "ages"


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Two presses that overlap, in two episodes."""
    path = tmp_path_factory.mktemp("lerobot") / "press.mcap"
    simulate(Script.from_toml(SCRIPT), Skin.load("textile-disc-8"), path, advance=nothing)
    return path


@pytest.fixture(scope="module")
def dataset(session):
    """Its folder, and the results that it was made from."""
    folder = exported(session, session.with_name("press.lerobot"))
    with SessionReader(session) as reader:
        return folder, [r for r in replayed(as_recorded(reader), reader) if r.ready]


def exported(session, folder, rate=RATE, like=None):
    with SessionReader(session) as reader:
        options = () if like is None else (Like(like),)
        write_lerobot(Export(reader, 1 / rate, nothing, options=options), folder)
    return folder


def nothing(*_):
    """Nobody watches how far it is."""


def table_of(folder):
    table = pq.read_table(folder / "data/chunk-000/file-000.parquet").to_pydict()
    arrays = {name: np.array(values) for name, values in table.items()}
    return arrays | {"time": utc_of(arrays[TIME])}


def slots_of(table, name=TOUCHES):
    """(n, SLOTS) by the name of the field."""
    slots = table[name].reshape(-1, SLOTS, len(FIELDS))
    return {field: slots[:, :, number] for number, field in enumerate(FIELDS)}


def test_a_row_holds_the_newest_frame(dataset):
    folder, results = dataset
    table = table_of(folder)
    slots = slots_of(table)
    for number, moment in enumerate(table["time"]):
        newest = [r for r in results if r.scanned <= moment + 1e-9][-1]
        change = newest.voltages - newest.reference
        assert np.allclose(table[PREFIX + "voltages"][number], change, atol=1e-9)
        held = {int(key): place for place, key in enumerate(slots["id"][number]) if key}
        assert held.keys() == {touch.id for touch in newest.touches}
        for touch in newest.touches:
            row = {name: slots[name][number, held[touch.id]] for name in FIELDS}
            found = touch.detection
            assert row["present"] == row["nz"] == 1
            assert (row["x"], row["y"], row["strength"]) == pytest.approx(
                (found.x, found.y, found.peak), rel=1e-6
            )
            assert (row["sd_x"], row["sd_y"]) == pytest.approx((found.sd_x, found.sd_y), rel=1e-6)
    assert table[PREFIX + "valid"].tolist() == [1] * len(table["index"])
    assert slots["valid"].all()  # a place without a touch says that nothing touches


def test_a_touch_keeps_its_slot_beside_a_stronger_one(dataset):
    slots = slots_of(table_of(dataset[0]))
    first, second = slots["id"][:, :2].T.astype(int)
    both = (first > 0) & (second > 0)
    assert both.sum() > 3
    assert {*first} <= {0, 1}
    assert {*second} <= {0, 2}
    assert (np.abs(slots["strength"][both, 1]) > np.abs(slots["strength"][both, 0])).any()
    assert second[-20:].any()
    assert not first[-20:].any()  # it stays in the second when the first is free


def test_notes_mark_episodes_with_their_tasks_and_times(dataset):
    folder, _ = dataset
    table = table_of(folder)
    rows = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["tasks"] for row in rows] == [["press the left"], ["tactile recording"]]
    assert sum(row["length"] for row in rows) == len(table["index"])
    for number, row in enumerate(rows):
        of = slice(row["dataset_from_index"], row["dataset_to_index"])
        assert {*table["episode_index"][of]} == {*table["task_index"][of]} == {number}
        assert np.allclose(table["timestamp"][of], np.arange(row["length"]) / RATE)
        assert np.allclose(np.diff(table["time"][of]), 1 / RATE)
    with SessionReader(folder.with_name("press.mcap")) as reader:
        starts = [note.host_time for note in reader.notes() if note.text != "end"]
        assert table["time"][[0, rows[0]["length"]]] == pytest.approx(np.add(starts, reader.epoch))


def test_a_window_loses_no_frame(dataset, session):
    table = table_of(exported(session, session.with_name("slow.lerobot"), rate=4))
    moments, ages = table["time"], table[AGES]
    times = np.round(moments[:, None] - ages, 4)
    assert (ages >= 0).all()
    assert (np.diff(times, axis=1) >= 0).all()
    windows = table[WINDOW].reshape(*times.shape, -1)
    results = {round(r.scanned, 4): r.voltages - r.reference for r in dataset[1]}
    for first, last in zip(*(table["episode_index"].searchsorted([0, 1], side) for side in
                             ("left", "right")), strict=True):  # fmt: skip
        within = {t for t in results if moments[first] < t <= moments[last - 1]}
        assert within <= {*times[first:last].ravel()}
        assert len(within) > 2 * (last - first)
    for row, when in zip(windows, times, strict=True):
        assert np.allclose(row, [results[t] for t in when], atol=1e-9)


def test_what_is_not_valid_is_no_release(session):
    """Rows before the reference, and rows after the last frame."""
    like = session.with_name("long")
    robot_dataset(like, lengths=(5, 400))
    table = table_of(exported(session, session.with_name("long.lerobot"), like=like))
    valid = table[PREFIX + "valid"].astype(bool)
    slots = slots_of(table)
    assert valid[:5].all()
    assert not valid[-100:].any()
    assert (slots["valid"] == valid[:, None]).all()
    assert not slots["present"][~valid].any()
    assert np.isfinite(table[TOUCHES]).all()


def robot_dataset(folder, lengths, rate=10):
    """What an export reads of a robot's dataset."""
    (folder / "meta/episodes/chunk-000").mkdir(parents=True)
    features = {"action": {"dtype": "float32", "shape": [2], "names": ["a", "b"]}}
    info = {"fps": rate, "robot_type": "arm", "features": features}
    (folder / "meta/info.json").write_text(json.dumps(info))
    rows = [
        {"episode_index": n, "length": length, "tasks": ["pick"]}
        for n, length in enumerate(lengths)
    ]
    pq.write_table(pa.Table.from_pylist(rows), folder / "meta/episodes/chunk-000/file-000.parquet")


def test_rows_like_those_of_a_robot(session, tomoskin):
    like, folder = session.with_name("arm"), session.with_name("beside.lerobot")
    robot_dataset(like, lengths=(7, 3))
    assert tomoskin("session", "export", session, folder, "--like", like)[0] == 0
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["fps"], info["robot_type"], info["total_frames"]) == (10, "arm", 10)
    assert table_of(folder)["episode_index"].tolist() == [0] * 7 + [1] * 3
    table = tomoskin("session", "export", session, session.with_name("x.csv"), "--like", like)
    assert (table[0], "--like" in table[2]) == (2, True)
    other = session.with_name("three")
    robot_dataset(other, lengths=(7, 3, 1))
    with pytest.raises(DataError, match="each of the 3 episodes"):
        exported(session, session.with_name("none.lerobot"), like=other)
    (other / "meta/info.json").write_text("{}")
    with pytest.raises(DataError, match="as a LeRobot dataset"):
        exported(session, session.with_name("none.lerobot"), like=other)


@pytest.fixture(scope="module")
def robot(session):
    """A recording of two skins: the second hears a second less."""
    path = session.with_name("robot.mcap")
    logs = robot_logs(path, ("left", "right"), epoch=1000.0, start=0.0)
    for name, log in logs.items():
        with SessionReader(session) as reader, SessionWriter(path, reader.skin, log=log) as writer:
            frames = list(reader.frames())
            for item in frames[: len(frames) - 20 * (name == "right")]:
                writer.frame(item.frame, item.mark)
            if name == "right":  # the page was at this skin
                writer.note(frames[30].frame.host_time, "episode")
    return path


def test_several_skins_in_one_dataset(robot, session, tomoskin):
    assert skins_in(robot) == ("left", "right")
    assert skins_in(session) == ("",)
    folder = robot.with_name("robot.lerobot")
    assert tomoskin("session", "export", robot, folder, "--every", "0.05")[0] == 0
    table = table_of(folder)
    left, right = (table[f"{PREFIX}{name}.valid"] for name in ("left", "right"))
    assert left.all()
    assert right[:5].all()
    with SessionReader(robot, "right") as reader:
        (note,) = reader.notes()
        assert table["time"][0] == pytest.approx(note.host_time + reader.epoch, abs=1e-6)
    assert not right[-10:].any()  # its board is silent
    both = (table[f"{PREFIX}left.ages"] == table[f"{PREFIX}right.ages"]).all(axis=1)
    assert both.sum() > 10
    assert (table[f"{PREFIX}left.touches"][both] == table[f"{PREFIX}right.touches"][both]).all()


def test_each_row_says_where_the_links_were_and_where_that_is_not_known(robot, tomoskin):
    file, folder = robot.with_name("worn.toml"), robot.with_name("worn.lerobot")
    robot.with_name("arm.urdf").write_text(URDF)
    text = ROBOT.replace("palm", "left").replace("JOINTS", "ros2")
    file.write_text(text + '[[skin]]\nname = "right"\nskin = "textile-disc-8"\n')
    words = "session", "export", robot, folder, "--every", "0.05", "--robot", file
    file.write_text(file.read_text().replace("joints =", "#"))
    code, _, errors = tomoskin(*words)
    assert (code, 'pose unknown: the joint "elbow" may move' in errors) == (1, True)
    file.write_text(file.read_text().replace('# "ros2"', 'joints = "arm.mcap"'))
    with SessionReader(robot, "left") as reader:
        begin, end = reader.epoch, list(reader.frames())[-1].frame.host_time
    middle = end / 2  # the robot says no more from here on
    write_bag(robot.with_name("arm.mcap"), np.arange(0, middle, 0.02), lambda t: t, begun=begin)
    assert tomoskin(*words)[0] == 0
    table = table_of(folder)
    pose, when = table[f"{PREFIX}left.link"], table["time"] - begin
    known, late = pose[:, 0] == 1, when > middle + 0.6
    assert known[when < middle].all()
    assert late.any()
    assert not pose[late].any()
    yaw = 2 * np.arctan2(pose[known, 6], pose[known, 7])
    scan = float(np.median(np.diff(np.unique(when))))
    assert np.abs(yaw - np.minimum(when[known], middle)).max() < 2 * scan
    assert pose[known, 1:3] == pytest.approx(0.4 * np.column_stack((np.cos(yaw), np.sin(yaw))))
    assert f"{PREFIX}right.link" not in table
    file.write_text(text.replace("ros2", "arm.mcap"))  # it has no skin called right
    code, _, errors = tomoskin(*words[:3], folder.with_name("other.lerobot"), *words[4:])
    assert 'expected one of left, got "right"' in errors


@pytest.mark.parametrize("ending", [".csv", ".lerobot"])
def test_one_skin_of_a_robot_is_as_if_it_were_alone(robot, tomoskin, ending):
    one, alone = (robot.with_name(name + ending) for name in ("one", "alone"))
    assert tomoskin("session", "export", robot, one, "--skin", "right")[0] == 0
    part = split_targets(robot)["right"]
    if not part.exists():
        split(robot)
    assert tomoskin("session", "export", part, alone)[0] == 0
    if ending == ".csv":
        assert one.read_text() == alone.read_text()
    else:
        values = table_of(one), table_of(alone)
        assert (values[0][f"{PREFIX}right.window"] == values[1][WINDOW]).all()
        assert (values[0]["time"] == values[1]["time"]).all()
    code, _, errors = tomoskin("session", "export", robot, one, "--skin", "foot", "--force")
    assert (code, "left, right" in errors) == (1 if ending == ".csv" else 2, ending == ".csv")


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
    for name, feature in info["features"].items():
        held = np.array(rows[name].to_pylist())
        assert tuple(feature["shape"]) == (held.shape[1:] or (1,))
        assert feature["shape"] == [1] or len(feature["names"]) == feature["shape"][0]
        assert len(feature["shape"]) == 1  # LeRobot's tools fail on more
    assert info["features"][TIME]["dtype"] == "int64"  # as a float it would lose minutes
    statistics = json.loads((folder / "meta/stats.json").read_text())
    assert statistics.keys() == info["features"].keys()
    column = np.array(rows[WINDOW].to_pylist())
    found = statistics[WINDOW]
    assert found["mean"] == pytest.approx(column.mean(axis=0), rel=1e-4, abs=1e-9)
    assert found["q99"] == pytest.approx(np.quantile(column, 0.99, axis=0), rel=1e-4, abs=1e-9)


def test_times_survive_statistics_that_square_them():
    """As LeRobot computes them again: E[x²] − E[x]², the squares perhaps of whole numbers."""
    epoch = 1_790_000_000.25
    rows = Rows(30, (Episode(3.0, 90), Episode(7.0, 20)))
    parts = _counted(rows, epoch)[TIME]
    assert parts.dtype == np.int64
    assert utc_of(parts) == pytest.approx(rows.moments + epoch, abs=1e-6)
    assert parts[0].tolist() == [20717, 51203, 250_000_000]
    for column, name in zip(parts.T, TIME_PARTS, strict=True):
        for values in (column, column.astype(float)):
            variance = np.mean(values**2) - np.mean(values) ** 2
            assert np.sqrt(max(variance, 0)) == pytest.approx(column.std(), rel=1e-3, abs=1e-3), (
                name
            )


def test_a_window_of_one_frame_is_a_number(session):
    """LeRobot reads a feature of the shape (1,) as a number, and no list of one."""
    folder = exported(session, session.with_name("fast.lerobot"), rate=50)
    info = json.loads((folder / "meta/info.json").read_text())
    schema = pq.read_schema(folder / "data" / "chunk-000" / "file-000.parquet")
    assert info["features"][AGES]["shape"] == [1]
    for name, feature in info["features"].items():
        assert (feature["shape"] == [1]) == (not pa.types.is_nested(schema.field(name).type)), name
    ages = np.array(pq.read_table(folder / "data")[AGES].to_pylist())
    assert ages.ndim == 1
    assert 0 <= ages.min() <= ages.max() < 0.2


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
    assert (reader.version, reader.episodes()) == ("v3", [0, 1])
    paths = {chunk.entity_path for chunk in reader.stream(0).to_chunks()}
    assert {f"/{PREFIX}voltages", f"/{TOUCHES}"} <= paths


@pytest.fixture
def lerobot(monkeypatch):
    """LeRobot's module of datasets and its tools."""
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    reason = "lerobot is not installed: pip install 'lerobot[dataset]'"
    tools = pytest.importorskip("lerobot.datasets.dataset_tools", reason=reason)
    return tools.LeRobotDataset, tools


@pytest.mark.slow
def test_lerobot_reads_it(dataset, lerobot):
    folder, _ = dataset
    found = lerobot[0]("tomoskin/press", root=folder)
    table = table_of(folder)
    assert len(found) == len(table["index"])
    for number in (0, len(found) - 1):
        row = found[number]
        for name in (TOUCHES, WINDOW, AGES, TIME, PREFIX + "valid"):
            assert np.array_equal(row[name], table[name][number])
    assert (found[0]["task"], found.num_episodes) == ("press the left", 2)


@pytest.mark.slow
def test_lerobot_merges_sessions(session, dataset, lerobot, tmp_path):
    dataset_class, tools = lerobot
    other = exported(session, session.with_name("other_day.lerobot"))
    parts = [dataset_class(f"tomoskin/{n}", root=f) for n, f in enumerate((dataset[0], other))]
    merged = tools.merge_datasets(parts, "tomoskin/both", output_dir=tmp_path / "both")
    assert (len(merged), merged.num_episodes) == (2 * len(parts[0]), 4)
    assert np.array_equal(merged[len(parts[0]) + 3][WINDOW], parts[1][3][WINDOW])


@pytest.mark.slow
def test_lerobot_joins_it_to_a_robots_dataset_and_merges_those(session, lerobot, tmp_path):
    """As the documentation does."""
    dataset_class, tools = lerobot
    page = (ROOT / "docs/extras/lerobot.md").read_text(encoding="utf-8")
    program = page.partition("```python\nimport numpy")[2].partition("\nmonday = ")[0]
    names = {}
    exec("import numpy" + program, names)
    with_skin, joined = names["with_skin"], []
    for day in range(2):
        robot = recorded_robot(dataset_class, tmp_path / f"robot{day}", lengths=(9, 12 + day))
        skin = exported(session, tmp_path / f"skin{day}.lerobot", like=robot.root)
        skin = dataset_class(f"tomoskin/skin{day}", root=skin)
        joined.append(with_skin(robot, skin, tmp_path / f"joined{day}"))
    merged = tools.merge_datasets(joined, "arm/all", output_dir=tmp_path / "all")
    assert (len(merged), merged.num_episodes) == (9 + 12 + 9 + 13, 4)
    row = merged[21 + 4]
    assert row["action"].tolist() == [4, 0]
    assert np.array_equal(row[WINDOW], skin[4][WINDOW])
    assert np.array_equal(row[TOUCHES], skin[4][TOUCHES])
    assert np.array_equal(row[TIME], skin[4][TIME])
    assert row["task"] == "pick"
    assert merged.meta.stats[TOUCHES]["mean"].shape == (SLOTS * len(FIELDS),)


def recorded_robot(dataset_class, root, lengths):
    names = {"action": ["a", "b"], "observation.state": ["a", "b", "c"]}
    features = {
        name: {"dtype": "float32", "shape": (len(parts),), "names": parts}
        for name, parts in names.items()
    }
    robot = dataset_class.create("arm/x", fps=10, features=features, root=root, robot_type="arm")
    for length in lengths:
        for number in range(length):
            state, action = np.zeros(3, np.float32), np.array([number, 0], np.float32)
            robot.add_frame({"observation.state": state, "action": action, "task": "pick"})
        robot.save_episode()
    robot.finalize()
    return dataset_class("arm/x", root=root)
