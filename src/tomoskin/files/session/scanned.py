"""What ``frame`` and ``time_s`` are in every table: frames of a session, numbered and timed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import NamedTuple

from tomoskin.core import DataError, Frame, Mark, MarkedFrame
from tomoskin.files.session.session_reader import (
    SessionReader,
    indexed_frames,
    reference_frames,
    tick_rate,
)
from tomoskin.model.pattern import Scan
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


FrameKey = tuple[float, int]
"""Host time and sequence: they name a frame of a session."""


def frame_numbers(
    session: SessionReader, keys: Collection[FrameKey]
) -> dict[FrameKey, tuple[int, float]]:
    """Number and time of the frames of those ``keys``; without those that are not in the file."""
    numbers: dict[FrameKey, tuple[int, float]] = {}
    scan = Scan.of(session.skin.pattern())
    for number, time, item in scanned_frames(session, scan) if keys else ():
        key = item.frame.host_time, item.frame.sequence
        if key in keys:
            numbers.setdefault(key, (number, time))
    return numbers


def scanned_touches(session: SessionReader) -> Iterator[TouchedFrame]:
    """(frame, time, touches) of the recorded touches; None and host time without their frame."""
    keys = {(item.host_time, item.sequence) for item in session.touches()}
    numbers = frame_numbers(session, keys)
    for touched in session.touches():
        key = touched.host_time, touched.sequence
        yield *numbers.get(key, (None, touched.host_time)), touched.touches


def first_scan(session: SessionReader) -> float:
    """Time of the recording's own first frame, on the clock of :func:`scanned_frames`; 0 without.

    The host's time of that frame differs by how late the host read it.
    """
    frames = scanned_frames(session, Scan.of(session.skin.pattern()))
    return next((frame.time for frame in frames if not frame.item.mark & Mark.EARLIER), 0.0)


def idle_count(session: SessionReader, scan: Scan) -> int:
    """Frames of the first reference where the recording begins with it; 1 where it does not."""
    first = next(scanned_frames(session, scan), None)
    begins = first is not None and first.item.mark & Mark.REFERENCE
    return reference_frames(session.settings()) if begins else 1
