"""A sheet's serial log with reboots and torn lines: time, load, board time, 16 values in mV.

``time_pc [s],Mass [g],time_mcu[ms],data [mV]`` (19 fields, perhaps an empty one behind). A line
with ``A`` in place of the values begins a frame; 16 lines follow, one a drive, each with the
voltages of the 16 neighbouring pairs, its driven pair at its own place. The signs are those of
a uniform disc after the amplifier's offset (about 0.1 V), which the log does not give and which
leaves with a difference. A frame counts when its 16 lines follow each other without a break.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tomoskin.core import DataError
from tomoskin.files.imports.tables import adjacent_scan, voltages_of
from tomoskin.files.imports.text_log import Skipped, numbers_in
from tomoskin.sensing.signal import Recording

_N = 16
_FIELDS = 3 + _N
_HEADER = "time_pc"
_MILLI = 1e-3
_LONGEST_STEP = 1.0
"""Seconds of the board's clock between two lines of one frame; more is another frame's."""


@dataclass(frozen=True)
class _Row:
    line: int
    pc_time: float
    board_time: float
    values: list[float]


def detects(lines: list[str]) -> bool:
    """Whether the header is there."""
    return any(line.strip().startswith(_HEADER) for line in lines)


def parse(lines: Iterable[str], source: str) -> Recording:
    """Return the recording of the whole frames; every other line is in its notes.

    Raises
    ------
    DataError
        When no frame is whole.
    """
    skipped = Skipped()
    frames: list[list[_Row]] = []
    rows: list[_Row] | None = None
    for number, line in enumerate(lines, start=1):
        if _begins(line):
            _drop(rows, skipped)
            rows = []
        elif (row := _row(number, line)) is None:
            if line.strip():
                skipped.add(number, "no measurements")
                _drop(rows, skipped)
                rows = None
        elif rows is None:
            skipped.add(number, "parts of incomplete frames")
        elif rows and not 0 < row.board_time - rows[-1].board_time < _LONGEST_STEP:
            _drop([*rows, row], skipped)
            rows = None
        else:
            rows.append(row)
            if len(rows) == _N:
                frames.append(rows)
                rows = None
    _drop(rows, skipped)
    if not frames:
        raise DataError(f"holds no complete frame of {_N} lines", where=source)
    return _recording(frames, skipped, source)


def _recording(frames: list[list[_Row]], skipped: Skipped, source: str) -> Recording:
    rows, used = adjacent_scan(_N)
    values = np.array([[value for row in frame for value in row.values] for frame in frames])
    return voltages_of(
        source,
        _MILLI * values[:, used],
        rows,
        time=np.array([frame[0].pc_time for frame in frames]),
        notes=skipped.notes(),
    )


def _begins(line: str) -> bool:
    parts = line.split(",")
    return len(parts) > 2 and parts[2].strip() == "A" and not any(p.strip() for p in parts[3:])


def _row(number: int, line: str) -> _Row | None:
    values = numbers_in(line)
    if values is None or len(values) != _FIELDS or not np.isfinite(values).all():
        return None
    return _Row(number, values[0], _MILLI * values[2], values[3:])


def _drop(rows: list[_Row] | None, skipped: Skipped) -> None:
    if rows:
        skipped.add(rows[0].line, "parts of incomplete frames", len(rows))
