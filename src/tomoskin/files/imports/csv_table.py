"""The interchange file as text: a header, then one frame a line.

Columns ``v_SOURCE_SINK_PLUS_MINUS`` (V) or ``dv_…``, electrodes from 0; optional ``time_s``,
``idle`` (1 in the first frames, of the untouched skin, then 0), and ``x_m`` and ``y_m`` for the
true position of a single touch. Comma between columns, decimal point; voltages may be complex,
``1.5-0.2j`` or ``1.5-0.2i``.
"""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray, check_fits, most_bytes
from tomoskin.files.imports.tables import voltages_of
from tomoskin.sensing.signal import Recording

_COLUMN = re.compile(r"(dv|v)_(\d+)_(\d+)_(\d+)_(\d+)")
_KNOWN = ("time_s", "idle", "x_m", "y_m")
OWN = "ticks"
"""Column of the board's own clock: the table is the export of a session."""

_IGNORED = ("frame", "sequence", OWN, "mark")
"""Columns that an export has beside them; not needed here."""


def detects(lines: list[str]) -> bool:
    """Whether the first line names such columns."""
    return bool(lines) and _COLUMN.search(lines[0]) is not None


def parse(lines: Iterable[str], source: str) -> Recording:
    """Return the recording.

    Raises
    ------
    DataError
        When a column is not known, or a line has another number of fields or one that is no
        number; the message names line and column.
    """
    rows = _rows(lines, source)
    header = [name.strip() for name in next(rows)]
    _check_separator(header, source)
    matches = [_COLUMN.fullmatch(name) for name in header]
    unknown = [
        name
        for name, match in zip(header, matches, strict=True)
        if match is None and name not in (*_KNOWN, *_IGNORED)
    ]
    if unknown or len(set(header)) != len(header):
        raise DataError(
            f"expected columns v_SOURCE_SINK_PLUS_MINUS, {', '.join(_KNOWN)}, each once, got "
            f'"{(unknown or header)[0]}"',
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
    return replace(recording, idle=idle, board_known=OWN in by_name)


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


def _check_separator(header: list[str], source: str) -> None:
    if any(";" in name or "\t" in name for name in header):
        raise DataError(
            "expected commas between columns and decimal points in numbers, got semicolons or tabs",
            where=f"{source}, line 1",
            hint="export it with decimal points: 1.5, not 1,5",
        )


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
