"""How fast a host decodes frames, against the fastest stream that a board can send."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from report import Report, clock, table
from tomoskin.board.wire import Decoder, PackedFrame, encode
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan

BAUD, READ = 1_000_000, 4096
"""Bits a second, and bytes that a read brings at most, as from a serial port."""

FRAMES, REPEATS, SEED = 20_000, 5, 1


def run() -> Iterator[Report]:
    rows = [row(n, packed) for n in (8, 16) for packed in (False, True)]
    yield table(
        "decoding a stream of frames",
        rows,
        f"best of {REPEATS} over {FRAMES} frames in reads of {READ} bytes, {clock()[1]}, "
        f"seed {SEED}; samples of one conversion, in 16 or packed in 10 bits",
        f"line: what {BAUD / 1e6:g} Mbaud can carry at 10 bits a byte, more than any scan of "
        "the board fills",
    )


def row(electrodes: int, packed: bool) -> dict[str, Any]:
    """One case."""
    random = np.random.default_rng(SEED)
    n = Scan.of(Pattern.adjacent(electrodes)).n_samples
    counts = random.integers(0, 1024, (FRAMES, n)).astype(np.uint16)
    frames = [Frame(k, 1000 * k, 0.0, 7, 0, 0, counts[k]) for k in range(FRAMES)]
    stream = b"".join(encode(PackedFrame.of(f) if packed else f) for f in frames)
    reads = [stream[at : at + READ] for at in range(0, len(stream), READ)]
    rate = FRAMES / min(_seconds(reads) for _ in range(REPEATS))
    size = len(stream) / FRAMES
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
    assert decoder.counters.messages == FRAMES
    return took
