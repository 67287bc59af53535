"""OpenEIT's text logs: one frame a line, ``magnitudes : 27159.1250 , 32341.4375 , …``.

The number of values tells electrodes and drive: pyEIT's scan order with the drive spread as the
firmware sets it, or every pair of 8 electrodes by two terminals. The instrument gives sizes of
impedances without signs; each measuring pair is turned so that a uniform disc reads above zero.
Opposite drives come from both ends; their mean counts, as the instrument favours one end.
Lines carry no time: frames are numbered.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np

from tomoskin.core import DataError, IntArray
from tomoskin.files.imports.tables import for_magnitudes, neighbours, scan_of, voltages_of
from tomoskin.files.imports.text_log import Skipped, numbers_in
from tomoskin.sensing.signal import Recording

_WORDS = ("magnitudes", "impedances")
_TWO_TERMINAL = 28
_SCANS = {32: (8, 3), 40: (8, 1), 192: (16, 8), 208: (16, 1), 896: (32, 16), 928: (32, 1)}
"""Values of a frame → electrodes, and how far apart the driven ones are."""


def detects(lines: list[str]) -> bool:
    """Whether one of the first lines begins as its frames do."""
    return any(line.strip().startswith(_WORDS) for line in lines)


def parse(lines: Iterable[str], source: str) -> Recording:
    """Return the recording; lines that are no whole frame are in its notes.

    Raises
    ------
    DataError
        When no line is a whole frame; the message says what the first one holds.
    """
    frames: list[list[float]] = []
    skipped = Skipped()
    odd = ""
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        word, colon, rest = line.partition(":")
        values = numbers_in(rest) if colon and word.strip() in _WORDS else None
        if values is None:
            skipped.add(number, "no frames")
        elif _expected(frames, len(values)):
            frames.append(values)
        else:
            skipped.add(number, "another number of values")
            odd = odd or f"{len(values)} in line {number}"
    if not frames:
        counts = ", ".join(map(str, sorted({_TWO_TERMINAL, *_SCANS})))
        raise DataError(
            f"expected frames of {counts} values, got {odd or 'none'}",
            where=source,
            hint="numbers must have a decimal point, not a comma",
        )
    rows = rows_of(len(frames[0]))
    recording = voltages_of(source, np.array(frames), rows, notes=skipped.notes())
    return recording.without_repeats()


def _expected(frames: list[list[float]], count: int) -> bool:
    if frames:
        return count == len(frames[0])
    return count == _TWO_TERMINAL or count in _SCANS


def rows_of(count: int) -> tuple[IntArray, IntArray]:
    """Drive and measure (count, 2) of a frame of so many values."""
    if count == _TWO_TERMINAL:
        pairs = np.array(list(combinations(range(8), 2)), dtype=np.int64)
        return pairs, pairs
    n, spread = _SCANS[count]
    e = np.arange(n)
    drives = np.column_stack([e, (e + spread) % n])
    (drive, measure), _ = scan_of(drives, neighbours(n)[:, ::-1])
    return drive, for_magnitudes(drive, measure, n)
