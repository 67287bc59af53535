"""Touches as tables, SI units: one row a touch and frame, or each touch once."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import MEASURANDS, Amount, Touch
from tomoskin.model.mesh import Plane, Surface


@dataclass(frozen=True, slots=True)
class Span:
    """A touch from its first frame to its last, s.

    ``x``, ``y`` (m) and ``peak`` (in the image's unit) are those of the frame in which it is
    strongest, if possible one in which it is not merged with another.
    """

    id: int
    kind: str
    begin: float
    end: float
    x: float
    y: float
    peak: float


def touch_spans(frames: Iterable[tuple[float, tuple[Touch, ...]]]) -> tuple[Span, ...]:
    """The touches in (time, touches) of frames, by their beginning.

    A number that is given again, after another start, is another touch. One that is merged with
    others goes on in what stands for it.
    """
    found: dict[tuple[int, float], tuple[float, float, Touch]] = {}
    since: dict[int, float] = {}
    for time, touches in frames:
        for touch in touches:
            since[touch.id] = touch.since
            for number in touch.merged or (touch.id,):
                key = number, since.setdefault(number, touch.since)
                begin, _, best = found.get(key, (time, time, touch))
                found[key] = begin, time, max(best, touch, key=_weight)
    spans = (
        Span(number, best.kind, begin, end, r.x, r.y, r.peak)
        for (number, _), (begin, end, best) in found.items()
        for r in [best.detection]
    )
    return tuple(sorted(spans, key=lambda span: (span.begin, span.id)))


def _weight(touch: Touch) -> tuple[bool, float]:
    return not touch.merged, abs(touch.detection.peak)


COLUMNS = (
    *("frame", "time_s", "id", "x_m", "y_m", "sd_x_m", "sd_y_m"),
    *("area_m2", "peak", "kind"),
)

Measurands = Collection[str]
"""Some of the names of :data:`~tomoskin.core.MEASURANDS`. Where a calibration measures one, its
median, the interval that nine in ten lie in, and "calibrated" are further columns: ``force_n``,
``force_low_n``, ``force_high_n``, ``force_state``."""

IN_SPACE = ("space_x_m", "space_y_m", "space_z_m")
"""Further columns where the sheet lies on a surface; x_m and y_m are the sheet's own (u, v)."""

ELAPSED = "elapsed_s"
"""The last column where it is known when a recording began: s since its first frame."""

TouchedFrame = tuple[int | None, float, tuple[Touch, ...]]
"""Index of a frame in the recording (None where that does not hold it), its time, its touches."""

Value = int | float | str | None


def columns_of(
    surface: Surface | None = None, *, measured: Measurands = (), begun: float | None = None
) -> tuple[str, ...]:
    """Names of the columns, with those of what is ``measured``, of a ``surface`` that is not flat,
    and of the time since the recording has ``begun``."""
    in_space = IN_SPACE if _curved(surface) else ()
    amounts = [
        f"{name}_{part}"
        for name, unit in MEASURANDS.items()
        if name in measured
        for part in (unit.lower(), f"low_{unit.lower()}", f"high_{unit.lower()}", "state")
    ]
    return (*COLUMNS, *amounts, *in_space, *(() if begun is None else (ELAPSED,)))


def touch_rows(
    frames: Iterable[TouchedFrame],
    surface: Surface | None = None,
    *,
    measured: Measurands = (),
    begun: float | None = None,
) -> Iterator[tuple[Value, ...]]:
    """One row a touch, in the order of :func:`columns_of`; NaN for what is not known."""
    on = _curved(surface)
    for frame, time, touches in frames:
        for touch in touches:
            d, number = touch.detection, -1 if frame is None else frame
            row: tuple[Value, ...] = (number, time, touch.id, d.x, d.y, d.sd_x, d.sd_y)
            row += (d.area, d.peak, touch.said)
            for name in MEASURANDS:
                if name in measured:
                    row += amount_values(touch.amounts.get(name))
            if on is not None:
                row += tuple(on.point([[d.x, d.y]])[0].tolist())
            yield row if begun is None else (*row, time - begun)


def touch_columns(
    frames: Iterable[TouchedFrame], surface: Surface | None = None, *, measured: Measurands = ()
) -> dict[str, NDArray[np.generic]]:
    """Columns by their name, (n,) each, as ``pandas.DataFrame`` takes them.

    ``frame`` is −1 where the recording does not hold the frame; what is not known is NaN.
    """
    names = columns_of(surface, measured=measured)
    rows = list(touch_rows(frames, surface, measured=measured))
    columns = dict(zip(names, zip(*rows, strict=True), strict=True)) if rows else {}
    return {name: np.array(columns.get(name, ()), _kind(name)) for name in names}


def _kind(name: str) -> type:
    if name in ("frame", "id"):
        return np.int64
    return np.str_ if name == "kind" or name.endswith("_state") else np.float64


def _curved(surface: Surface | None) -> Surface | None:
    return None if isinstance(surface, Plane) else surface


def measured_in(frames: Iterable[TouchedFrame]) -> Measurands:
    """What calibrations tell of a touch of any frame."""
    return {name for *_, touches in frames for touch in touches for name in touch.amounts}


def amount_values(amount: Amount | None) -> tuple[float, float, float, str]:
    """As in the columns of one of :data:`Measurands`; NaN and "" where nothing tells it."""
    if amount is None:
        return (math.nan, math.nan, math.nan, "")
    return (amount.value, amount.low, amount.high, "calibrated")
