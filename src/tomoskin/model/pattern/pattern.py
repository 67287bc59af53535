"""The pattern: which pair is driven, and which pair is read, row by row; patterns by name."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, IntArray, PatternError, no_such, refuse_first

_BALANCE = 1e-3
"""Currents of a drive sum to zero, up to this part of the largest of them."""

_PAIR = 2
"""Columns of a table of pairs; a table of currents has more."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """A table of drives and measurements on ``n_electrodes`` electrodes, counted from 0.

    Current +I enters at the source and leaves at the sink; a row's voltage is
    φ[plus] − φ[minus]. A drive may also be a current into every electrode, in parts of I. Build
    one with a named constructor, :meth:`from_tables` or :meth:`from_pairs`.

    Attributes
    ----------
    n_electrodes
        Number of electrodes.
    drives
        (n_drive, 2) source, sink of each drive, in scan order; or (n_drive, n_electrodes) currents.
    drive_index
        (n_meas,) the drive that each row belongs to.
    measure
        (n_meas, 2) plus, minus of each row.
    spread
        Whether a drive is a current into every electrode, not a pair.

    Raises
    ------
    PatternError
        When an electrode does not exist, source = sink, plus = minus, the currents of a drive do
        not sum to zero, a row stands twice (reversed rows included), or there is no row at all.
    """

    n_electrodes: int
    drives: NDArray[Any]
    drive_index: IntArray
    measure: IntArray
    spread: bool = field(init=False)

    def __post_init__(self) -> None:
        """Freeze the tables and check every row."""
        spread = np.ndim(self.drives) > 1 and np.shape(self.drives)[1] > _PAIR
        object.__setattr__(self, "spread", spread)
        for name in ("drives", "drive_index", "measure"):
            kind = np.float64 if spread and name == "drives" else np.int64
            table = np.array(getattr(self, name), dtype=kind)
            table.flags.writeable = False
            object.__setattr__(self, name, table)
        check_drives(self.drives, self.n_electrodes)
        _check_pairs(self.measure, self.n_electrodes, "measurement", ("plus", "minus"))
        if len(self.drive_index) != len(self.measure):
            raise PatternError(
                f"expected one drive for each of {len(self.measure)} rows, "
                f"got {len(self.drive_index)}"
            )
        outside = (self.drive_index < 0) | (self.drive_index >= len(self.drives))
        drives = f"a drive from 0 to {len(self.drives) - 1}"
        refuse_first(outside, self.drive_index, drives, "measurement row", PatternError)
        _check_unique(self)

    @classmethod
    def from_tables(
        cls, drive: ArrayLike, measure: ArrayLike, n_electrodes: int | None = None
    ) -> Self:
        """Pattern from two tables, row by row.

        Parameters
        ----------
        drive
            (n_meas, 2) source, sink of each row; or (n_meas, n_electrodes) currents.
        measure
            (n_meas, 2) plus, minus of each row.
        n_electrodes
            Number of electrodes; without it, one more than the largest index used.

        The rows keep their order; drives are numbered as they first appear.
        """
        drive_rows, measure_rows = drive_table(drive), _table(measure, "measure")
        if len(drive_rows) != len(measure_rows):
            raise PatternError(
                f"expected as many drive rows as measurement rows, "
                f"got {len(drive_rows)} and {len(measure_rows)}"
            )
        count = n_electrodes or electrodes_of(drive_rows, measure_rows)
        check_drives(drive_rows, count)
        unique, first, inverse = np.unique(
            drive_rows, axis=0, return_index=True, return_inverse=True
        )
        order = np.argsort(first, kind="stable")
        rank = np.argsort(order, kind="stable")
        return cls(count, unique[order], rank[inverse.reshape(-1)], measure_rows)

    @classmethod
    def from_pairs(
        cls,
        n_electrodes: int,
        drives: ArrayLike,
        pairs: ArrayLike,
        *,
        include_driven: bool = False,
    ) -> Self:
        """Every measuring pair under every drive, drive by drive.

        A drive is a pair, or a current into every electrode. Rows whose pair touches a driven
        electrode are omitted unless ``include_driven``.
        """
        table, pair_table = drive_table(drives), _table(pairs, "measure")
        index = np.repeat(np.arange(len(table)), len(pair_table))
        measure = np.tile(pair_table, (len(table), 1))
        full = cls(n_electrodes, table, index, measure)
        if include_driven:
            return full
        kept = ~(full.currents[index[:, None], measure] != 0.0).any(axis=1)
        if not kept.any():
            raise PatternError(
                "every measuring pair touches a driven electrode",
                hint="keep these rows with include_driven=True",
            )
        return cls(n_electrodes, table, index[kept], measure[kept])

    @classmethod
    def adjacent(cls, n: int, *, include_driven: bool = False) -> Self:
        """Neighbouring electrodes driven and read: n(n−3) rows, in EIDORS' order and signs."""
        return cls.skip(n, 0, include_driven=include_driven)

    @classmethod
    def skip(cls, n: int, k: int, *, include_driven: bool = False) -> Self:
        """Drive i has sink i and source i+k+1; pair j has plus j and minus j+1 (mod n)."""
        _check_count(n)
        if not 0 <= k <= n - 2:
            raise PatternError(f"expected k from 0 to {n - 2} for {n} electrodes, got {k}")
        if 2 * (k + 1) == n:
            raise PatternError(
                f"skipping {k} of {n} electrodes drives every pair twice",
                hint='"opposite" drives each of them once',
            )
        e = np.arange(n)
        drives = np.column_stack([(e + k + 1) % n, e])
        return cls.from_pairs(n, drives, _neighbours(n), include_driven=include_driven)

    @classmethod
    def opposite(cls, n: int, *, include_driven: bool = False) -> Self:
        """Drive i has sink i and source i+n/2, for i < n/2; neighbouring pairs are read."""
        _check_count(n)
        if n % 2:
            raise PatternError(f"expected an even number of electrodes, got {n}")
        e = np.arange(n // 2)
        drives = np.column_stack([e + n // 2, e])
        return cls.from_pairs(n, drives, _neighbours(n), include_driven=include_driven)

    @classmethod
    def all_pairs(cls, n: int, *, include_driven: bool = False) -> Self:
        """Each pair a < b driven once (sink a, source b); neighbouring pairs are read."""
        _check_count(n)
        sink, source = np.triu_indices(n, 1)
        drives = np.column_stack([source, sink])
        return cls.from_pairs(n, drives, _neighbours(n), include_driven=include_driven)

    def joined(self, other: Self) -> Self:
        """Mixed pattern: the rows of this one, then those of ``other`` that are new.

        A row with a pair reversed is not new: it would measure the same voltage again.
        """
        if self.spread or other.spread:
            raise PatternError(
                "drives of several electrodes cannot be joined", hint="make one table of them"
            )
        drive = np.vstack([self.drive, other.drive])
        measure = np.vstack([self.measure, other.measure])
        _, first = np.unique(undirected(drive, measure), axis=0, return_index=True)
        keep = np.sort(first)
        count = max(self.n_electrodes, other.n_electrodes)
        return type(self).from_tables(drive[keep], measure[keep], count)

    @property
    def n_meas(self) -> int:
        """The number of measurements in a frame."""
        return len(self.measure)

    @property
    def n_drive(self) -> int:
        """The number of drives in a frame."""
        return len(self.drives)

    @property
    def drive(self) -> NDArray[Any]:
        """(n_meas, 2) source, sink of each row; or (n_meas, n_electrodes) currents."""
        return self.drives[self.drive_index]

    @cached_property
    def currents(self) -> FloatArray:
        """(n_drive, n_electrodes) current into every electrode, in parts of the model's current."""
        if self.spread:
            return self.drives
        return signed(self.drives, self.n_electrodes)

    def rows_of(self, electrode: int) -> IntArray:
        """(k,) rows that drive or read ``electrode``. Raises PatternError where it is none."""
        if not 0 <= electrode < self.n_electrodes:
            raise PatternError(
                f"expected an electrode from 0 (E1) to {self.n_electrodes - 1}, got {electrode}"
            )
        driven = self.currents[self.drive_index, electrode] != 0.0
        return np.flatnonzero(driven | (self.measure == electrode).any(axis=1))

    def row_text(self, row: int) -> str:
        """The row in words, for messages."""
        plus, minus = self.measure[row] + 1
        drive = f"drive {self.drive_index[row]}"
        if not self.spread:
            source, sink = self.drive[row] + 1
            drive = f"source E{source}, sink E{sink}"
        return f"row {row}: {drive}, plus E{plus}, minus E{minus}"

    @cached_property
    def identity(self) -> str:
        """Short hash of the tables: operators and recordings are matched by it."""
        digest = hashlib.sha256(str(self.n_electrodes).encode())
        digest.update(self.drive.astype("<f8" if self.spread else "<i4").tobytes())
        digest.update(self.measure.astype("<i4").tobytes())
        return digest.hexdigest()[:16]


def _neighbours(n: int) -> IntArray:
    e = np.arange(n)
    return np.column_stack([e, (e + 1) % n])


def _check_count(n: int) -> None:
    if n < 4:
        raise PatternError(f"expected at least 4 electrodes, got {n}")


def _table(value: ArrayLike, name: str) -> IntArray:
    raw = np.asarray(value)
    if raw.ndim != 2 or raw.shape[1] != 2 or not len(raw):
        raise PatternError(f"expected a {name} table of shape (rows, 2), got {raw.shape}")
    if raw.dtype.kind not in "iu" and not np.array_equal(raw, np.round(raw)):
        raise PatternError(f"expected whole electrode numbers in the {name} table, got others")
    return raw.astype(np.int64)


def drive_table(value: ArrayLike) -> NDArray[Any]:
    """(rows, 2) source and sink, or (rows, n_electrodes) currents.

    Raises PatternError for another shape, or what are no numbers.
    """
    raw = np.asarray(value)
    if raw.ndim != 2 or raw.shape[1] <= _PAIR:
        return _table(raw, "drive")
    if raw.dtype.kind not in "iuf":
        raise PatternError(f"expected real currents in the drive table, got {raw.dtype}")
    return raw.astype(np.float64)


def electrodes_of(drive: NDArray[Any], measure: IntArray) -> int:
    """The number of electrodes that two tables are about."""
    driven = drive.shape[1] if drive.shape[1] > _PAIR else 1 + int(drive.max())
    return max(driven, 1 + int(measure.max()))


def signed(pairs: IntArray, n: int) -> FloatArray:
    """(rows, n): 1 at the first electrode of each pair (rows, 2), −1 at the second."""
    table = np.zeros((len(pairs), n))
    table[np.arange(len(pairs)), pairs[:, 0]] = 1.0
    table[np.arange(len(pairs)), pairs[:, 1]] = -1.0
    return table


def check_drives(drives: NDArray[Any], n: int) -> None:
    """Raise PatternError unless they are pairs, or currents (rows, ``n``) that sum to zero."""
    if drives.ndim != 2 or drives.shape[1] <= _PAIR:
        return _check_pairs(drives, n, "drive", ("source", "sink"))
    if drives.shape[1] != n:
        raise PatternError(
            f"expected a drive table of shape (rows, 2), or currents (rows, {n}) into every "
            f"electrode, got {drives.shape}"
        )
    most = np.abs(drives).max(axis=1)
    good = np.isfinite(most) & (most > 0) & (np.abs(drives.sum(axis=1)) <= _BALANCE * most)
    if not good.all():
        row = int(np.argmin(good))
        raise PatternError(
            f"expected currents that are not all zero and sum to zero, got a sum of "
            f"{drives[row].sum():.3g} where the largest is {most[row]:.3g}",
            where=f"drive row {row}",
        )
    return None


def _check_pairs(pairs: IntArray, n: int, kind: str, ends: tuple[str, str]) -> None:
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs):
        raise PatternError(f"expected a {kind} table of shape (rows, 2), got {pairs.shape}")
    outside = ((pairs < 0) | (pairs >= n)).any(axis=1)
    refuse_first(outside, pairs, f"electrodes from 0 (E1) to {n - 1}", f"{kind} row", PatternError)
    same = pairs[:, 0] == pairs[:, 1]
    if same.any():
        row = int(np.argmax(same))
        raise PatternError(
            f"{ends[0]} and {ends[1]} are both E{pairs[row, 0] + 1}",
            where=f"{kind} row {row}",
        )


def undirected(drive: IntArray, measure: IntArray) -> IntArray:
    """(n, 4) of the tables (n, 2): the same for rows that differ by a pair reversed."""
    return np.hstack([np.sort(drive, axis=1), np.sort(measure, axis=1)])


def _check_unique(pattern: Pattern) -> None:
    # Driven from its other end, a pair is another drive: instruments read the signs unlike.
    rows = np.hstack([pattern.drive, np.sort(pattern.measure, axis=1)])
    _, inverse, counts = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    if counts.max() > 1:
        twice = np.flatnonzero(inverse.reshape(-1) == np.argmax(counts))[:2].tolist()
        raise PatternError(
            f"rows {twice[0]} and {twice[1]} measure the same pair under the same drive",
            hint="leave one of them out",
        )


NAMED: dict[str, Callable[[int], Pattern]] = {
    "adjacent": Pattern.adjacent,
    "opposite": Pattern.opposite,
    "all_pairs": Pattern.all_pairs,
}
"""Patterns by name; ``skip:k`` is understood beside them."""


def named(name: str, n: int) -> Pattern:
    """Pattern of that name on ``n`` electrodes; ``a+b`` joins two of them.

    Raises
    ------
    PatternError
        For another name; the message lists those that there are.
    """
    parts = [_one(part.strip(), n) for part in name.split("+")]
    pattern = parts[0]
    for part in parts[1:]:
        pattern = pattern.joined(part)
    return pattern


def _one(name: str, n: int) -> Pattern:
    if name in NAMED:
        return NAMED[name](n)
    kind, _, k = name.partition(":")
    if kind == "skip" and k.isdigit():
        return Pattern.skip(n, int(k))
    raise PatternError(no_such(name, NAMED, "a pattern", "skip:K", "or several joined by +"))
