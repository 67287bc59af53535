"""The corner of an L-curve."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray, ModelError

_LEAST = 0.3
"""Total turn, in rad, below which a curve has no corner: a straight line or a gentle arc."""


def corner(t: FloatArray, x: FloatArray, y: FloatArray) -> int:
    """Index of the largest curvature of the curve (x, y) over its parameter t, ascending.

    The curve falls from left to right; only bends towards the origin count, and the ends do
    not. Hansen & O'Leary 1993, equation 4.

    Raises
    ------
    ModelError
        When the curve does not bend towards the origin anywhere, or hardly.
    """
    dx, dy = np.gradient(x, t), np.gradient(y, t)
    ddx, ddy = np.gradient(dx, t), np.gradient(dy, t)
    speed = np.maximum(dx**2 + dy**2, np.finfo(float).tiny)
    # with t ascending x grows and y falls: a bend towards the origin turns left
    turn = (dx * ddy - dy * ddx) / speed
    curvature = turn / np.sqrt(speed)
    inner = np.arange(len(t))[3:-3]
    peaks = [i for i in inner if curvature[i] == curvature[i - 3 : i + 4].max() and turn[i] > 0]
    bends = [i for i in peaks if _turned(t, turn, i) >= _LEAST]
    if not bends:
        raise ModelError(
            "the L-curve has no corner",
            where="rule l-curve",
            hint="choose another rule, such as gcv or light-touch",
        )
    return int(max(bends, key=lambda i: curvature[i]))


def _turned(t: FloatArray, turn: FloatArray, at: int) -> float:
    """Angle, in rad, by which the curve turns to the left around ``at``, as far as it does."""
    right = np.flatnonzero(turn[at:] <= 0)
    left = np.flatnonzero(turn[at::-1] <= 0)
    stop = at + (int(right[0]) if len(right) else len(t) - at)
    start = at + 1 - (int(left[0]) if len(left) else at + 1)
    return float(np.trapezoid(turn[start:stop], t[start:stop]))
