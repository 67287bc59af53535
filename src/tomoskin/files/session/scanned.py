"""What ``frame`` and ``time_s`` are in every table: frames of a session, numbered and timed; their
voltages, a block at a time, so that memory does not grow, or all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, Frame, IntArray, Mark, MarkedFrame, StrPath
from tomoskin.files.messages import DeformedFrame
from tomoskin.files.session.layout import RecordedTouches
from tomoskin.files.session.session_reader import (
    SessionReader,
    indexed_frames,
    reference_frames,
    tick_rate,
)
from tomoskin.model.pattern import Scan
from tomoskin.sensing.signal import Readout, Recording
from tomoskin.sensing.track import TouchedFrame


class ScannedFrame(NamedTuple):
    """A frame of the skin's scan: its ``number`` from 0, and the ``time`` it was scanned at, s."""

    number: int
    time: float
    item: MarkedFrame


def timed(items: Iterable[MarkedFrame], rate: float, scan: Scan) -> Iterator[ScannedFrame]:
    """Those of ``items`` that are of ``scan``, by a clock of ``rate`` Hz."""
    number, before = 0, -1
    first: Frame | None = None
    for item in items:
        frame = item.frame
        if len(frame.samples) != scan.n_samples:
            continue
        if first is None or frame.ticks <= before:
            first = frame  # the device's clock begins again
        before = frame.ticks
        # frames of one read have one host time, but not one tick
        yield ScannedFrame(number, first.host_time + (frame.ticks - first.ticks) / rate, item)
        number += 1


def scanned_frames(session: SessionReader, scan: Scan) -> Iterator[ScannedFrame]:
    """Frames of ``scan``; those of another are left out.

    Raises
    ------
    DataError
        At the end, when some that were written are missing.
    """
    read = 0

    def counted() -> Iterator[MarkedFrame]:
        nonlocal read
        for item in session.frames():
            read += 1
            yield item

    yield from timed(counted(), tick_rate(session), scan)
    if session.container.summary and read != (expected := indexed_frames(session)):
        raise DataError(
            f"is damaged: {expected} frames were written, but only {read} can be read",
            where=str(session.path),
        )


def scanned_touches(session: SessionReader) -> Iterator[TouchedFrame]:
    """(frame, time, touches) of the recorded touches; None and host time without their frame."""
    for number, time, touched in _scanned(session):
        yield number, time, touched.touches


def scanned_deformations(session: SessionReader) -> Iterator[DeformedFrame]:
    """(frame, time, deformation) as recorded; None where a deformation has ended."""
    for number, time, touched in _scanned(session):
        yield number, time, touched.deformation


def _scanned(session: SessionReader) -> Iterator[tuple[int | None, float, RecordedTouches]]:
    keys = {(item.host_time, item.sequence) for item in session.touches()}
    numbers: dict[tuple[float, int], tuple[int, float]] = {}
    for number, time, item in scanned_frames(session, _own_scan(session)) if keys else ():
        key = item.frame.host_time, item.frame.sequence  # they name a frame of a session
        if key in keys:
            numbers.setdefault(key, (number, time))
    for touched in session.touches():
        key = touched.host_time, touched.sequence
        yield *numbers.get(key, (None, touched.host_time)), touched


def first_scan(session: SessionReader) -> float:
    """Time of the recording's own first frame, on the clock of :func:`scanned_frames`; 0 without.

    The host's time of that frame differs by how late the host read it.
    """
    frames = scanned_frames(session, _own_scan(session))
    return next((frame.time for frame in frames if not frame.item.mark & Mark.EARLIER), 0.0)


def _own_scan(session: SessionReader) -> Scan:
    return Scan.of(session.skin.pattern())


def idle_count(session: SessionReader) -> int:
    """Frames of the first reference where the recording begins with it; 1 where it does not."""
    first = next(scanned_frames(session, _own_scan(session)), None)
    begins = first is not None and first.item.mark & Mark.REFERENCE
    return reference_frames(session.settings()) if begins else 1


Advance = Callable[[float, float], None]
"""Called with how much of how much is done."""


def no_report(_done: float, _total: float) -> None:
    """An :data:`Advance` for those who do not want to know."""


MOST_FRAMES = 2048
"""Frames of a block."""

_LISTED = 5
"""Frames that a note names."""


