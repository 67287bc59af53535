"""Voltages with the drive and the measurement of each row → a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray, PatternError
from tomoskin.model.pattern import check_drives
from tomoskin.sensing.signal import Recording, frame_times


def voltages_of(
    source: str,
    voltages: NDArray[Any],
    rows: tuple[NDArray[Any], IntArray],
    *,
    time: FloatArray | None = None,
    reference: NDArray[Any] | None = None,
    labels: FloatArray | None = None,
    is_change: bool = False,
    notes: Sequence[str] = (),
) -> Recording:
    """A recording of voltages (n_frames, n_rows), or their change; ``rows``: drive and measure.

    Where there is no ``time`` (n_frames,), s, the frames are numbered.
    """
    drive, measure = rows
    return Recording(
        voltages=voltages,
        drive=drive,
        measure=measure,
        time=frame_times(len(voltages)) if time is None else time,
        reference=reference,
        labels=labels,
        is_change=is_change,
        source=source,
        notes=tuple(notes),
        timed=time is not None,
        board_known=False,
    )


def checked_currents(currents: NDArray[Any], what: str, source: str) -> None:
    """Raise DataError unless currents (n, n_electrodes) sum to zero and are not all zero."""
    try:
        check_drives(currents, currents.shape[1])
    except PatternError as error:
        where = (error.where or "").replace("drive row", what)
        raise DataError(error.message, where=f"{source}, {where}") from error
