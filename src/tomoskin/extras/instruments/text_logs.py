"""Text logs of EIT-kit, OpenEIT and a serial port, line by line: whole frames are kept,
every other line is counted and listed."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.extras.instruments import tables
from tomoskin.files.imports import voltages_of
from tomoskin.sensing.signal import Recording

_LISTED = 8


@dataclass
class Skipped:
    """Lines that no frame was made of: how many for each reason, and the first of them."""

    counts: dict[str, int] = field(default_factory=dict)
    first: dict[str, list[int]] = field(default_factory=dict)

    def add(self, line: int, why: str, lines: int = 1) -> None:
        """Note ``lines`` lines from number ``line`` (from 1) on."""
        self.counts[why] = self.counts.get(why, 0) + lines
        listed = self.first.setdefault(why, [])
        if len(listed) < _LISTED:
            listed.append(line)

    def notes(self) -> tuple[str, ...]:
        """One sentence for each reason."""
        return tuple(
            f"{count} line{'s' if count > 1 else ''} left out, {why}: "
            f"{', '.join(map(str, self.first[why]))}{', …' if count > len(self.first[why]) else ''}"
            for why, count in self.counts.items()
        )


def numbers_in(text: str, separator: str | None = ",") -> list[float] | None:
    """Numbers between separators, an empty one at the end left out; None when one is none.

    ``separator`` None: spaces, of any number.
    """
    parts = text.strip().rstrip(separator).split(separator)
    try:
        return [float(part) for part in parts]
    except ValueError:
        return None


_ORIGIN = "origin frame"
_BEGINNINGS = (_ORIGIN, "origin", "frame", "framei")
_SIZES = {n * n: n for n in (8, 16, 32)}


@dataclass
class _Block:
    line: int
    is_origin: bool
    values: list[float] = field(default_factory=list)


def is_eit_kit(lines: list[str]) -> bool:
    """Whether one of the first lines is the beginning of its frames."""
    return any(line.strip() == _ORIGIN for line in lines)


def read_eit_kit(lines: Iterable[str], source: str) -> Recording:
    """EIT-kit's text logs: ``origin frame``, then one value a line; each further frame
    likewise.

    A frame is a full scan of neighbouring pairs, n² values drive by drive, zero at driven
    electrodes. The values are root mean squares without signs; pairs are named so that a
    uniform disc reads above zero. The first ``origin frame`` is the reference. Lines carry no
    time: frames are numbered.

    Torn frames and foreign lines are in the notes of the recording.

    Raises
    ------
    DataError
        When there is no whole frame beside the origin.
    """
    skipped = Skipped()
    blocks = _blocks(lines, skipped)
    complete = [block for block in blocks if len(block.values) in _SIZES]
    n_values = len(complete[0].values) if complete else 0
    for block in blocks:
        if len(block.values) != n_values or not n_values:
            skipped.add(block.line, "parts of incomplete frames", 1 + len(block.values))
    kept = [block for block in complete if len(block.values) == n_values]
    frames = [block.values for block in kept if not block.is_origin]
    if not frames:
        held = f"{len(blocks[0].values)} in the first" if blocks else "no frame"
        raise DataError(f"expected frames of 64, 256 or 1024 values, got {held}", where=source)
    rows, used = tables.adjacent_scan(_SIZES[n_values])
    origin = next((np.array(block.values)[used] for block in kept if block.is_origin), None)
    voltages = np.array(frames)[:, used]
    return voltages_of(source, voltages, rows, reference=origin, notes=skipped.notes())


def _blocks(lines: Iterable[str], skipped: Skipped) -> list[_Block]:
    blocks: list[_Block] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if text in _BEGINNINGS:
            blocks.append(_Block(number, text.startswith("origin")))
            continue
        values = numbers_in(text) if text else None
        if values is not None and len(values) == 1 and blocks:
            blocks[-1].values += values
        elif text:
            skipped.add(number, "no values")
    return blocks


_WORDS = ("magnitudes", "impedances")
_TWO_TERMINAL = 28
_SCANS = {32: (8, 3), 40: (8, 1), 192: (16, 8), 208: (16, 1), 896: (32, 16), 928: (32, 1)}
"""Values of a frame → electrodes, and how far apart the driven ones are."""

_CANCELS = 0.5
"""Drives whose sum is less than this part of the sum of their sizes have no polarity in common."""


def is_open_eit(lines: list[str]) -> bool:
    """Whether one of the first lines begins as its frames do."""
    return any(line.strip().startswith(_WORDS) for line in lines)


def read_open_eit(lines: Iterable[str], source: str) -> Recording:
    """OpenEIT's text logs: one frame a line, ``magnitudes : 27159.1250 , 32341.4375 , …``.

    The number of values tells electrodes and drive: pyEIT's scan order with the drive spread as
    the firmware sets it, or every pair of 8 electrodes by two terminals. Commas or spaces separate
    values. The instrument gives sizes of impedances without signs, its simulator voltages with
    signs: :func:`_turned` tells them apart. Each measuring pair is turned so that a uniform disc
    reads above zero. Opposite drives come from both ends; their mean counts, as the instrument
    favours one end. Lines carry no time: frames are numbered.

    Lines that are no whole frame are in the notes of the recording.

    Raises
    ------
    DataError
        When no line is a whole frame; the message says what the first one holds.
    """
    frames: list[list[float]] = []
    skipped = Skipped()
    odd, comma = "", False
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        word, colon, rest = line.partition(":")
        values = _values(rest) if colon and word.strip() in _WORDS else None
        if values is None:
            skipped.add(number, "no frames")
            odd = odd or (f'"{line.strip()[:40]}" in line {number}' if colon else "")
        elif _expected(frames, len(values)):
            frames.append(values)
            continue
        else:
            skipped.add(number, "another number of values")
            odd = odd or f"{len(values)} in line {number}"
        comma = comma or _has_decimal_comma(rest)
    if not frames:
        counts = ", ".join(map(str, sorted({_TWO_TERMINAL, *_SCANS})))
        raise DataError(
            f"expected frames of {counts} values, got {odd or 'none'}",
            where=source,
            hint="numbers must have a decimal point, not a comma" if comma else "",
        )
    voltages, rows, note = _turned(np.array(frames))
    notes = (*skipped.notes(), *filter(None, (note,)))
    return voltages_of(source, voltages, rows, notes=notes).without_repeats()


def _values(text: str) -> list[float] | None:
    """Numbers between commas, or else between spaces."""
    between_spaces = None if "," in text else numbers_in(text, None)
    return between_spaces or numbers_in(text)


def _has_decimal_comma(text: str) -> bool:
    """Whether a comma stands between digits, and there is no decimal point."""
    return "." not in text and re.search(r"\d,\d", text) is not None


def _turned(
    frames: FloatArray,
) -> tuple[FloatArray, tuple[IntArray, IntArray], str]:
    """Values (n_frames, n) as a uniform disc reads them above zero, their rows, and what was found.

    A log of sizes has each of them above zero; one of voltages those of pairs that are turned
    below. What of the two makes the sum of all values larger is taken, and of voltages the
    polarity that does: one for all, or where this cancels most of the sum, one for each drive.
    """
    drive, measure = rows_of(frames.shape[1])
    mean = np.nan_to_num(frames).mean(axis=0)
    if (mean >= 0.0).all() or len(mean) == _TWO_TERMINAL:
        return frames, (drive, measure), ""
    starts = np.flatnonzero(np.append(True, (drive[1:] != drive[:-1]).any(axis=1)))
    turns = np.where((measure == _scan(len(mean))[1]).all(axis=1), 1.0, -1.0)
    sums = {kind: np.add.reduceat(mean * s, starts) for kind, s in (("v", turns), ("s", 1.0))}
    is_signed = np.abs(sums["v"]).sum() >= np.abs(sums["s"]).sum()
    sign, of_drives = (turns, sums["v"]) if is_signed else (np.ones(len(mean)), sums["s"])
    polarity, whose = np.full(len(starts), np.sign(of_drives.sum()) or 1.0), "one"
    if abs(of_drives.sum()) < _CANCELS * np.abs(of_drives).sum():
        polarity, whose = np.where(of_drives < 0.0, -1.0, 1.0), "each drive's own"
    sign = sign * np.repeat(polarity, np.diff(np.append(starts, len(mean))))
    agree = float(np.mean(mean * sign > 0.0))
    note = f"its values have signs, read with {whose} polarity; {agree:.0%} are those of a disc"
    return frames * sign, (drive, measure), note


def _expected(frames: list[list[float]], count: int) -> bool:
    if frames:
        return count == len(frames[0])
    return count == _TWO_TERMINAL or count in _SCANS


def rows_of(count: int) -> tuple[IntArray, IntArray]:
    """Drive and measure (count, 2) of a frame of so many values."""
    if count == _TWO_TERMINAL:
        pairs = np.array(list(combinations(range(8), 2)), dtype=np.int64)
        return pairs, pairs
    drive, measure = _scan(count)
    return drive, tables.for_magnitudes(drive, measure, _SCANS[count][0])


def _scan(count: int) -> tuple[IntArray, IntArray]:
    """Drive and measure (count, 2) as pyEIT has them, not turned."""
    n, spread = _SCANS[count]
    e = np.arange(n)
    drives = np.column_stack([e, (e + spread) % n])
    return tables.scan_of(drives, tables.neighbours(n)[:, ::-1])[0]


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


def is_serial_log(lines: list[str]) -> bool:
    """Whether the header is there."""
    return any(line.strip().startswith(_HEADER) for line in lines)


def read_serial_log(lines: Iterable[str], source: str) -> Recording:
    """A sheet's serial log with reboots and torn lines: time, load, board time, 16 values in
    mV.

    ``time_pc [s],Mass [g],time_mcu[ms],data [mV]`` (19 fields, perhaps an empty one behind). A
    line with ``A`` in place of the values begins a frame; 16 lines follow, one a drive, each
    with the voltages of the 16 neighbouring pairs, its driven pair at its own place. The signs
    are those of a uniform disc after the amplifier's offset (about 0.1 V), which the log does
    not give and which leaves with a difference. A frame counts when its 16 lines follow each
    other without a break.

    Every other line is in the notes of the recording.

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
    rows, used = tables.adjacent_scan(_N)
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
