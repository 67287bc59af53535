"""A session as a LeRobot dataset, format 3.0: a folder of Parquet and JSON (extra ``parquet``).

One episode without actions: what the skin shows, at even times. LeRobot's own package is not
needed to write it.
"""

from __future__ import annotations

import json
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from tomoskin.core import (
    DataError,
    FloatArray,
    Output,
    StrPath,
    check_outputs,
    disk_refusals,
    encode_json,
    needed,
    write_text,
)
from tomoskin.files.exports.export import Export
from tomoskin.files.messages import Contacts, row_labels
from tomoskin.model.pattern import Pattern

VOLTAGES, TOUCHES = "observation.tactile.voltages", "observation.tactile.touches"
VALID = "observation.tactile.valid"
"""Names of the features."""

MOST_TOUCHES = 5
"""Touches that a row has room for, the strongest first."""

FIELDS = ("present", "x", "y", "z", "strength")
"""Of each touch: 1 or 0, m in space, and its extreme value in the image's unit."""

_TASK = "tactile recording"
_FILE = "chunk-000/file-000.parquet"
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")

Columns = dict[str, Any]


def write_lerobot(job: Export, path: StrPath) -> None:
    """Write a row each ``job.every`` s into a new folder, from the first frame with a reference on.

    Raises
    ------
    DataError
        When pyarrow is missing, 1/``job.every`` is no whole number, the session is damaged or too
        short, or the disk refuses.
    OutputError
        When there is something of that name already.
    """
    pa, pq = (needed(name, "parquet", path) for name in ("pyarrow", "pyarrow.parquet"))
    rate = _rate(job.every, path)
    rows = _rows(job, rate)
    statistics = {name: _statistics(values) for name, values in rows.items()}
    features = _features(job.session.skin.pattern(), rows)
    with _folder(Path(path)) as part:
        (part / "data/chunk-000").mkdir(parents=True)
        (part / "meta/episodes/chunk-000").mkdir(parents=True)
        pq.write_table(pa.table(_arrays(pa, rows)), part / "data" / _FILE)
        pq.write_table(_tasks(pa), part / "meta/tasks.parquet")
        episode = pa.Table.from_pylist([_episode(len(rows["index"]), statistics)])
        pq.write_table(episode, part / "meta/episodes" / _FILE)
        info = _info(rate, len(rows["index"]), features)
        for name, content in (("info", info), ("stats", statistics)):
            write_text(part / f"meta/{name}.json", encode_json(content).decode())


def _rate(every: float, path: StrPath) -> int:
    rate = round(1 / every)
    if abs(rate * every - 1) > 1e-9:
        raise DataError(
            f"expected a whole number of rows a second, got one every {every:g} s",
            where=str(path),
            hint="choose another --every, for example --every 0.1",
        )
    return rate


def _rows(job: Export, rate: int) -> Columns:
    """Columns by name, a row at each even time: the newest frame that was there by then."""
    times, voltages, touches, valid = [], [], [], []
    for result in job.results():
        if result.ready:
            contacts = Contacts.of(job.stream, result)
            times.append(result.host_time)
            voltages.append(result.voltages - result.reference)
            touches.append(_touches(contacts))
            valid.append([float(contacts.valid)])
    if not times:
        raise DataError("holds too few frames for a reference", where=str(job.session.path))
    count = 1 + int(np.floor((times[-1] - times[0]) * rate + 1e-9))
    even = np.arange(count) / rate
    newest = np.searchsorted(np.array(times) - times[0], even + 1e-9, side="right") - 1
    counters = {name: np.zeros(count, dtype=np.int64) for name in _COUNTERS}
    counters["frame_index"] = counters["index"] = np.arange(count)
    return {
        VOLTAGES: np.array(voltages, dtype=np.float32)[newest],
        TOUCHES: np.array(touches, dtype=np.float32)[newest],
        VALID: np.array(valid, dtype=np.float32)[newest],
        "timestamp": even.astype(np.float32),
        **counters,
    }


def _touches(contacts: Contacts) -> FloatArray:
    """(MOST_TOUCHES · 5,) zeros where there are fewer."""
    row = np.zeros((MOST_TOUCHES, len(FIELDS)))
    for number, contact in enumerate(contacts.strongest(MOST_TOUCHES)):
        row[number] = 1.0, *contact.position, contact.touch.detection.peak
    return row.ravel()


def _features(pattern: Pattern, rows: Columns) -> dict[str, Any]:
    names = {
        VOLTAGES: row_labels(pattern),
        TOUCHES: [f"touch_{n}.{field}" for n in range(MOST_TOUCHES) for field in FIELDS],
        VALID: ["valid"],
    }
    return {
        name: {
            "dtype": values.dtype.name,
            "shape": values.shape[1:] or (1,),
            "names": names.get(name),
        }
        for name, values in rows.items()
    }


def _statistics(values: Any) -> dict[str, Any]:
    columns = values.reshape(len(values), -1)
    extent = {
        name: getattr(np, name)(columns, axis=0).tolist() for name in ("min", "max", "mean", "std")
    }
    return extent | {"count": [len(values)]}


def _arrays(pa: Any, rows: Columns) -> Columns:
    return {
        name: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
        if values.ndim > 1
        else pa.array(values)
        for name, values in rows.items()
    }


def _tasks(pa: Any) -> Any:
    """Indexed by the task's words, as pandas writes it, since LeRobot reads it by pandas."""
    index = "__index_level_0__"
    about = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            {"name": "task_index", "field_name": "task_index", "pandas_type": "int64",
             "numpy_type": "int64", "metadata": None},
            {"name": None, "field_name": index, "pandas_type": "unicode",
             "numpy_type": "object", "metadata": None},
        ],
    }  # fmt: skip
    table = pa.table({"task_index": pa.array([0], pa.int64()), index: pa.array([_TASK])})
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _episode(count: int, statistics: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    return {
        "episode_index": 0,
        "tasks": [_TASK],
        "length": count,
        "data/chunk_index": 0,
        "data/file_index": 0,
        "dataset_from_index": 0,
        "dataset_to_index": count,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
        **{
            f"stats/{name}/{kind}": numbers
            for name, values in statistics.items()
            for kind, numbers in values.items()
        },
    }


def _info(rate: int, count: int, features: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "codebase_version": "v3.0",
        "robot_type": "tomoskin",
        "total_episodes": 1,
        "total_frames": count,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": rate,
        "splits": {"train": "0:1"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": features,
    }


@contextmanager
def _folder(path: Path) -> Iterator[Path]:
    """A new folder that takes its name when all of it is there."""
    check_outputs([Output(path)])
    part = path.with_name(f".tomoskin-{secrets.token_hex(8)}")
    with disk_refusals(path):
        try:
            part.mkdir()
            yield part
            check_outputs([Output(path)])
            part.rename(path)
        finally:
            shutil.rmtree(part, ignore_errors=True)
