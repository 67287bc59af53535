"""How fast a host decodes frames, against the fastest stream that a board can send."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from forward_cases import clock
from report import Report
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan

BAUD = 1_000_000
READ = 4096
"""Bytes that a read brings at most, as from a serial port."""
FRAMES, REPEATS, SEED = 20_000, 5, 1
COLUMNS = ("electrodes", "samples", "bytes", "line frames/s", "decoded frames/s", "times")


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
    rows = tuple(row(n, packed) for n in (8, 16) for packed in (False, True))
    return (
        Report(
            "decoding a stream of frames",
            COLUMNS,
            rows,
            (
                f"best of {REPEATS} over {FRAMES} frames in reads of {READ} bytes, {clock()[1]}, "
                f"seed {SEED}; samples of one conversion, in 16 or packed in 10 bits",
                f"line: what {BAUD / 1e6:g} Mbaud can carry at 10 bits a byte, more than any scan "
                "of the board fills",
            ),
        ),
    )


def row(electrodes: int, packed: bool) -> tuple[object, ...]:
    """Values under ``COLUMNS``."""
    random = np.random.default_rng(SEED)
    n = Scan.of(Pattern.adjacent(electrodes)).n_samples
    counts = random.integers(0, 1024, (FRAMES, n)).astype(np.uint16)
    frames = [Frame(k, 1000 * k, 0.0, 7, 0, 0, counts[k]) for k in range(FRAMES)]
    blocks = [encode(f, packed=packed) for f in frames]
    stream = b"".join(blocks)
    reads = [stream[at : at + READ] for at in range(0, len(stream), READ)]
    rate = FRAMES / min(_seconds(reads) for _ in range(REPEATS))
    size = len(stream) / FRAMES
    line = BAUD / 10 / size
    kind = "10 bits" if packed else "16 bits"
    return (
        electrodes,
        f"{n} of {kind}",
        round(size),
        round(line),
        round(rate),
        round(rate / line),
    )


def _seconds(reads: list[bytes]) -> float:
    decoder, (now, _) = Decoder(), clock()
    began = now()
    for data in reads:
        decoder.feed(data, 0.0)
    took = now() - began
    assert decoder.counters.messages == FRAMES
    return took
