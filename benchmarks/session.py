"""Recording at 1,000 frames/s, opening and seeking an hour, exporting it to Parquet."""

from __future__ import annotations

import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from report import Report, resident, table
from tomoskin.board.wire import encode
from tomoskin.core import Capacity, Frame, Mark, MarkedFrame, Worker
from tomoskin.files.exports import Export, write_parquet
from tomoskin.files.session import (
    RawRead,
    Recorder,
    SessionReader,
    SessionWriter,
)
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin

SKIN, RATE = "textile-disc-16", 1000.0
LONG, PACED = 600, 20
"""Seconds recorded: as fast as they are written, and at their own rate."""

HOUR, HOUR_RATE = 3600, 100.0
SEED, SEEKS = 1, 40
MOST_WAITING = 50_000
"""Messages that may wait for the disk, as in a run."""

_BATCH, _KINDS = 2000, 500
"""Frames put at once where they are not paced; different frames, which come again and again."""


def run() -> Iterator[Report]:
    skin = Skin.load(SKIN)
    frames = frames_of(skin)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        rows = (
            recorded(place / "long.mcap", skin, frames, LONG, paced=False),
            recorded(place / "paced.mcap", skin, frames, PACED, paced=True),
        )
        (place / "long.mcap").unlink()
        hour = of_length(place / "hour.mcap", skin, frames, HOUR)
        row, target, start = opened(hour, HOUR), place / "hour.parquet", time.perf_counter()
        with SessionReader(hour) as session:
            write_parquet(Export(session), target)
        row["Parquet s"] = round(time.perf_counter() - start, 1)
        row["Parquet MB"] = round(target.stat().st_size / 1e6)
    yield table(
        "recording raw bytes and frames beside a pipeline",
        rows,
        f"{SKIN}, seed {SEED}; processor time of the whole process, which also makes the frames, "
        "by the seconds recorded; growth of the process",
    )
    yield table(
        "a session of one hour",
        [row],
        f"{HOUR_RATE:.0f} frames/s of {SKIN}, {SEEKS} random places, seed {SEED}",
    )


def frames_of(skin: Skin) -> list[Frame]:
    """Frames to be sent again and again with new numbers and times."""
    rng = np.random.default_rng(SEED)
    n = Scan.of(skin.pattern()).n_samples
    samples = rng.integers(200, 3000, (_KINDS, n)).astype("<u2")
    return [Frame(0, 0, 0.0, 0x1A2B, 0, 0, row) for row in samples]


def _at(frames: list[Frame], number: int, rate: float) -> Frame:
    ticks, seconds = round(number * 16e6 / rate), number / rate
    return replace(frames[number % _KINDS], sequence=number, ticks=ticks, host_time=seconds)


def recorded(
    path: Path, skin: Skin, frames: list[Frame], seconds: int, *, paced: bool
) -> dict[str, Any]:
    """One case; ``paced``: as the frames come, not as fast as they are written."""
    raw = [encode(frame) for frame in frames]
    nothing = threading.Event()
    recorder = Recorder(path, lambda: SessionWriter(path, skin), None, lambda *_: None)
    worker = Worker(recorder, Capacity(MOST_WAITING, "oldest"), lambda *_: None)
    worker.start()
    _feed(worker, frames, raw, range(_BATCH))  # warm
    memory, processor, begun = resident(), time.process_time(), time.monotonic()
    count = 1 if paced else _BATCH
    for start in range(_BATCH, int(seconds * RATE), count):
        _feed(worker, frames, raw, range(start, start + count))
        if paced:
            nothing.wait(max(start / RATE - (time.monotonic() - begun), 0.0))
        while not paced and worker.taken < 2 * (start + count):
            nothing.wait(1e-3)
    used, grown = time.process_time() - processor, resident() - memory
    worker.end()
    worker.join()
    return {
        "seconds": seconds,
        "paced": "yes" if paced else "no",
        "frames/s": round(RATE),
        "MB": round(path.stat().st_size / 1e6),
        "% of a core": round(100 * used / seconds, 1),
        "growth MB": round(grown, 1),
        "left out": worker.left_out,
    }


def _feed(worker: Worker[Recorder], frames: list[Frame], raw: list[bytes], numbers: range) -> None:
    for number in numbers:
        frame = _at(frames, number, RATE)
        worker.put(RawRead(frame.host_time, raw[number % _KINDS]))
        worker.put(MarkedFrame(frame, Mark.NONE))


def of_length(path: Path, skin: Skin, frames: list[Frame], seconds: int) -> Path:
    """Write a session of ``seconds`` at HOUR_RATE; the path."""
    raw = [encode(frame) for frame in frames]
    with SessionWriter(path, skin) as session:
        for number in range(int(seconds * HOUR_RATE)):
            frame = _at(frames, number, HOUR_RATE)
            session.raw(frame.host_time, raw[number % _KINDS])
            session.frame(frame)
    return path


def opened(path: Path, seconds: int) -> dict[str, Any]:
    """How long it takes to open a session of ``seconds`` and to seek in it."""
    opening, sought = [], []
    for place in np.random.default_rng(SEED).uniform(0, seconds - 1, SEEKS):
        start = time.perf_counter()
        with SessionReader(path) as session:
            opening.append(1e3 * (time.perf_counter() - start))
            first = next(session.frames(since=place)).frame
            sought.append(1e3 * (time.perf_counter() - start))
        assert abs(first.host_time - place) <= 1 / HOUR_RATE
    return {
        "frames": int(seconds * HOUR_RATE),
        "MB": round(path.stat().st_size / 1e6),
        "open ms": round(statistics.median(opening), 1),
        "open and seek ms": round(statistics.median(sought), 1),
        "worst ms": round(max(sought), 1),
    }
