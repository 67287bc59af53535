"""Rows of a recording that measure the same, merged into their mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Pattern, undirected

_AGREE = 0.5
"""Least correlation of rows that measure the same; others are no copies of each other."""


_ALIKE = 1.25
"""How many times as large repeated rows can be as the first ones without a word."""


@dataclass(frozen=True, eq=False)
class RepeatedRows:
    """Which rows measure the same: of n, m are others.

    Attributes
    ----------
    first
        (m,) the first of each, ascending.
    group
        (n,) which of these each row repeats.
    sign
        (n,) ±1, by which its values are multiplied.
    note
        What was found, in a sentence.
    agree
        Whether repeated rows agree, so that their mean counts; else the first does.
    """

    first: IntArray
    group: IntArray
    sign: FloatArray
    note: str
    agree: bool

    @classmethod
    def of(
        cls,
        drive: IntArray,
        measure: IntArray,
        values: NDArray[Any],
        pattern: Pattern | None = None,
    ) -> Self | None:
        """Among rows (n, 2) with ``values`` (n_frames, n); None where no row repeats another.

        Rows that stand twice repeat, and so do those that only differ by a pair reversed, unless
        ``pattern`` asks for both of them. A voltage then has the other sign, but an instrument
        that tells sizes repeats it with the same: what the values agree on decides.
        """
        keys = _keys(drive, measure, None if pattern is None else _two_ways(pattern))
        first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
        repeats = len(keys) - len(first)
        if not repeats:
            return None
        order = np.argsort(first, kind="stable")
        first, group = first[order], np.argsort(order)[group.reshape(-1)]
        sign = _direction(drive, measure)
        sign = sign * sign[first][group]
        correlation, times = _correlation(values, sign, first[group])
        what, agree = "measurement", abs(correlation) >= _AGREE
        if correlation < 0:
            sign, what = np.ones(len(keys)), "size"
        said = "their mean counts" if agree else "they do not agree, so the first counts"
        if agree and not 1 / _ALIKE <= times <= _ALIKE:
            said += f", though the repeated ones are {times:.2g} times as large"
        note = f"{repeats} of {len(keys)} rows repeat another's {what}: {said}"
        return cls(first, group, sign, note, agree)

    def merged(self, values: NDArray[Any]) -> NDArray[Any]:
        """(…, m) of values (…, n): the mean of those that are finite."""
        if not self.agree:
            return values[..., self.first]
        finite = np.isfinite(values)
        total = np.zeros((len(self.first), *values.shape[:-1]), values.dtype)
        count = np.zeros(total.shape)
        np.add.at(total, self.group, np.where(finite, values * self.sign, 0.0).T)
        np.add.at(count, self.group, finite.T)
        with np.errstate(invalid="ignore"):
            return np.asarray((total / count).T)


def _direction(drive: IntArray, measure: IntArray) -> FloatArray:
    """(n,) ±1: 1 where both pairs ascend or both descend."""
    return np.where((drive[:, 0] < drive[:, 1]) == (measure[:, 0] < measure[:, 1]), 1.0, -1.0)


def _two_ways(pattern: Pattern) -> IntArray:
    """Undirected rows that the pattern drives from both ends."""
    rows, count = np.unique(undirected(pattern.drive, pattern.measure), axis=0, return_counts=True)
    return np.asarray(rows[count > 1])


def _keys(drive: IntArray, measure: IntArray, two_ways: IntArray | None) -> IntArray:
    """(n, 5): rows with the same key measure the same."""
    rows = undirected(drive, measure)
    way = np.zeros(len(rows), np.int64)
    if two_ways is not None and len(two_ways):
        both = (rows[:, None] == two_ways).all(axis=2).any(axis=1)
        way[both & (drive[:, 0] > drive[:, 1])] = 1
    return np.column_stack([rows, way])


def _correlation(values: NDArray[Any], sign: FloatArray, first: IntArray) -> tuple[float, float]:
    """Between repeated rows, ``sign`` times each, and the first of theirs, over all frames; and
    how many times as large they are."""
    again = np.flatnonzero(first != np.arange(len(first)))
    one = np.nan_to_num(values[:, again] * sign[again], posinf=0.0, neginf=0.0)
    other = np.nan_to_num(values[:, first[again]], posinf=0.0, neginf=0.0)
    sizes = float(np.linalg.norm(one)), float(np.linalg.norm(other))
    if not all(sizes):
        return 0.0, 1.0
    return float(np.vdot(one, other).real) / (sizes[0] * sizes[1]), sizes[0] / sizes[1]
