"""Foreign measurement rows brought into a pattern's order and sign."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, IntArray, PatternError
from tomoskin.model.pattern.pattern import Pattern

_LISTED = 5


@dataclass(frozen=True, eq=False)
class RowMatch:
    """Where each row of a pattern is found in a foreign table.

    ``rows`` (n_meas,) index into the foreign table; ``signs`` (n_meas,) ±1;
    ``unused`` foreign rows that the pattern does not ask for.
    """

    rows: IntArray
    signs: FloatArray
    unused: IntArray

    def apply(self, values: FloatArray) -> FloatArray:
        """(…, n_foreign) → (…, n_meas) in the pattern's order and sign; itself where it is so."""
        if np.array_equal(self.rows, np.arange(values.shape[-1])) and (self.signs == 1.0).all():
            return values
        return np.asarray(values[..., self.rows] * self.signs)


def match_rows(pattern: Pattern, drive: ArrayLike, measure: ArrayLike) -> RowMatch:
    """Match foreign rows to ``pattern`` by their electrodes.

    A row is found as it stands, with a pair reversed (sign changes), or as its reciprocal,
    drive and measuring pair exchanged (Geselowitz 1971). A row that stands as itself wins over
    one that is reversed, and that over its reciprocal; of equal rows the first is taken.

    Raises
    ------
    PatternError
        When rows of the pattern are missing in the table; the message lists them.
    """
    foreign = Pattern.from_tables(drive, measure)
    table: dict[tuple[int, ...], tuple[int, float]] = {}
    for row, (d, m) in enumerate(_rows(foreign)):
        key, sign = _canonical(d, m)
        table.setdefault(key, (row, sign))
        table.setdefault(_as_it_stands(d, m), (row, 1.0))
    located = [_find(table, d, m) for d, m in _rows(pattern)]
    missing = [row for row, hit in enumerate(located) if hit is None]
    if missing:
        raise PatternError(
            _describe(pattern, missing),
            hint="name the skin of this recording with --skin, and use the same pattern",
        )
    hits = [hit for hit in located if hit is not None]
    rows = np.array([row for row, _ in hits], dtype=np.int64)
    unused = np.setdiff1d(np.arange(foreign.n_meas), rows)
    return RowMatch(rows, np.array([sign for _, sign in hits]), unused)


def _rows(pattern: Pattern) -> Iterator[tuple[list[int], list[int]]]:
    return zip(pattern.drive.tolist(), pattern.measure.tolist(), strict=True)


def _canonical(d: list[int], m: list[int]) -> tuple[tuple[int, ...], float]:
    sign = (1.0 if d[0] < d[1] else -1.0) * (1.0 if m[0] < m[1] else -1.0)
    return (min(d), max(d), min(m), max(m)), sign


def _as_it_stands(d: list[int], m: list[int]) -> tuple[int, ...]:
    return (-1, *d, *m)


def _find(
    table: dict[tuple[int, ...], tuple[int, float]], d: list[int], m: list[int]
) -> tuple[int, float] | None:
    itself = table.get(_as_it_stands(d, m))
    if itself is not None:
        return itself
    key, sign = _canonical(d, m)
    hit = table.get(key) or table.get(key[2:] + key[:2])
    return None if hit is None else (hit[0], hit[1] * sign)


def _describe(pattern: Pattern, missing: list[int]) -> str:
    listed = "; ".join(pattern.row_text(row) for row in missing[:_LISTED])
    more = f"; and {len(missing) - _LISTED} more" if len(missing) > _LISTED else ""
    return f"{len(missing)} of {pattern.n_meas} rows are not in the recording: {listed}{more}"
