"""EIT-kit's text logs: ``origin frame``, then one value a line; each further frame likewise.

A frame is a full scan of neighbouring pairs, n² values drive by drive, zero at driven electrodes.
The values are root mean squares without signs; pairs are named so that a uniform disc reads above
zero. The first ``origin frame`` is the reference. Lines carry no time: frames are numbered.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from tomoskin.core import DataError
from tomoskin.files.imports.tables import adjacent_scan, voltages_of
from tomoskin.files.imports.text_log import Skipped, numbers_in
from tomoskin.sensing.signal import Recording

_ORIGIN = "origin frame"
_BEGINNINGS = (_ORIGIN, "origin", "frame", "framei")
_SIZES = {n * n: n for n in (8, 16, 32)}


@dataclass
class _Block:
    line: int
    is_origin: bool
    values: list[float] = field(default_factory=list)


def detects(lines: list[str]) -> bool:
    """Whether one of the first lines is the beginning of its frames."""
    return any(line.strip() == _ORIGIN for line in lines)


def parse(lines: Iterable[str], source: str) -> Recording:
    """Return the recording; torn frames and foreign lines are in its notes.

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
    rows, used = adjacent_scan(_SIZES[n_values])
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
