"""Sessions as a LeRobot dataset, format 3.0: a folder of Parquet and JSON (extra ``parquet``).

It has no actions: what skins show, at even times, in episodes, which notes or a robot's dataset
tell. LeRobot's own package is not needed to write it, and its tools join it to a robot's dataset.
"""

from __future__ import annotations

import json
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    DataError,
    FloatArray,
    IntArray,
    Output,
    StrPath,
    check_outputs,
    disk_refusals,
    encode_json,
    needed,
    write_text,
)
from tomoskin.extras.lerobot.policy_forms import (
    FIELDS,
    POSE,
    SLOTS,
    Slots,
    last_before,
    pose_row,
    still_holds,
)
from tomoskin.files.exports import Export, ExportFormat
from tomoskin.files.messages import Contacts, row_labels
from tomoskin.files.session import SessionReader
from tomoskin.model.pattern import Pattern

PREFIX = "observation.tactile"
VOLTAGES, TOUCHES, VALID, WINDOW, AGES = "voltages", "touches", "valid", "window", "ages"
LINK = "link"
"""Names of a skin's features, after the prefix and, of several skins, the skin's name."""

TIME, TIME_PARTS = "tactile.time", ("day", "second", "nanosecond")
"""Feature of absolute times, days since 1970 and what follows: not an observation, so that no
policy takes it, and whole, since LeRobot makes float32 of all other numbers. It is in parts, since
LeRobot's statistics square what they are given: of ns since 1970 no digit of their scatter is left,
and int64 overflows above 3e9."""

_FILE = "chunk-000/file-000.parquet"
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")
_QUANTILES = (0.01, 0.1, 0.5, 0.9, 0.99)

Columns = dict[str, Any]


@dataclass(frozen=True)
class Like:
    """The dataset of a robot, a folder, whose rate, lengths and tasks are wanted."""

    folder: Path


def write_lerobot(job: Export, path: StrPath) -> None:
    """Write the rows of each episode of ``job`` into a new folder.

    Raises
    ------
    DataError
        When pyarrow is missing, 1/``job.every`` is no whole number, a session is damaged or too
        short, the episodes are not those of :class:`Like`, or the disk refuses.
    OutputError
        When there is something of that name already.
    """
    pa, pq = (needed(name, "parquet", path) for name in ("pyarrow", "pyarrow.parquet"))
    sessions = job.session, *job.others
    like = job.option(Like)
    given = None if like is None else rows_like(pq, like.folder, sessions)
    rate = _rate(job.every, path) if given is None else given.rate
    tracks = [_Track.of(one) for one in job.each()]
    begin, end = (max(track.times[k] for track in tracks) for k in (0, -1))  # all have a reference
    rows = given or rows_of(sessions, rate, begin, end)
    columns, names = _counted(rows, job.session.epoch), {TIME: [*TIME_PARTS]}
    for track in tracks:
        count = track.frames_of_window(rows)
        columns |= track.columns(rows, count)
        names |= track.names(count)
    with _folder(Path(path)) as part:
        (part / "data/chunk-000").mkdir(parents=True)
        (part / "meta/episodes/chunk-000").mkdir(parents=True)
        pq.write_table(pa.table(_arrays(pa, columns)), part / "data" / _FILE)
        pq.write_table(_tasks(pa, rows.tasks), part / "meta/tasks.parquet")
        episodes = pa.Table.from_pylist(list(_episodes(rows.episodes, columns)))
        pq.write_table(episodes, part / "meta/episodes" / _FILE)
        info = _info(rows, _features(columns, names))
        for name, content in (("info", info), ("stats", _statistics(columns))):
            write_text(part / f"meta/{name}.json", encode_json(content).decode())


def _rate(every: float, path: StrPath) -> int:
    rate = round(1 / every)
    if abs(rate * every - 1) > 2e-3:  # so that 0.0333 is 30 a second
        raise DataError(
            f"expected a whole number of rows a second, got one every {every:g} s",
            where=str(path),
            hint="choose another --every, for example --every 0.1",
        )
    return rate


