"""Bytes in to touches out, per frame: p50 and p99 on one core."""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Iterator
from typing import Any

import numpy as np

from report import Report, clock, table
from tomoskin.board.source import Link, ScanSettings
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.twin import Press, open_twin

SKINS, CELLS, TIME_CONSTANTS = ("textile-disc-8", "textile-disc-16"), (660, 3000), ("0 s", "0.2 s")
BY_FIT = (1, 2, 3)
IDLE, PRESSED, REPEATS, FIT_REPEATS = 30, 60, 40, 10
SETTLED, SEED = 20, 1


def run() -> Iterator[Report]:
    rows = []
    for name, cells in ((name, cells) for name in SKINS for cells in CELLS):
        skin = Skin.load(name).altered({"mesh": {"cells": cells}})
        for filtered in TIME_CONSTANTS:
            rows.append(row(prepare(skin.altered({"inverse": {"time_constant": filtered}}))))
        fitted = prepare(skin.altered({"touch": {"method": "fit"}}))
        rows += [row(fitted, FIT_REPEATS, presses) for presses in BY_FIT]
    yield table(
        "bytes in → touches out",
        rows,
        f"{PRESSED * REPEATS} frames, {PRESSED * FIT_REPEATS} by fit, with presses of a twin "
        f"that go round by 5 mm a frame, seed {SEED}",
        f"{clock()[1]} of each",
        "decode, voltages, difference, touches by image or fit, tracking",
        "a picture that nobody looks at is not computed",
        "filter: the time constant of the Kalman filter over frames, 0 without it",
        "growth: allocated memory that stays, per frame",
    )


def row(prepared: Prepared, repeats: int = REPEATS, presses: int = 2) -> dict[str, Any]:
    """One case."""
    idle, pressed = _chunks(prepared, presses)
    prepared.warm_up()
    decoder, pipeline = Decoder(), Pipeline(prepared)
    taken, touches = _taken(decoder, pipeline, idle, pressed, repeats)
    p50, p99 = 1e3 * np.percentile(taken, (50, 99))
    return {
        "touches by": prepared.skin.touch.method,
        "presses": presses,
        "electrodes": prepared.pattern.n_electrodes,
        "triangles": len(prepared.mesh.cells),
        "rows": prepared.pattern.n_meas,
        "filter s": prepared.skin.inverse.time_constant,
        "bytes": len(pressed[0]),
        "p50 ms": round(p50, 3),
        "p99 ms": round(p99, 3),
        "max ms": round(1e3 * max(taken), 3),
        "touches": round(touches / len(taken), 2),
        "growth B/frame": round(_growth(decoder, pipeline, pressed), 1),
    }


def p50(prepared: Prepared, repeats: int) -> float:
    """Median of a frame, ms."""
    idle, pressed = _chunks(prepared, 2)
    taken, _ = _taken(Decoder(), Pipeline(prepared), idle, pressed, repeats)
    return 1e3 * float(np.median(taken))


def _taken(
    decoder: Decoder, pipeline: Pipeline, idle: list[bytes], pressed: list[bytes], repeats: int
) -> tuple[list[float], int]:
    """s of each frame after a first round, and how many touches there were."""
    now, _ = clock()
    for chunk in (*idle, *pressed):
        _one(decoder, pipeline, chunk)
    gc.collect()
    taken, touches = [], 0
    for chunk in pressed * repeats:
        start = now()
        touches += _one(decoder, pipeline, chunk)
        taken.append(now() - start)
    return taken, touches


def _one(decoder: Decoder, pipeline: Pipeline, chunk: bytes) -> int:
    count = 0
    for message in decoder.feed(chunk, time.monotonic()):
        assert isinstance(message, Frame)
        result = pipeline.push(message)
        count = len(result.touches) if result else 0
    return count


def _growth(decoder: Decoder, pipeline: Pipeline, chunks: list[bytes]) -> float:
    tracemalloc.start()
    for chunk in chunks * SETTLED:  # histories of some hundred frames fill
        _one(decoder, pipeline, chunk)
    before, _ = tracemalloc.get_traced_memory()
    for chunk in chunks * 5:
        _one(decoder, pipeline, chunk)
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return (after - before) / (5 * len(chunks))


def _chunks(prepared: Prepared, presses: int) -> tuple[list[bytes], list[bytes]]:
    """Encoded frames of an idle twin, then of one with so many presses that circle."""
    transport = open_twin(f"fast,seed={SEED}", prepared.skin)
    with Link(transport, prepared.scan, ScanSettings.of(prepared.skin)) as link:
        idle = _take(link, IDLE)
        pressed = []
        for step in range(PRESSED):
            turns = step / PRESSED + np.arange(presses) / presses
            places = (0.05 * np.exp(2j * np.pi * turns)).tolist()
            transport.set_presses(tuple(Press(p.real, p.imag, 4.0, 0.012) for p in places))
            pressed += _take(link, 2)[1:]
    return idle, pressed


def _take(link: Link, count: int) -> list[bytes]:
    frames: list[Frame] = []
    while len(frames) < count:
        frames += [item for item in link.poll(1.0) if isinstance(item, Frame)]
    return [encode(frame) for frame in frames[:count]]
