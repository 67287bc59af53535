"""Recording at 1,000 frames/s, opening and seeking an hour."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from report import Report, resident, table
from tomoskin.board.wire import encode
from tomoskin.core import Capacity, Frame, Mark, MarkedFrame, Worker
from tomoskin.files.session import RawRead, Recorder, SessionReader, SessionWriter
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin

SKIN, RATE, SECONDS = "textile-disc-16", 1000.0, 20
HOUR, HOUR_RATE = 3600, 100.0
SEED, SEEKS = 1, 40
MOST_WAITING = 50_000
"""Messages that may wait for the disk, as in a run."""

_WARM, _KINDS = 2000, 500
"""Frames before what counts; different frames, which come again and again."""


def run() -> Iterator[Report]:
    skin = Skin.load(SKIN)
    frames = frames_of(skin)
    with tempfile.TemporaryDirectory() as folder:
        row = recorded(Path(folder) / "paced.mcap", skin, frames, SECONDS)
        hour = opened(of_length(Path(folder) / "hour.mcap", skin, frames, HOUR), HOUR)
    yield table(
        "recording raw bytes and frames beside a pipeline",
        [row],
        f"{SKIN}, seed {SEED}; processor time of the whole process, which also makes the frames, "
        "by the seconds recorded; growth of the process",
    )
    yield table(
        "a session of one hour",
        [hour],
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


def recorded(path: Path, skin: Skin, frames: list[Frame], seconds: int) -> dict[str, Any]:
    """So many seconds, frame by frame at their own pace."""
    raw = [encode(frame) for frame in frames]
    recorder = Recorder(path, lambda: SessionWriter(path, skin), None, lambda *_: None)
    worker = Worker(recorder, Capacity(MOST_WAITING, "oldest"), lambda *_: None)
    worker.start()
    memory = processor = begun = 0.0
    for number in range(int(seconds * RATE)):
        if number == _WARM:
            memory, processor, begun = resident(), time.process_time(), time.monotonic()
        frame = _at(frames, number, RATE)
        worker.put(RawRead(frame.host_time, raw[number % _KINDS]))
        worker.put(MarkedFrame(frame, Mark.NONE))
        if number >= _WARM:
            time.sleep(max(number / RATE - (time.monotonic() - begun), 0.0))
    used, grown = time.process_time() - processor, resident() - memory
    worker.end()
    worker.join()
    return {
        "seconds": seconds,
        "frames/s": round(RATE),
        "MB": round(path.stat().st_size / 1e6),
        "% of a core": round(100 * used / seconds, 1),
        "growth MB": round(grown, 1),
        "left out": worker.left_out,
    }


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
