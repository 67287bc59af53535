"""Touches as a table: one row a touch, SI units."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from pathlib import Path

from tomoskin.core import DataError, Touch

HEADER = (
    *("frame", "time_s", "id", "x_m", "y_m", "sd_x_m", "sd_y_m"),
    *("area_m2", "peak", "kind"),
)


def write_touches(path: Path, frames: Iterable[tuple[int, float, tuple[Touch, ...]]]) -> int:
    """Write touches of (frame, time, touches); return the number of rows.

    A standard deviation that is not known is an empty field; the kind is :attr:`Touch.said`.

    Raises
    ------
    DataError
        When the file cannot be written.
    """
    count = 0
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(HEADER)
            for frame, time, touches in frames:
                for touch in touches:
                    table.writerow(_row(frame, time, touch))
                    count += 1
    except OSError as error:
        raise DataError(f"cannot be written: {error.strerror}", where=str(path)) from error
    return count


def _row(frame: int, time: float, touch: Touch) -> tuple[object, ...]:
    r = touch.reading
    place = (_number(r.x), _number(r.y), _number(r.sd_x), _number(r.sd_y))
    return (frame, f"{time:.6f}", touch.id, *place, _number(r.area), _number(r.peak), touch.said)


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.6g}"
