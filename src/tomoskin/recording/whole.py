"""A session whole in memory: its frames as a recording, with the places of the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.recording.blocks import Rows, all_blocks
from tomoskin.recording.layout import Mark
from tomoskin.recording.session_reader import SessionReader
from tomoskin.signal import Recording


def read_session(path: Path) -> Recording:
    """All frames of a session file as voltages; see :func:`recording_of`."""
    with SessionReader(path) as session:
        return recording_of(session)


def recording_of(session: SessionReader) -> Recording:
    """All frames as voltages in the order of the skin's pattern.

    Frames of another scan are left out. A row at a rail of the converter is NaN. ``labels`` are
    there when the file holds truth: the place of the press where there was exactly one, else NaN.
    ``idle`` are the frames that the run took its first reference from.

    Raises
    ------
    DataError
        When the file is damaged, no frame is in it, or some that were written are missing.
    """
    rows = Rows.of(session)
    found = list(all_blocks(session, rows))
    read = np.concatenate([block.time for block in found])
    ticks = np.concatenate([block.ticks for block in found])
    return Recording(
        voltages=np.concatenate([block.voltages for block in found]),
        drive=rows.pattern.drive,
        measure=rows.pattern.measure,
        time=_scanned(read, ticks, session.tick_rate),
        reference=None,
        labels=_labels(session, read),
        is_change=False,
        source=str(session.path),
        notes=(f"the file {session.torn}",) if session.torn else (),
        idle=_idle(session, found[0].mark),
    )


def _scanned(read: FloatArray, ticks: NDArray[np.uint64], rate: float) -> FloatArray:
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
    places = np.full((len(truth) + 1, 2), np.nan)
    for number, item in enumerate(truth, start=1):
        if len(item.presses) == 1:
            places[number] = _place(item.presses[0])
    changes = np.array([item.host_time for item in truth])
    return places[np.searchsorted(changes, time, side="right")]


def _place(press: dict[str, Any]) -> tuple[float, float]:
    return float(press["x"]), float(press["y"])
