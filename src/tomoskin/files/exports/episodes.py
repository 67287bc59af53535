"""The rows of a dataset: even times in episodes, which notes or a robot's dataset tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.files.session import SessionReader

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
