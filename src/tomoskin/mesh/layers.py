"""Grid lines along one axis: marks exactly, finer beside them, coarser away from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from tomoskin.core import FloatArray, GeometryError
from tomoskin.mesh.boundary import AT_ELECTRODE, MIN_FACETS
from tomoskin.mesh.sizing import SizeField

GROWTH = 0.5
"""Spacing gained per unit of distance from a mark."""

_SAME = 1e-9
"""Marks nearer than this fraction of the axis are one."""

_SAMPLES = 400
"""Points between two marks at which the wanted spacing is asked for."""


def grid_lines(low: float, high: float, marks: Sequence[float], count: int) -> FloatArray:
    """(n + 1,) lines from ``low`` to ``high`` through every mark, n about ``count``, m.

    Without marks between the ends there are exactly ``count`` equal steps. A mark is the edge
    of an electrode: the steps beside it are 0.4 of those far from it, and at least two fit
    between two marks. There are more steps than asked for where marks need them.

    Raises
    ------
    GeometryError
        When ``count`` is below 1.
    """
    if count < 1:
        raise GeometryError(f"expected at least 1 layer, got {count}")
    stops = _stops(low, high, marks)
    span = high - low

    def excess(coarse: float) -> float:
        return sum(_steps(stops, coarse)) - count

    coarse = span if excess(span) > 0 else float(brentq(excess, span / count * 0.999, span))
    pieces = []
    for i, steps in enumerate(_steps(stops, coarse)):
        least = MIN_FACETS if 0 < i < len(stops) - 2 else 1
        pieces.append(_piece(stops, i, coarse, max(least, round(steps))))
    return np.concatenate([*pieces, [high]])


def _stops(low: float, high: float, marks: Sequence[float]) -> FloatArray:
    """The ends and the marks, ascending, each height once."""
    near = _SAME * (high - low)
    inner = sorted(m for m in marks if low + near < m < high - near)
    kept = [m for i, m in enumerate(inner) if i == 0 or m - inner[i - 1] > near]
    return np.array([low, *kept, high])


def _field(stops: FloatArray, coarse: float) -> SizeField | None:
    """Spacing wanted around the inner stops; None where there is none."""
    if len(stops) == 2:
        return None
    gaps = np.diff(stops)
    narrow = np.minimum(gaps[1:], gaps[:-1]) / MIN_FACETS
    return SizeField(coarse, stops[1:-1, None], np.minimum(narrow, AT_ELECTRODE * coarse), GROWTH)


def _running(stops: FloatArray, i: int, coarse: float) -> tuple[FloatArray, FloatArray]:
    """Samples of interval ``i`` and the number of steps wanted up to each."""
    z = np.linspace(stops[i], stops[i + 1], _SAMPLES)
    field = _field(stops, coarse)
    density = np.full(len(z), 1 / coarse) if field is None else 1 / field(z[:, None])
    steps = np.diff(z) * (density[1:] + density[:-1]) / 2
    return z, np.concatenate([[0.0], np.cumsum(steps)])


def _steps(stops: FloatArray, coarse: float) -> list[float]:
    """Number of steps wanted in each interval, not rounded."""
    return [float(_running(stops, i, coarse)[1][-1]) for i in range(len(stops) - 1)]


def _piece(stops: FloatArray, i: int, coarse: float, parts: int) -> FloatArray:
    """Lines of interval ``i`` without its end."""
    z, running = _running(stops, i, coarse)
    lines = np.interp(np.arange(parts) * (running[-1] / parts), running, z)
    lines[0] = stops[i]
    return np.asarray(lines)
