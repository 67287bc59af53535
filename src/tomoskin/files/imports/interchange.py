"""The interchange file: a plain .npz that any tool can write, or the same as a table in text.

Keys: ``voltages`` (n_frames, n_meas) V, or ``dv``; ``drive`` (n_meas, 2) source, sink, or
(n_meas, n_electrodes) currents into many electrodes; ``measure`` (n_meas, 2) plus, minus; optional
``time_s`` (n_frames,), ``reference`` (n_meas,), ``xy_m`` (n_frames, 2), ``idle`` frames at the
beginning that show the untouched skin; ``board_known`` where the skin's own read-out recorded the
frames.
"""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    Arrays,
    DataError,
    FloatArray,
    IntArray,
    StrPath,
    check_fits,
    electrode_table,
    most_bytes,
    numbers,
    real_numbers,
    save_arrays,
    whole_number,
)
from tomoskin.files.imports.tables import checked_currents, voltages_of
from tomoskin.files.imports.text_lines import text_lines
from tomoskin.sensing.signal import Recording

BOARD_KNOWN = "board_known"
"""Key of a file whose noise the skin's own read-out predicts: the export of a session."""

REQUIRED = frozenset({"drive", "measure"})


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of an interchange file."""
    return set(arrays) >= REQUIRED and len({"voltages", "dv"} & set(arrays)) > 0


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording in the arrays of an interchange file.

    Raises
    ------
    DataError
        When both or neither of voltages and dv are there, a key has the wrong type or shape.
    """
    if "voltages" in arrays and "dv" in arrays:
        raise DataError("holds both voltages and dv", where=source, hint="keep one of them")
    key = "voltages" if "voltages" in arrays else "dv"
    drive, measure = _drives(arrays, source), electrode_table(arrays, "measure", source)
    recording = voltages_of(
        source,
        np.atleast_2d(numbers(arrays, key, source)),
        (drive, measure),
        time=real_numbers(arrays, "time_s", source) if "time_s" in arrays else None,
        reference=numbers(arrays, "reference", source) if "reference" in arrays else None,
        labels=real_numbers(arrays, "xy_m", source) if "xy_m" in arrays else None,
        is_change=key == "dv",
    )
    idle = whole_number(arrays, "idle", source) if "idle" in arrays else 1
    return replace(recording, idle=idle, board_known=BOARD_KNOWN in arrays)


def _drives(arrays: Arrays, source: str) -> NDArray[Any]:
    """(n_meas, 2) source and sink, or (n_meas, n_electrodes) currents."""
    table = real_numbers(arrays, "drive", source)
    if table.ndim != 2 or table.shape[1] <= 2 or len(table) != len(arrays["measure"]):
        return electrode_table(arrays, "drive", source)
    checked_currents(table, "drive row", source)
    return table


def write_interchange(path: StrPath, recording: Recording, *, overwrite: bool = False) -> None:
    """Write ``recording`` as an interchange file; raises as :func:`written` does."""
    arrays: dict[str, NDArray[Any]] = {
        "dv" if recording.is_change else "voltages": recording.voltages,
        "drive": recording.drive,
        "measure": recording.measure,
        "idle": np.array(recording.idle),
    }
    if recording.timed:
        arrays["time_s"] = recording.time
    if recording.reference is not None:
        arrays["reference"] = recording.reference
    if recording.labels is not None:
        arrays["xy_m"] = recording.labels
    if recording.board_known:
        arrays[BOARD_KNOWN] = np.array(True)
    save_arrays(path, arrays, overwrite=overwrite)


_COLUMN = re.compile(r"(dv|v)_(\d+)_(\d+)_(\d+)_(\d+)")
_KN_CLOCK = ("time_s", "idle", "x_m", "y_m")
_CLOCK = "ticks"
"""Column of the board's own clock: the table is the export of a session."""

_IGNORED = ("frame", "sequence", _CLOCK, "mark")
"""Columns that an export has beside them; not needed here."""


def is_table(lines: list[str]) -> bool:
    """Whether the first line names such columns."""
    return bool(lines) and _COLUMN.search(lines[0]) is not None


