"""Bytes in to touches out, per frame: p50 and p99 on one core."""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Iterator
from typing import Any

import numpy as np

from bench_rig import Rig
from report import Report, clock, table
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.twin import Press

SKINS, CELLS, TIME_CONSTANTS = ("textile-disc-8", "textile-disc-16"), (660, 3000), ("0 s", "0.2 s")
IDLE, PRESSED, REPEATS, FIT_REPEATS = 30, 60, 40, 10
SETTLED, SEED, BY_FIT = 20, 1, (1, 2, 3)


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
        "filter: the time constant of the Kalman filter over frames; growth: memory that stays",
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
    rig, pressed = Rig(prepared.skin, "textile", SEED), []
    idle = [encode(rig.frame()) for _ in range(IDLE)]
    for step in range(PRESSED):
        places = (
            0.05 * np.exp(2j * np.pi * (step / PRESSED + np.arange(presses) / presses))
        ).tolist()
        pressed.append(encode(rig.frame(Press(p.real, p.imag, 4.0, 0.012) for p in places)))
    return idle, pressed


BAUD, READ = 1_000_000, 4096
"""Bits a second, and bytes that a read brings at most, as from a serial port."""

STREAMED, DECODINGS = 20_000, 5


def run_wire() -> Iterator[Report]:
    """How fast a host decodes frames, against the fastest stream that a board can send."""
    rows = [wire_row(n, packed) for n in (8, 16) for packed in (False, True)]
    yield table(
        "decoding a stream of frames",
        rows,
        f"best of {DECODINGS} over {STREAMED} frames in reads of {READ} bytes, {clock()[1]}, "
        f"seed {SEED}; samples of one conversion, in 16 or packed in 10 bits",
        f"line: what {BAUD / 1e6:g} Mbaud can carry at 10 bits a byte, more than any scan of "
        "the board fills",
    )


def wire_row(electrodes: int, packed: bool) -> dict[str, Any]:
    """One case."""
    random = np.random.default_rng(SEED)
    n = Scan.of(Pattern.adjacent(electrodes)).n_samples
    counts = random.integers(0, 1024, (STREAMED, n)).astype(np.uint16)
    frames = [Frame(k, 1000 * k, 0.0, 7, 0, 0, counts[k]) for k in range(STREAMED)]
    stream = b"".join(encode(f, packed=packed) for f in frames)
    reads = [stream[at : at + READ] for at in range(0, len(stream), READ)]
    rate = STREAMED / min(_seconds(reads) for _ in range(DECODINGS))
    size = len(stream) / STREAMED
    line = BAUD / 10 / size
    return {
        "electrodes": electrodes,
        "samples": f"{n} of {'10 bits' if packed else '16 bits'}",
        "bytes": round(size),
        "line frames/s": round(line),
        "decoded frames/s": round(rate),
        "times": round(rate / line),
    }


def _seconds(reads: list[bytes]) -> float:
    decoder, (now, _) = Decoder(), clock()
    began = now()
    for data in reads:
        decoder.feed(data, 0.0)
    took = now() - began
    assert decoder.counters.messages == STREAMED
    return took
