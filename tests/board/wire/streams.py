"""Mutated streams for the host's parser; ``python tests/board/wire/streams.py 1000000``."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame

BATCH = 10_000
ODDS = 2.0**-16
"""Of a corrupt block whose checksum fits by chance."""

_SAMPLES = 24
_KINDS = 9


@dataclass
class Tally:
    """What became of the streams.

    ``corrupt``: blocks whose checksum was looked at and wrong; ``wrong``: frames that were not sent
    and yet accepted; ``short``: frames of another number of samples, which the link refuses (a
    checksum that ends in 0x00 does not notice when a line loses just that); ``late``: streams of
    which the second frame behind the mutated one was missing.
    """

    streams: int = 0
    corrupt: int = 0
    wrong: int = 0
    short: int = 0
    late: int = 0

    @property
    def expected(self) -> float:
        """Wrong frames by the checksum's odds."""
        return self.corrupt * ODDS


def fuzz(streams: int, seed: int) -> Tally:
    """A mutated frame and two whole ones, ``streams`` times; nothing may raise."""
    tally = Tally()
    random = np.random.default_rng(seed)
    while tally.streams < streams:
        _run_batch(tally, random, min(BATCH, streams - tally.streams))
    return tally


def _run_batch(tally: Tally, random: np.random.Generator, count: int) -> None:
    first, second = _frame(random, 1), _frame(random, 2)
    behind = encode(first) + encode(second)
    known = {1: first.samples.tobytes(), 2: second.samples.tobytes()}
    decoder = Decoder()
    for frame, line in _mutated(random, count):
        known[0] = frame.samples.tobytes()
        got = decoder.feed(line + behind, 0.0)
        frames = [(m.sequence, m.samples.tobytes()) for m in got if isinstance(m, Frame)]
        tally.wrong += len(got) - len(frames)
        whole = [item for item in frames if len(item[1]) == 2 * _SAMPLES]
        tally.short += len(frames) - len(whole)
        tally.wrong += sum(known.get(sequence) != samples for sequence, samples in whole)
        tally.late += not frames or frames[-1] != (2, known[2])
    tally.streams += count
    tally.corrupt += decoder.counters.checksum


def _frame(random: np.random.Generator, sequence: int) -> Frame:
    samples = random.integers(0, 1024, _SAMPLES).astype(np.uint16)
    return Frame(sequence, int(random.integers(2**40)), 0.0, 0xBEEF, 0, 0, samples)


def _mutated(random: np.random.Generator, count: int) -> Iterator[tuple[Frame, bytes]]:
    """Frames and what a line has made of them; all chances are drawn at once."""
    kinds = random.integers(0, _KINDS, count).tolist()
    places = random.random((count, 3)).tolist()
    noise = random.bytes(64 * count)
    frame, block = _frame(random, 0), b""
    for number, (kind, (at, to, much)) in enumerate(zip(kinds, places, strict=True)):
        if number % 100 == 0:
            frame = _frame(random, 0)
            block = encode(frame, packed=bool(number % 200))
        dirt = noise[64 * number : 64 * number + 1 + int(much * 63)]
        yield frame, _mutate(block, kind, int(at * len(block)), int(to * len(block)), dirt)


def _mutate(block: bytes, kind: int, at: int, to: int, dirt: bytes) -> bytes:
    low, high = min(at, to), max(at, to)
    bit = bytes((block[at] ^ (1 << dirt[0] % 8),))
    samples = bytes(b or 1 for b in dirt)[: len(block) - 2]
    return (
        block[:at] + bit + block[at + 1 :],
        block[:at] + dirt + block[at + len(dirt) :],
        block[:at] + dirt + block[at:],
        block[:low] + block[high:],
        block[:low] + block[low:high] + block[low:],
        block[high:] + block[low:high] + block[:low],
        block[:at] + b"\0" + block[at:],
        dirt.replace(b"\0", b"\1") + b"\0",
        block[:1] + samples + block[1 + len(samples) :],
    )[kind]


def main() -> None:
    """Fuzz as often as is asked, and say what became of it."""
    streams, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    began = time.monotonic()
    tally = fuzz(streams, seed)
    took = time.monotonic() - began
    sys.stdout.write(
        f"host parser: {tally.streams:,} mutated streams in {took:.0f} s (seed {seed}), "
        f"{tally.corrupt:,} wrong checksums, {tally.wrong} wrong frames accepted "
        f"({tally.expected:.1f} expected), {tally.short} of another length refused, "
        f"{tally.late} resynchronised late\n"
    )
    sys.exit(bool(tally.late))


if __name__ == "__main__":
    main()