def read_table(lines: Iterable[str], source: str) -> Recording:
    """The interchange file as text: a header, then one frame a line.

    Columns ``v_SOURCE_SINK_PLUS_MINUS`` (V) or ``dv_…``, electrodes from 0; optional ``time_s``,
    ``idle`` (1 in the first frames, of the untouched skin, then 0), and ``x_m`` and ``y_m`` for the
    true position of a single touch. Comma between columns, decimal point; voltages may be complex,
    ``1.5-0.2j`` or ``1.5-0.2i``.

    Raises
    ------
    DataError
        When a column is not known, or a line has another number of fields or one that is no
        number; the message names line and column.
    """
    rows = _rows(lines, source)
    header = _header(rows, source)
    matches = [_COLUMN.fullmatch(name) for name in header]
    unknown = [
        name
        for name, match in zip(header, matches, strict=True)
        if match is None and name not in (*_KN_CLOCK, *_IGNORED)
    ]
    if unknown:
        raise DataError(
            f"expected columns v_SOURCE_SINK_PLUS_MINUS, {', '.join(_KN_CLOCK)}, got "
            f'"{unknown[0]}"',
            where=f"{source}, line 1",
        )
    kinds = {match[1] for match in matches if match}
    if len(kinds) != 1:
        raise DataError(
            f"expected columns of v or of dv, got {' and '.join(sorted(kinds)) or 'neither'}",
            where=f"{source}, line 1",
        )
    table = _values(rows, header, source).reshape(-1, len(header))
    used = [number for number, match in enumerate(matches) if match]
    electrodes = np.array([[int(part) for part in m.groups()[1:]] for m in matches if m])
    by_name = {
        name: _real(table[:, n], name, source) for n, name in enumerate(header) if n not in used
    }
    has_place = "x_m" in by_name and "y_m" in by_name
    recording = voltages_of(
        source,
        table[:, used],
        (electrodes[:, :2], electrodes[:, 2:]),
        time=by_name.get("time_s"),
        labels=np.column_stack([by_name["x_m"], by_name["y_m"]]) if has_place else None,
        is_change=kinds == {"dv"},
    )
    idle = _idle(by_name["idle"], source) if "idle" in by_name else 1
    return replace(recording, idle=idle, board_known=_CLOCK in by_name)


def read_columns(path: StrPath) -> dict[str, FloatArray]:
    """Each column (n,) of a table of numbers in text, by its name in the first line.

    A field without a number is NaN. Raises DataError as :func:`read_table` does.
    """
    source = str(path)
    rows = _rows(text_lines(Path(path)), source)
    header = _header(rows, source)
    table = _values(rows, header, source).reshape(-1, len(header))
    return {name: _real(table[:, n], name, source) for n, name in enumerate(header)}


def column_names(drive: IntArray, measure: IntArray) -> list[str]:
    """Names of the columns of a table of rows."""
    tables = np.hstack([drive, measure]).tolist()
    return ["_".join(["v", *map(str, row)]) for row in tables]


def _idle(marks: FloatArray, source: str) -> int:
    """Number of idle frames: at the beginning."""
    idle = int(np.count_nonzero(marks == 1))
    if not ((marks[:idle] == 1).all() and (marks[idle:] == 0).all()):
        raise DataError(
            "expected idle 1 in the first frames, then 0, got another order", where=source
        )
    return max(1, idle)


def _header(rows: Iterator[list[str]], source: str) -> list[str]:
    header = [name.strip() for name in next(rows, [""])]
    if any(";" in name or "\t" in name for name in header):
        raise DataError(
            "expected commas between columns and decimal points in numbers, got semicolons or tabs",
            where=f"{source}, line 1",
            hint="export it with decimal points: 1.5, not 1,5",
        )
    if twice := [name for number, name in enumerate(header) if name in header[:number]]:
        raise DataError(
            f'expected each column once, got "{twice[0]}" more than once', where=f"{source}, line 1"
        )
    return header


def _rows(lines: Iterable[str], source: str) -> Iterator[list[str]]:
    """The fields of each line, the header first."""
    rows = csv.reader(lines)
    try:
        yield from rows
    except csv.Error as error:
        raise DataError(
            f"is not a table: {error}", where=f"{source}, line {rows.line_num}"
        ) from error


def _real(values: NDArray[Any], name: str, source: str) -> FloatArray:
    """A column that is no voltage."""
    if np.iscomplexobj(values) and values.imag.any():
        raise DataError(f"expected real numbers in {name}, got complex", where=source)
    return values.real


def _values(rows: Iterator[list[str]], header: list[str], source: str) -> NDArray[Any]:
    """The numbers of all lines, one after another: complex where one of them is."""
    values, most = array("d"), most_bytes()
    for number, row in enumerate(rows, start=2):
        if not row:
            continue
        if len(row) != len(header):
            raise DataError(
                f"expected {len(header)} fields, got {len(row)}",
                where=f"{source}, line {number}",
                hint="a decimal comma splits a field in two",
            )
        where = f"{source}, line {number}"
        for text, name in zip(row, header, strict=True):
            value = _number(text, name, where)
            values.extend((value.real, value.imag))
        if values.itemsize * len(values) > most:
            check_fits(values.itemsize * len(values), source)
    table = np.asarray(values).view(np.complex128)
    return table if table.imag.any() else table.real


def _number(text: str, name: str, where: str) -> float | complex:
    if not text.strip():
        return float("nan")
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return complex(text.replace(" ", "").replace("i", "j"))
    except ValueError:
        raise DataError(f'expected a number in {name}, got "{text}"', where=where) from None
