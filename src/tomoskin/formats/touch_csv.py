"""Touches as a table: one row a touch, SI units."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from pathlib import Path

from tomoskin.core import Touch, written
from tomoskin.mesh import Plane, Surface

HEADER = (
    *("frame", "time_s", "id", "x_m", "y_m", "sd_x_m", "sd_y_m"),
    *("area_m2", "peak", "kind"),
)

FORCE = ("force_n", "force_low_n", "force_high_n", "force_state")
"""Further columns where a calibration tells forces: median, interval that nine in ten lie in, and
"calibrated" or "uncalibrated"."""

ELAPSED = "elapsed_s"
"""The last column where it is known when a recording began: s since its first frame."""

IN_SPACE = ("space_x_m", "space_y_m", "space_z_m")
"""Further columns where the sheet lies on a surface; x_m and y_m are the sheet's own (u, v)."""


def write_touches(
    path: Path,
    frames: Iterable[tuple[int | None, float, tuple[Touch, ...]]],
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
    a ``surface`` that is not flat each row ends with the touch's place on it.

    Raises as :func:`written` does.
    """
    count = 0
    on = None if isinstance(surface, Plane) else surface
    with (
        written(path, overwrite=overwrite) as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        table = csv.writer(file, lineterminator="\n")
        since = () if begun is None else (ELAPSED,)
        table.writerow(HEADER + (FORCE if forces else ()) + (IN_SPACE if on else ()) + since)
        for frame, time, touches in frames:
            for touch in touches:
                more = _force(touch) if forces else ()
                last = () if begun is None else (f"{time - begun:.6f}",)
                table.writerow(_row(frame, time, touch) + more + _in_space(touch, on) + last)
                count += 1
    return count


def _row(frame: int | None, time: float, touch: Touch) -> tuple[object, ...]:
    r = touch.detection
    place = (_number(r.x), _number(r.y), _number(r.sd_x), _number(r.sd_y))
    number = "" if frame is None else frame
    return (number, f"{time:.6f}", touch.id, *place, _number(r.area), _number(r.peak), touch.said)


def _force(touch: Touch) -> tuple[str, ...]:
    force = touch.detection.force
    if force is None:
        return ("",) * len(FORCE)
    return (*map(_number, (force.newtons, force.low, force.high)), force.state)


def _in_space(touch: Touch, surface: Surface | None) -> tuple[str, ...]:
    if surface is None:
        return ()
    place = surface.point([[touch.detection.x, touch.detection.y]])[0]
    return tuple(map(_number, place.tolist()))


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.6g}"
