"""A recording in memory: frames of voltages with their own table of rows, and rows of it that
measure the same, merged into their mean."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray, PatternError, located
from tomoskin.model.pattern import Pattern, electrodes_of, match_rows, sum_rows, undirected

_MOST = 1e12
"""No instrument has a unit in which a voltage is a larger number."""

_MOST_OF_MEDIAN = 1e4
"""Voltages beyond so many times the largest of the median frame are absurd: 3 in real recordings,
and an input at its rail is some hundred. Differences have no such scale, as idle ones are zero."""

_MOST_TIME = 1e18
"""s; what counts nanoseconds since 1970 as seconds is below."""

_JUMP, _LONG = 100, 10.0
"""A time jumps that is more than so many usual intervals, and seconds, after the one before."""

_LISTED = 5
"""Frames that a note names."""


_MOVES = 2e-3
"""m; a label that differs by less is of the same position."""

_FASTEST = 0.5
"""m/s; fingers that slide on a skin are slower: 0.03 to 0.15 where they slide, at most 0.3 in a
rub."""

_AGAIN, _MOSTLY = 5, 0.5
"""So many moves that are faster, and so large a part of all, are no finger's: once or twice one is
lifted and put down elsewhere between two rows."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Frames with the drive and measurement of each row, in the file's own order.

    Attributes
    ----------
    voltages
        (n_frames, n_rows) V or instrument units, real or complex; differences when ``is_change``.
    drive, measure
        (n_rows, 2) source, sink; plus, minus. A drive may also be currents into many electrodes,
        (n_rows, n_electrodes), in parts of the skin's current.
    time
        (n_frames,) s.
    reference
        (n_rows,) the file's own reference, or None.
    labels
        (n_frames, 2) m, positions of a single touch, or None.
    is_change
        True when the file holds differences (``dv``) rather than voltages.
    source
        Where it came from, for messages.
    notes
        What of the file was omitted, in sentences.
    idle
        Frames at the beginning that show the untouched skin; 1 where that is assumed.
    timed
        Whether the times were measured. Else the frames are only numbered, and none follows from
        the one before.
    board_known
        Whether the skin's read-out recorded it, so that its noise can be predicted.
    """

    voltages: NDArray[Any]
    drive: NDArray[Any]
    measure: IntArray
    time: FloatArray
    reference: NDArray[Any] | None
    labels: FloatArray | None
    is_change: bool
    source: str
    notes: tuple[str, ...] = ()
    idle: int = 1
    timed: bool = True
    board_known: bool = True

    @property
    def leaps(self) -> str:
        """What speaks for single presses instead of the course of a finger, in a sentence: labels
        that leap from row to row, again and again; "" where none do, or nothing has a time."""
        if self.labels is None or not self.timed:
            return ""
        way = np.linalg.norm(np.diff(self.labels, axis=0), axis=1)
        passed = np.diff(self.time)
        moves = (way > _MOVES) & (passed > 0)  # not where a label is missing
        fast = way[moves] > _FASTEST * passed[moves]
        if fast.sum() < _AGAIN or fast.mean() < _MOSTLY:
            return ""
        return (
            f"the labels of {fast.sum()} rows lie farther from those of the row before than a "
            f"finger gets ({_FASTEST:g} m/s), so these are single presses. Rows with time_s are "
            "followed as one finger, which cannot leap: touches are missed or shown twice. "
            "Leave out time_s, or put untouched rows between the presses"
        )

    def __post_init__(self) -> None:
        """Check that the shapes belong together and that there is a frame."""
        if self.voltages.ndim != 2 or not self.voltages.size:
            empty = "" if self.voltages.size else ": the recording is empty"
            raise DataError(
                f"expected voltages (n_frames, n_rows), got shape {self.voltages.shape}{empty}",
                where=self.source,
            )
        n_frames, n_rows = self.voltages.shape
        if not 1 <= self.idle <= n_frames:
            raise DataError(
                f"expected idle from 1 to {n_frames}, got {self.idle}", where=self.source
            )
        if len(self.drive) != n_rows or not self.spread:
            _check(self.drive.shape, (n_rows, 2), "drive", self.source)
        _check(self.measure.shape, (n_rows, 2), "measure", self.source)
        _check(self.time.shape, (n_frames,), "time_s", self.source)
        if self.reference is not None:
            _check(self.reference.shape, (n_rows,), "reference", self.source)
        if self.labels is not None:
            _check(self.labels.shape, (n_frames, 2), "xy_m", self.source)

    def __len__(self) -> int:
        """How many frames there are in it."""
        return len(self.voltages)

    @property
    def spread(self) -> bool:
        """Whether the drives are currents into many electrodes."""
        return self.drive.ndim == 2 and self.drive.shape[1] > 2

    def part(self, start: int, stop: int) -> Recording:
        """Frames ``start`` to ``stop`` − 1."""
        chosen = slice(start, stop)
        labels = None if self.labels is None else self.labels[chosen]
        return replace(
            self,
            voltages=self.voltages[chosen],
            time=self.time[chosen],
            labels=labels,
            idle=max(1, min(self.idle, stop) - start),
        )

    def plausible(self) -> Recording:
        """The recording without absurd values: NaN stands for them, and notes name them."""
        most = self._most()
        limits = {"voltages": most, "reference": most, "time": _MOST_TIME}
        changes: dict[str, Any] = {}
        notes = []
        for key, limit in limits.items():
            values = getattr(self, key)
            if values is None:
                continue
            absurd = np.isfinite(values) & (np.abs(values) > limit)  # infinite is not finite
            if not absurd.any():
                continue
            changes[key] = np.where(absurd, np.nan, values)
            notes.append(_absurd(key, absurd, limit))
        return replace(self, **changes, notes=(*self.notes, *notes)) if changes else self

    def steady(self) -> Recording:
        """The recording with times that go on; notes name what did not.

        A frame whose time is unknown, or not after the one before, is one usual interval later.
        """
        step = np.diff(self.time)
        good = step > 0
        notes = time_notes(self.time)
        if good.all() and np.isfinite(self.time[:1]).all():
            return replace(self, notes=(*self.notes, *notes)) if notes else self
        usual = float(np.median(step[good])) if good.any() else 1.0
        start = self.time[0] if np.isfinite(self.time[0]) else 0.0
        time = start + np.cumsum(np.concatenate([[0.0], np.where(good, step, usual)]))
        return replace(self, time=time, notes=(*self.notes, *notes))

    def _most(self) -> float:
        """The largest number that can be a voltage of this recording."""
        size = np.abs(self.voltages)
        tops = np.where(size <= _MOST, size, 0.0).max(axis=1)
        if self.is_change or not tops.any():
            return _MOST
        median = float(np.quantile(tops[tops > 0], 0.5, method="lower"))
        return min(_MOST, _MOST_OF_MEDIAN * median)

    def without_repeats(self, pattern: Pattern | None = None) -> Recording:
        """The recording with each measurement once: see :class:`RepeatedRows`; a note says so."""
        repeats = (
            None
            if self.spread
            else RepeatedRows.of(self.drive, self.measure, self.voltages, pattern)
        )
        if repeats is None:
            return self
        return replace(
            self,
            voltages=repeats.merged(self.voltages),
            drive=self.drive[repeats.first],
            measure=self.measure[repeats.first],
            reference=None if self.reference is None else repeats.merged(self.reference),
            notes=(*self.notes, repeats.note),
        )

    def in_order_of(self, pattern: Pattern) -> Recording:
        """Return the recording with exactly the pattern's rows, in its order and signs.

        Rows that measure the same are merged into their mean first. Drives of several electrodes
        are summed to the pattern's.

        Raises
        ------
        DataError
            When the recording has another number of electrodes.
        PatternError
            When rows are missing or impossible; the message lists them.
        """
        electrodes = electrodes_of(self.drive, self.measure)
        if electrodes > pattern.n_electrodes:
            raise DataError(
                f"the recording uses electrodes E1 to E{electrodes}, "
                f"the skin has {pattern.n_electrodes}",
                where=self.source,
                hint="choose the skin that it was recorded with: --skin",
            )
        once = self.without_repeats(pattern)
        match_own = sum_rows if self.spread else match_rows
        with located(self.source, PatternError):
            match = match_own(pattern, once.drive, once.measure)
        reference = once.reference
        summed = f"{len(self.drive)} rows with drives of several electrodes were summed to pairs"
        return replace(
            once,
            notes=(*once.notes, summed) if self.spread else once.notes,
            voltages=match.apply(once.voltages),
            drive=pattern.drive,
            measure=pattern.measure,
            reference=None if reference is None else match.apply(reference),
        )


def time_notes(time: FloatArray) -> list[str]:
    """What of (n,) s is wrong with the times of frames, in sentences."""
    step = np.diff(time)
    usual = np.median(step[step > 0]) if (step > 0).any() else np.inf
    stands = 1 + np.flatnonzero(~(step > 0))
    jumps = 1 + np.flatnonzero(step > max(_JUMP * usual, _LONG))
    return [
        f"{len(at)} times {what}: frames {', '.join(map(str, at[:_LISTED].tolist()))}"
        f"{', …' if len(at) > _LISTED else ''}; {then}"
        for at, what, then in (
            (stands, "do not go on", "each is taken to be one interval after the frame before"),
            (jumps, "jump ahead", "nothing is known of what was between"),
        )
        if len(at)
    ]


def _absurd(key: str, absurd: NDArray[np.bool_], most: float) -> str:
    count = np.count_nonzero(absurd)
    where = ""
    if key != "reference":
        frames = np.flatnonzero(absurd.reshape(len(absurd), -1).any(axis=1)).tolist()
        listed = ", ".join(map(str, frames[:_LISTED]))
        where = f" (frames {listed}{', …' if len(frames) > _LISTED else ''})"
    return f"{count} values of {key}{where} are beyond {most:.2g} and were excluded"


def _check(got: tuple[int, ...], expected: tuple[int, ...], key: str, source: str) -> None:
    if got != expected:
        raise DataError(f"expected {key} of shape {expected}, got {got}", where=source)


def frame_times(n_frames: int, rate: float = 1.0) -> FloatArray:
    """(n_frames,) s: frames at a constant rate, for files that hold no times."""
    return np.arange(n_frames) / rate


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