@dataclass(frozen=True, eq=False)
class _Track:
    """What one skin shows in every frame with a reference."""

    prefix: str
    pattern: Pattern
    times: FloatArray
    valid: NDArray[np.bool_]
    change: FloatArray
    touches: FloatArray
    poses: FloatArray
    """(n, len(POSE)); no columns where the skin lies on no link."""

    @classmethod
    def of(cls, job: Export) -> Self:
        times, valid, change, touches, poses, slots = [], [], [], [], [], Slots()
        for result in job.results():
            contacts = Contacts.of(job.stream, result)
            if contacts.change is not None:
                slots = slots.after(contacts)
                times.append(contacts.when)
                valid.append(contacts.valid)
                change.append(contacts.change.astype(np.float32))
                touches.append(slots.table.ravel().astype(np.float32))
                poses.append(pose_row(contacts) if contacts.link else [])
        if not times:
            raise DataError("holds too few frames for a reference", where=str(job.session.path))
        if (link := contacts.link) is not None and not np.any(poses):
            raise DataError(
                f"no frame says where its link was: {link.problem}",
                where=str(job.session.path),
                hint="name a bag with the joint states of that time in the robot file, as in "
                'joints = "arm.mcap", or leave out --robot',
            )
        name = f".{job.session.name}" if job.session.name else ""
        return cls(
            f"{PREFIX}{name}.",
            job.session.skin.pattern(),
            np.maximum.accumulate(times),
            *map(np.array, (valid, change, touches, poses)),
        )

    def columns(self, rows: Rows, count: int) -> Columns:
        """Of each row the newest frame that there was, and the window that ends with it.

        The window is flat: LeRobot's tools fail on tables in its rows.
        """
        moments = rows.moments
        chosen = last_before(self.times, moments, count)
        newest, ages = chosen[:, -1], moments[:, None] - self.times[chosen]
        holds = still_holds(self.times, ages[:, -1])
        valid = self.valid[newest] & holds
        window = np.where((ages >= 0)[:, :, None], self.change[chosen], 0).astype(np.float32)
        columns = {
            VOLTAGES: window[:, -1],
            TOUCHES: np.where(valid[:, None], self.touches[newest], 0).astype(np.float32),
            VALID: valid.astype(np.float32),
            WINDOW: window.reshape(len(window), -1),
            AGES: ages.astype(np.float32),
        }
        if self.poses.size:
            columns[LINK] = np.where(holds[:, None], self.poses[newest], 0).astype(np.float32)
        return {self.prefix + name: values for name, values in columns.items()}

    def frames_of_window(self, rows: Rows) -> int:
        """Frames of a window that lose none: those between two rows, and one more.

        The skin's rate says it, so that sessions of one skin fit together, unless frames came more
        closely.
        """
        period = float(np.median(np.diff(self.times))) if len(self.times) > 1 else 1.0
        usual = 1 + round(1 / (period * rows.rate)) if period > 0 else 1
        before = np.searchsorted(self.times, rows.moments, side="right")
        within = rows.episode_index[1:] == rows.episode_index[:-1]
        return max(usual, int(np.max(np.diff(before)[within], initial=1)))

    def names(self, count: int) -> dict[str, list[str]]:
        """What the columns of each feature are, by its name."""
        labels = row_labels(self.pattern)
        slots = [f"touch_{n}.{name}" for n in range(SLOTS) for name in FIELDS]
        frames = [f"frame_{n - count + 1}" for n in range(count)]
        window = [f"{frame}.{label}" for frame in frames for label in labels]
        named = {
            VOLTAGES: labels,
            TOUCHES: slots,
            WINDOW: window,
            AGES: frames,
            LINK: [*POSE],
        }
        return {self.prefix + name: words for name, words in named.items()}


