"""The table of touches as a .csv file."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable

from tomoskin.core import StrPath, written
from tomoskin.model.mesh import Surface
from tomoskin.sensing.track import ELAPSED, TouchedFrame, columns_of, touch_rows


def write_touches(
    path: StrPath,
    frames: Iterable[TouchedFrame],
    surface: Surface | None = None,
    *,
    forces: bool = False,
    begun: float | None = None,
    overwrite: bool = False,
) -> int:
    """Write touches of (frame, time, touches); return the number of rows.

    A frame is its index in the recording, from 0, and empty where that does not hold it; its time
    is the recording's own.

    ``forces`` adds those of the touches, which are empty where a touch has none; ``begun``, the
    time of the recording's own first frame, adds the time since then.

    A standard deviation that is not known is an empty field; the kind is :attr:`Touch.said`. On
    a ``surface`` that is not flat each row ends with the touch's position on it.

    Raises as :func:`written` does.
    """
    names, count = columns_of(surface, forces=forces, begun=begun), 0
    with (
        written(path, overwrite=overwrite) as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        table = csv.writer(file, lineterminator="\n")
        table.writerow(names)
        for row in touch_rows(frames, surface, forces=forces, begun=begun):
            table.writerow(_text(name, value) for name, value in zip(names, row, strict=True))
            count += 1
    return count


def _text(name: str, value: object) -> str:
    if name in ("time_s", ELAPSED):
        return f"{value:.6f}"
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return "" if name == "frame" and value == -1 else str(value)
