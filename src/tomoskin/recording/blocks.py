"""Frames of a session as voltages: a block at a time, so that memory does not grow, or all."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.pattern import Pattern, Scan
from tomoskin.recording.layout import Mark, MarkedFrame
from tomoskin.recording.session_reader import SessionReader, indexed_frames, tick_rate
from tomoskin.signal import Readout, Recording

Advance = Callable[[float, float], None]
"""Called with how much of how much is done."""


def no_report(_done: float, _total: float) -> None:
    """An :data:`Advance` for those who do not want to know."""


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


def all_blocks(session: SessionReader, rows: Rows, advance: Advance = no_report) -> Iterator[Block]:
    """Every frame of the session's scan, in blocks; frames of another scan are left out.

    ``advance`` is called with how many frames of how many are done.

    Raises
    ------
    DataError
        When the file is damaged, frames that were written are missing, or there is none.
    """
    done, total = 0, indexed_frames(session)
    for block in _blocks(session, rows):
        yield block
        done += len(block.number)
        advance(done, max(done, total))
    if not done:
        but = f"; it {session.torn}" if session.torn else ""
        raise DataError(f"holds no frame of its skin{but}", where=str(session.path))


def read_session(path: Path) -> Recording:
    """All frames of a session file as voltages; see :func:`recording_of`."""
    with SessionReader(path) as session:
        return recording_of(session)


def recording_of(session: SessionReader) -> Recording:
    """All frames as voltages in the order of the skin's pattern.

    Frames of another scan are left out. A measurement at a rail of the converter is NaN.
    ``labels`` are there when the file holds truth: the position of the press where there was
    exactly one, else NaN. ``idle`` are the frames that the run took its first reference from.

    Raises
    ------
    DataError
        When the file is damaged, no frame is in it, or some that were written are missing.
    """
    rows = Rows.of(session)
    blocks = list(all_blocks(session, rows))
    read = np.concatenate([block.time for block in blocks])
    ticks = np.concatenate([block.ticks for block in blocks])
    return Recording(
        voltages=np.concatenate([block.voltages for block in blocks]),
        drive=rows.pattern.drive,
        measure=rows.pattern.measure,
        time=_scan_times(read, ticks, tick_rate(session)),
        reference=None,
        labels=_labels(session, read),
        is_change=False,
        source=str(session.path),
        notes=(f"the file {session.torn}",) if session.torn else (),
        idle=_idle(session, blocks[0].mark),
    )


def _blocks(session: SessionReader, rows: Rows) -> Iterator[Block]:
    n_samples = rows.readout.scan.n_samples
    waiting: list[tuple[int, MarkedFrame]] = []
    for number, item in enumerate(_counted_frames(session)):
        if len(item.frame.samples) == n_samples:
            waiting.append((number, item))
        if len(waiting) == MOST_FRAMES:
            yield _block(waiting, rows)
            waiting = []
    if waiting:
        yield _block(waiting, rows)


def _counted_frames(session: SessionReader) -> Iterator[MarkedFrame]:
    """All frames; DataError at the end when some that were written are missing."""
    count, expected = 0, indexed_frames(session)
    for count, item in enumerate(session.frames(), start=1):  # noqa: B007
        yield item
    if session.container.summary and count != expected:
        raise DataError(
            f"is damaged: {expected} frames were written, {count} are there",
            where=str(session.path),
        )


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


def _scan_times(read: FloatArray, ticks: NDArray[np.uint64], rate: float) -> FloatArray:
    """When each frame was scanned, s: frames of one read have one host time, but not one tick.

    Where the device's clock does not go on throughout, when they were read.
    """
    if not (ticks[1:] > ticks[:-1]).all():
        return read
    return np.asarray(read[0] + (ticks - ticks[0]) / rate)


def _idle(session: SessionReader, marks: IntArray) -> int:
    """Frames of the first reference, where the recording begins with it."""
    needed = session.settings().get("reference_frames", 1)
    begins = bool(marks[0] & Mark.REFERENCE) and isinstance(needed, int)
    return max(1, min(needed, len(marks))) if begins else 1


def _labels(session: SessionReader, time: FloatArray) -> FloatArray | None:
    truth = list(session.truth())
    if not truth:
        return None
    positions = np.full((len(truth) + 1, 2), np.nan)
    for number, item in enumerate(truth, start=1):
        if len(item.presses) == 1:
            [press] = item.presses
            positions[number] = float(press["x"]), float(press["y"])
    changes = np.array([item.host_time for item in truth])
    return positions[np.searchsorted(changes, time, side="right")]