def _counted(rows: Rows, epoch: float) -> Columns:
    """The columns that LeRobot needs of each row, and its absolute time."""
    numbers = (rows.frame_index, rows.episode_index, np.arange(len(rows.moments)), rows.task_index)
    counters = zip(_COUNTERS, (column.astype(np.int64) for column in numbers), strict=True)
    timestamp = (rows.frame_index / rows.rate).astype(np.float32)
    begun, rest = np.divmod(rows.moments + epoch, 1.0)
    nanoseconds = np.minimum(np.round(1e9 * rest), 999_999_999).astype(np.int64)
    parts = np.column_stack([*np.divmod(begun.astype(np.int64), 86_400), nanoseconds])
    return {TIME: parts, "timestamp": timestamp, **dict(counters)}


def utc_of(parts: IntArray) -> FloatArray:
    """(n,) s since 1970 of the feature :data:`TIME` (n, 3)."""
    return np.asarray(parts @ np.array([86_400.0, 1.0, 1e-9]))


def _features(columns: Columns, names: Mapping[str, list[str]]) -> dict[str, Any]:
    return {
        name: {
            "dtype": values.dtype.name,
            "shape": values.shape[1:] or (1,),
            "names": names.get(name),
        }
        for name, values in columns.items()
    }


def _statistics(columns: Columns) -> dict[str, Any]:
    return {name: _statistics_of(values) for name, values in columns.items()}


def _statistics_of(values: Any) -> dict[str, Any]:
    table = values.reshape(-1, 1) if values.ndim == 1 else values
    extent = {name: getattr(np, name)(table, axis=0) for name in ("min", "max", "mean", "std")}
    quantiles = np.quantile(table, _QUANTILES, axis=0)
    extent |= {f"q{100 * q:02.0f}": row for q, row in zip(_QUANTILES, quantiles, strict=True)}
    return {name: numbers.tolist() for name, numbers in extent.items()} | {"count": [len(table)]}


def _arrays(pa: Any, columns: Columns) -> Columns:
    """Lists of one number are numbers: so LeRobot reads a feature of the shape (1,)."""
    return {
        name: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
        if values.ndim > 1 and values.shape[1] > 1
        else pa.array(values.ravel())
        for name, values in columns.items()
    }


def _tasks(pa: Any, tasks: Sequence[str]) -> Any:
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
    numbers = pa.array(range(len(tasks)), pa.int64())
    table = pa.table({"task_index": numbers, index: pa.array(tasks)})
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _episodes(episodes: Sequence[Episode], columns: Columns) -> Iterator[dict[str, Any]]:
    stop = 0
    for number, episode in enumerate(episodes):
        start, stop = stop, stop + episode.count
        statistics = _statistics({name: values[start:stop] for name, values in columns.items()})
        yield {
            "episode_index": number,
            "tasks": [episode.task],
            "length": episode.count,
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": start,
            "dataset_to_index": stop,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            **{
                f"stats/{name}/{kind}": numbers
                for name, values in statistics.items()
                for kind, numbers in values.items()
            },
        }


