"""Recording at 1,000 frames/s, opening and seeking an hour, exporting it to Parquet."""

from __future__ import annotations

import os
import statistics
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from report import Report
from tomoskin.board.wire import encode
from tomoskin.core import Frame, Mark, MarkedFrame
from tomoskin.files.exports import write_parquet
from tomoskin.files.session import (
    RawRead,
    Recorder,
    SessionReader,
    SessionWriter,
)
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.run.sinks import Capacity, Worker

SKIN = "textile-disc-16"
RATE = 1000.0
LONG, PACED = 600, 20
"""Seconds recorded: as fast as they are written, and at their own rate."""

HOUR, HOUR_RATE = 3600, 100.0
SEED, SEEKS = 1, 40
MOST_WAITING = 64 << 20
"""Bytes that may wait for the disk, as in a run."""
RECORDED = ("seconds", "frames/s", "MB", "% of a core", "growth MB", "left out")
OPENED = ("frames", "MB", "open ms", "open and seek ms", "worst ms")
_BATCH = 200
_KINDS = 500
"""Different frames; they are sent again and again with new numbers and times."""


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
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
        found = opened(hour, HOUR)
        exported = _exported(hour, place / "hour.parquet")
    size = encode(frames[0]), Scan.of(skin.pattern()).n_samples
    return (
        Report(
            "recording raw bytes and frames beside a pipeline",
            RECORDED,
            rows,
            (
                f"{SKIN}: {size[1]} samples, {len(size[0])} bytes a frame, seed {SEED}",
                "processor time of both threads by the seconds recorded; growth of the process",
                "the first row is not paced: what is written in one batch waits for the disk",
            ),
        ),
        Report(
            "a session of one hour",
            (*OPENED, "Parquet s", "Parquet MB"),
            ((*found, *exported),),
            (f"{HOUR_RATE:.0f} frames/s of {SKIN}, {SEEKS} random places, seed {SEED}",),
        ),
    )


def frames_of(skin: Skin) -> list[Frame]:
    rng = np.random.default_rng(SEED)
    n = Scan.of(skin.pattern()).n_samples
    samples = rng.integers(200, 3000, (_KINDS, n)).astype("<u2")
    return [Frame(0, 0, 0.0, 0x1A2B, 0, 0, row) for row in samples]


def _at(frames: list[Frame], number: int, rate: float) -> Frame:
    frame = frames[number % _KINDS]
    return replace(
        frame, sequence=number, ticks=round(number * 16e6 / rate), host_time=number / rate
    )


def recorded(
    path: Path, skin: Skin, frames: list[Frame], seconds: int, *, paced: bool
) -> tuple[object, ...]:
    """Values under ``RECORDED``; ``paced``: as the frames come, not as fast as they are written."""
    raw = [encode(frame) for frame in frames]
    nothing = threading.Event()
    recorder = Recorder(path, lambda: SessionWriter(path, skin), None, lambda *_: None)
    worker = Worker(recorder, Capacity(MOST_WAITING, "oldest"), lambda *_: None)
    worker.start()
    _feed(worker, frames, raw, range(_BATCH))  # warm
    memory, processor, begun = _resident(), time.process_time(), time.monotonic()
    for start in range(_BATCH, int(seconds * RATE), _BATCH if not paced else 1):
        count = _BATCH if not paced else 1
        _feed(worker, frames, raw, range(start, start + count))
        if paced:
            ahead = start / RATE - (time.monotonic() - begun)
            if ahead > 0:
                nothing.wait(ahead)
        else:
            while worker.taken < 2 * (start + count):
                nothing.wait(1e-3)
    used = time.process_time() - processor
    grown = _resident() - memory
    worker.end()
    worker.join()
    size = path.stat().st_size / 1e6
    share = round(100 * used / seconds, 1)
    return seconds, round(RATE), round(size), share, round(grown, 1), worker.left_out


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


def opened(path: Path, seconds: int) -> tuple[object, ...]:
    """Values under ``OPENED``, of a session of ``seconds``."""
    rng = np.random.default_rng(SEED)
    first_look, sought = [], []
    for place in rng.uniform(0, seconds - 1, SEEKS):
        start = time.perf_counter()
        with SessionReader(path) as session:
            first_look.append(time.perf_counter() - start)
            first = next(session.frames(since=place)).frame
            sought.append(time.perf_counter() - start)
        assert abs(first.host_time - place) <= 1 / HOUR_RATE
    times = [1e3 * value for value in (statistics.median(first_look), statistics.median(sought))]
    worst = 1e3 * max(sought)
    size = round(path.stat().st_size / 1e6)
    return int(seconds * HOUR_RATE), size, *(round(t, 1) for t in (*times, worst))


def _exported(path: Path, target: Path) -> tuple[object, ...]:
    start = time.perf_counter()
    with SessionReader(path) as session:
        write_parquet(target, session, lambda _done, _total: None)
    return round(time.perf_counter() - start, 1), round(target.stat().st_size / 1e6)


def _resident() -> float:
    """Resident memory, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
