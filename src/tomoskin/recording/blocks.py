"""Frames of a session as voltages, some thousand at a time: memory does not grow with the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.pattern import Pattern, Scan
from tomoskin.recording.layout import MarkedFrame
from tomoskin.recording.session_reader import SessionReader
from tomoskin.signal import Readout

Advance = Callable[[float, float], None]
"""Told how much of how much is done."""


def _silent(_done: float, _total: float) -> None:
    pass


MOST_FRAMES = 2048
"""Frames of a block."""


@dataclass(frozen=True, eq=False)
class Block:
    """Successive frames, one row each.

    ``number`` (n,) from the first in the file; ``time`` (n,) host monotonic s; ``sequence``,
    ``ticks``, ``mark`` (n,); ``samples`` (n, n_samples) counts; ``voltages`` (n, n_meas) V, NaN
    where a sample stood at a rail.
    """

    number: IntArray
    time: FloatArray
    sequence: IntArray
    ticks: NDArray[np.uint64]
    mark: IntArray
    samples: NDArray[np.uint16]
    voltages: FloatArray


@dataclass(frozen=True, eq=False)
class Rows:
    """What the columns of the voltages are: the pattern, and how counts become volts."""

    pattern: Pattern
    readout: Readout

    @classmethod
    def of(cls, session: SessionReader) -> Rows:
        """Rows of a session's own skin."""
        pattern = session.skin.pattern()
        return cls(pattern, Readout.of(Scan.of(pattern), session.skin.readout))

    def voltages(self, samples: NDArray[np.uint16]) -> FloatArray:
        """(n, n_meas) V of (n, n_samples) counts, as the read-out gives them frame by frame."""
        plus, minus = self.readout.scan.plus, self.readout.scan.minus
        counts = samples.astype(np.float64)
        at_rail = (counts <= self.readout.low) | (counts >= self.readout.high)
        volts = (counts[:, plus] - counts[:, minus]) * self.readout.volts_per_count
        volts[at_rail[:, plus] | at_rail[:, minus]] = np.nan
        return np.asarray(volts)


def all_blocks(session: SessionReader, rows: Rows, advance: Advance = _silent) -> Iterator[Block]:
    """Every frame of the session's scan, in blocks; frames of another scan are left out.

    ``advance`` is told how many frames of how many are done.

    Raises
    ------
    DataError
        When the file is damaged, frames that were written are missing, or there is none.
    """
    done = 0
    for block in _blocks(session, rows):
        yield block
        done += len(block.number)
        advance(done, max(done, session.n_frames))
    if not done:
        but = f"; it {session.torn}" if session.torn else ""
        raise DataError(f"holds no frame of its skin{but}", where=str(session.path))


def _blocks(session: SessionReader, rows: Rows) -> Iterator[Block]:
    n_samples = rows.readout.scan.n_samples
    waiting: list[tuple[int, MarkedFrame]] = []
    for number, item in enumerate(session.counted_frames()):
        if len(item.frame.samples) == n_samples:
            waiting.append((number, item))
        if len(waiting) == MOST_FRAMES:
            yield _block(waiting, rows)
            waiting = []
    if waiting:
        yield _block(waiting, rows)


def _block(items: list[tuple[int, MarkedFrame]], rows: Rows) -> Block:
    frames = [item.frame for _, item in items]
    samples = np.stack([frame.samples for frame in frames])
    return Block(
        number=np.array([number for number, _ in items]),
        time=np.array([frame.host_time for frame in frames]),
        sequence=np.array([frame.sequence for frame in frames]),
        ticks=np.array([frame.ticks for frame in frames], dtype=np.uint64),
        mark=np.array([int(item.mark) for _, item in items]),
        samples=samples,
        voltages=rows.voltages(samples),
    )