def _info(rows: Rows, features: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "codebase_version": "v3.0",
        "robot_type": rows.robot_type,
        "total_episodes": len(rows.episodes),
        "total_frames": len(rows.moments),
        "total_tasks": len(rows.tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": rows.rate,
        "splits": {"train": f"0:{len(rows.episodes)}"},
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


BEGIN, END = "episode", "end"
"""First words of the notes that begin and end an episode; its task follows the first."""

_TASK = "tactile recording"


@dataclass(frozen=True, slots=True)
class Episode:
    """``count`` rows from a host time, s, on, and what is done in them."""

    start: float
    count: int
    task: str = _TASK


@dataclass(frozen=True)
class Rows:
    """All rows of a dataset, by their episodes."""

    rate: int
    episodes: tuple[Episode, ...]
    robot_type: str | None = "tomoskin"

    @cached_property
    def episode_index(self) -> IntArray:
        """(n,) number of the episode of each row."""
        return np.repeat(np.arange(len(self.episodes)), [e.count for e in self.episodes])

    @cached_property
    def frame_index(self) -> IntArray:
        """(n,) number of each row in its episode."""
        return np.concatenate([np.arange(episode.count) for episode in self.episodes])

    @cached_property
    def moments(self) -> FloatArray:
        """(n,) host time of each row, s."""
        starts = np.array([episode.start for episode in self.episodes])
        return np.asarray(starts[self.episode_index] + self.frame_index / self.rate)

    @cached_property
    def tasks(self) -> tuple[str, ...]:
        """Each task once, as they come."""
        return tuple(dict.fromkeys(episode.task for episode in self.episodes))

    @cached_property
    def task_index(self) -> IntArray:
        """(n,) number of the task of each row."""
        return np.array([self.tasks.index(e.task) for e in self.episodes])[self.episode_index]


def rows_of(sessions: Sequence[SessionReader], rate: int, begin: float, end: float) -> Rows:
    """Rows of the episodes that notes mark; without such notes one from ``begin`` to ``end``."""
    marked = list(_marked(sessions))
    if not marked:
        return Rows(rate, (Episode(begin, 1 + _steps(end - begin, rate)),))
    episodes = []
    for start, stop, task in marked:
        count = 1 + _steps(end - start, rate) if stop is None else _rows_before(stop - start, rate)
        if count > 0:
            episodes.append(Episode(start, count, task))
    if not episodes:
        raise DataError("holds no frame in any of its episodes", where=str(sessions[0].path))
    return Rows(rate, tuple(episodes))


def rows_like(pq: Any, folder: Path, sessions: Sequence[SessionReader]) -> Rows:
    """Rows for those of a robot's dataset: its rate, lengths and tasks, each from a note on."""
    try:
        info = msgspec.json.decode((folder / "meta/info.json").read_bytes(), type=dict[str, Any])
        tables = sorted((folder / "meta/episodes").rglob("*.parquet"))
        held = [row for path in tables for row in pq.read_table(path, columns=_HELD).to_pylist()]
        held.sort(key=lambda row: row["episode_index"])
        rate = int(info["fps"])
    except (OSError, ValueError, KeyError, TypeError, msgspec.MsgspecError) as error:
        raise DataError(
            f"cannot be read as a LeRobot dataset of format 3.0: {error}", where=str(folder)
        ) from error
    starts = [start for start, _, _ in _marked(sessions)]
    if len(starts) != len(held) or not held:
        raise DataError(
            f'expected a note "{BEGIN}" for each of the {len(held)} episodes in {folder}, got '
            f"{len(starts)}",
            where=str(sessions[0].path),
        )
    episodes = (
        Episode(start, row["length"], row["tasks"][0] if row["tasks"] else _TASK)
        for start, row in zip(starts, held, strict=True)
    )
    return Rows(rate, tuple(episodes), info.get("robot_type"))


_HELD = ["episode_index", "length", "tasks"]


def _marked(sessions: Sequence[SessionReader]) -> Iterator[tuple[float, float | None, str]]:
    """Start, end and task of each episode; no end where it is that of the recording."""
    start, task = None, ""
    notes = (note for session in sessions for note in session.notes())
    for note in sorted(notes, key=lambda note: note.host_time):
        first, _, rest = note.text.strip().partition(" ")
        word = first.lower().rstrip(":")
        if word not in (BEGIN, END):
            continue
        if start is not None:
            yield start, note.host_time, task
        start, task = (note.host_time, rest.strip() or _TASK) if word == BEGIN else (None, "")
    if start is not None:
        yield start, None, task


def _steps(seconds: float, rate: int) -> int:
    return int(np.floor(seconds * rate + 1e-9))


def _rows_before(seconds: float, rate: int) -> int:
    return int(np.ceil(seconds * rate - 1e-9))


FORMAT = ExportFormat(
    write_lerobot,
    "a folder, a LeRobot dataset",
    ("pyarrow", "parquet"),
    several=True,
    of_links=True,
)
"""What is registered for ``.lerobot``."""
