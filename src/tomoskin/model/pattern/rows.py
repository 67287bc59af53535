"""The scan, what a board samples so that every row of a pattern can be formed from it; and foreign
measurement rows brought into a pattern's order and sign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, IntArray, PatternError
from tomoskin.model.pattern.pattern import Pattern, check_drives, drive_table, signed

_MOST = 32
"""Electrodes that a mask has bits for."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Per drive, the electrodes whose potential is sampled, in ascending order.

    A frame's samples are drive-major: all electrodes of drive 0, then of drive 1, and so on.

    Attributes
    ----------
    drives
        (n_drive, 2) source, sink.
    masks
        (n_drive,) bit e set where electrode e is sampled under that drive.
    sample_drive, sample_electrode
        (n_samples,) drive and electrode of each sample.
    plus, minus
        (n_meas,) sample that each row of the pattern adds, and the one it subtracts.
    """

    drives: IntArray
    masks: NDArray[np.uint32]
    sample_drive: IntArray
    sample_electrode: IntArray
    plus: IntArray
    minus: IntArray

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """Smallest scan that holds every row of ``pattern``.

        Raises PatternError when there are more electrodes than a mask has bits, or a drive is a
        current into many of them.
        """
        if pattern.spread:
            raise PatternError("a board drives a pair at a time, not several electrodes")
        n = pattern.n_electrodes
        if n > _MOST:
            raise PatternError(f"expected at most {_MOST} electrodes to scan, got {n}")
        read = np.zeros((pattern.n_drive, n), dtype=bool)
        read[pattern.drive_index[:, None], pattern.measure] = True
        sample_drive, sample_electrode = np.nonzero(read)
        number = np.full(read.shape, -1)
        number[read] = np.arange(len(sample_drive))
        masks = (read * (np.uint32(1) << np.arange(n, dtype=np.uint32))).sum(axis=1)
        return cls(
            drives=pattern.drives,
            masks=masks.astype(np.uint32),
            sample_drive=sample_drive,
            sample_electrode=sample_electrode,
            plus=number[pattern.drive_index, pattern.measure[:, 0]],
            minus=number[pattern.drive_index, pattern.measure[:, 1]],
        )

    @property
    def n_samples(self) -> int:
        """Number of samples in a frame."""
        return len(self.sample_drive)

    @property
    def makes(self) -> FloatArray:
        """(n_meas, n_samples): +1 where a sample is a row's plus, -1 where it is its minus."""
        return signed(np.column_stack([self.plus, self.minus]), self.n_samples)


_LISTED = 5

_SPAN = 1e-3
"""Currents combine into a drive to within this part of it; weaker parts of them do not count."""


RECIPROCALS = ((2, 3, 0, 1), 1.0), ((3, 2, 0, 1), -1.0), ((2, 3, 1, 0), -1.0), ((3, 2, 1, 0), 1.0)
"""Orders of a row's ends, and the signs, in which it is the reciprocal of another one."""

_FORMS = (
    (((0, 1, 2, 3), 1.0),),
    (((1, 0, 2, 3), -1.0), ((0, 1, 3, 2), -1.0), ((1, 0, 3, 2), 1.0)),
    RECIPROCALS,
)
"""The same of a row as itself, with pairs reversed, as its reciprocal."""


@dataclass(frozen=True, eq=False)
class RowMatch:
    """Where each row of a pattern is found in a foreign table.

    ``rows`` (n_meas,) index into the foreign table; ``signs`` (n_meas,) ±1.
    """

    rows: IntArray
    signs: FloatArray

    def apply(self, values: NDArray[Any]) -> NDArray[Any]:
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
    for forms in _FORMS:
        for row, ends in enumerate(np.hstack([foreign.drive, foreign.measure]).tolist()):
            for order, sign in forms:
                table.setdefault(tuple(ends[end] for end in order), (row, sign))
    wanted = np.hstack([pattern.drive, pattern.measure]).tolist()
    located = [table.get(tuple(row)) for row in wanted]
    missing = [row for row, hit in enumerate(located) if hit is None]
    if missing:
        raise PatternError(
            _describe(pattern, missing),
            hint="name the skin of this recording with --skin, and use the same pattern",
        )
    hits = [hit for hit in located if hit is not None]
    rows = np.array([row for row, _ in hits], dtype=np.int64)
    return RowMatch(rows, np.array([sign for _, sign in hits]))


@dataclass(frozen=True, eq=False)
class RowSums:
    """Rows of a pattern as sums of foreign rows, whose drives were currents into many electrodes.

    ``parts``: for each measuring pair the rows of the pattern, the foreign rows, and the weights
    (rows, foreign rows) of the sums.
    """

    n_meas: int
    parts: tuple[tuple[IntArray, IntArray, FloatArray], ...]

    def apply(self, values: NDArray[Any]) -> NDArray[Any]:
        """(…, n_foreign) → (…, n_meas) in the pattern's order and sign."""
        out = np.empty((*values.shape[:-1], self.n_meas), values.dtype)
        for rows, foreign, weights in self.parts:
            out[..., rows] = values[..., foreign] @ weights.T
        return out


def sum_rows(pattern: Pattern, currents: ArrayLike, measure: ArrayLike) -> RowSums:
    """Rows of ``pattern`` by superposition of rows with ``currents`` (n, n_electrodes).

    What a drive reads is linear in its currents. So rows of one measuring pair combine into any
    drive that is a sum of theirs; the smallest weights are taken.

    Raises
    ------
    PatternError
        When currents do not sum to zero, or rows of the pattern are no such sums; the message
        lists them.
    """
    table, pairs = drive_table(currents), np.asarray(measure)
    check_drives(table, table.shape[1])
    given = np.zeros((len(table), pattern.n_electrodes))
    given[:, : table.shape[1]] = table * _way(pairs)[:, None]
    target = pattern.currents[pattern.drive_index] * _way(pattern.measure)[:, None]
    own, foreign = np.sort(pattern.measure, axis=1), np.sort(pairs, axis=1)
    parts, missing = [], list[int]()
    for pair in np.unique(own, axis=0):
        rows = np.flatnonzero((own == pair).all(axis=1))
        some = np.flatnonzero((foreign == pair).all(axis=1))
        weights = target[rows] @ np.linalg.pinv(given[some], rcond=_SPAN)
        rest = np.abs(weights @ given[some] - target[rows]).max(axis=1)
        missing += rows[rest > _SPAN * np.abs(target[rows]).max(axis=1)].tolist()
        parts.append((rows, some, weights))
    if missing:
        raise PatternError(
            f"{_describe(pattern, sorted(missing))}, also not as sums of its drives of several "
            "electrodes",
            hint="name the skin of this recording with --skin; n electrodes need n - 1 drives "
            "that differ, each with the measuring pairs of the pattern",
        )
    return RowSums(pattern.n_meas, tuple(parts))


def _way(pairs: IntArray) -> FloatArray:
    """(n,) 1 where a pair ascends, else −1."""
    return np.where(pairs[:, 0] < pairs[:, 1], 1.0, -1.0)


def _describe(pattern: Pattern, missing: list[int]) -> str:
    listed = "; ".join(pattern.row_text(row) for row in missing[:_LISTED])
    more = f"; and {len(missing) - _LISTED} more" if len(missing) > _LISTED else ""
    return f"{len(missing)} of {pattern.n_meas} rows are not in the recording: {listed}{more}"