@dataclass(frozen=True, eq=False)
class Block:
    """Successive frames, one row each.

    ``number`` (n,) from the first in the file; ``time`` (n,) s when they were scanned and
    ``host_time`` (n,) when they were read, host monotonic; ``sequence``, ``ticks``, ``mark``
    (n,); ``samples`` (n, n_samples) counts; ``voltages`` (n, n_meas) V, NaN where a sample stood
    at a rail.
    """

    number: IntArray
    time: FloatArray
    host_time: FloatArray
    sequence: IntArray
    ticks: NDArray[np.uint64]
    mark: IntArray
    samples: NDArray[np.uint16]
    voltages: FloatArray


def all_blocks(session: SessionReader, advance: Advance = no_report) -> Iterator[Block]:
    """Every frame of the session's scan, in blocks; frames of another scan are left out.

    ``advance`` is called with how many frames of how many are done.

    Raises
    ------
    DataError
        When the file is damaged, frames that were written are missing, or there is none.
    """
    done, total, scan = 0, indexed_frames(session), _own_scan(session)
    readout, frames = Readout.of(scan, session.skin.readout), scanned_frames(session, scan)
    while some := list(islice(frames, MOST_FRAMES)):
        yield _block(some, readout)
        done += len(some)
        advance(done, max(done, total))
    if not done:
        but = f"; it {session.torn}" if session.torn else ""
        raise DataError(f"holds no frame of its skin{but}", where=str(session.path))


def read_session(path: StrPath) -> Recording:
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
    blocks, pattern = list(all_blocks(session)), session.skin.pattern()
    positions = press_positions(session)
    n_frames = sum(len(block.number) for block in blocks)
    return Recording(
        voltages=np.concatenate([block.voltages for block in blocks]),
        drive=pattern.drive,
        measure=pattern.measure,
        time=np.concatenate([block.time for block in blocks]),
        reference=None,
        labels=None if positions is None else np.concatenate(list(map(positions, blocks))),
        is_change=False,
        source=str(session.path),
        notes=_notes(session, blocks),
        idle=min(idle_count(session), n_frames),
    )


def _notes(session: SessionReader, blocks: list[Block]) -> tuple[str, ...]:
    """What is missing at the end, and where the board's clock did not go on."""
    notes = [f"the file {session.torn}"] if session.torn else []
    ticks = np.concatenate([block.ticks for block in blocks]).astype(np.int64)
    again = 1 + np.flatnonzero(np.diff(ticks) <= 0)
    if len(again):
        listed = ", ".join(map(str, again[:_LISTED].tolist()))
        more = ", …" if len(again) > _LISTED else ""
        notes.append(
            f"the board's clock does not go on in {len(again)} frames: {listed}{more}; each counts "
            "from when it was read"
        )
    return tuple(notes)


def press_positions(session: SessionReader) -> Callable[[Block], FloatArray] | None:
    """Gives (n, 2) m, where exactly one press was on the twin in each frame of a block, else NaN.

    None where the file holds no truth.
    """
    truth = list(session.truth())
    if not truth:
        return None
    positions = np.full((len(truth) + 1, 2), np.nan)
    for number, item in enumerate(truth, start=1):
        if len(item.presses) == 1:
            [press] = item.presses
            positions[number] = float(press["x"]), float(press["y"])
    changes = np.array([item.host_time for item in truth])
    return lambda block: positions[np.searchsorted(changes, block.host_time, side="right")]


def _block(items: list[ScannedFrame], readout: Readout) -> Block:
    frames = [item.frame for _, _, item in items]
    samples = np.stack([frame.samples for frame in frames])
    given = [frame.sums for frame in frames if frame.sums is not None]
    sums = np.stack(given) if len(given) == len(frames) else None
    volts, railed = readout.rows(samples, sums)
    volts[railed] = np.nan
    return Block(
        number=np.array([number for number, _, _ in items]),
        time=np.array([time for _, time, _ in items]),
        host_time=np.array([frame.host_time for frame in frames]),
        sequence=np.array([frame.sequence for frame in frames]),
        ticks=np.array([frame.ticks for frame in frames], dtype=np.uint64),
        mark=np.array([int(item.mark) for _, _, item in items]),
        samples=samples,
        voltages=volts,
    )
