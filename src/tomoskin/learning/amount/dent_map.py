"""The dent of touches whose depths are known: by how much the sheet gives way, all over it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from tomoskin.core import Amount, DataError, Detection, FloatArray
from tomoskin.learning.amount.amount_process import HALF

TIP = 0.011, 0.35
"""Radius of a tip of which nothing is known, m, and deviation of its logarithm: 6 to 20 mm. A frame
tells it from the depth badly."""

_SPREAD = 4.0, 0.7
"""A sheet in tension carries a dent farther than its layer alone, as one so many times as thick
would; and deviation of the logarithm of that. Assumed: neither tension nor modulus is known."""

_NEAR = 1e-9

_AWAY = np.concatenate([[0.0], np.geomspace(1e-4, 10, 4000)])
"""Distances from the middle of a touch for which the fall is kept, m: a page asks at its rate."""


class DentMap(NamedTuple):
    """Deflection (n,) m of the sheet, 0 where it is at rest, and its standard deviation (n,) m."""

    deflection: FloatArray
    deviation: FloatArray


def fall(distance: FloatArray, radius: float, layer: float) -> FloatArray:
    """Deflection (…,) at a ``distance`` m from the middle of a flat tip, in parts of its depth.

    It is 1 under the tip. Outside of it an elastic half-space gives way by (2/π) asin(a/r)
    (Sneddon 1965, Int. J. Eng. Sci. 3, 47; Johnson 1985, section 3.8). A layer of thickness t on a
    stiff base gives way less by what mirrored tips at t and 2t say: its compliance under waves of
    wave number q, over that of the half-space, is 1 − (3e⁻ᵠᵗ − e⁻²ᵠᵗ)/2, exact for long and short
    waves and within 0.04 between (no bulging, glued: Barthel & Perriot 2007, J. Phys. D 40, 1059),
    and ∫ e⁻ᵠᶻ sin(qa) J₀(qr)/q dq has a closed form (Gradshteyn & Ryzhik, 6.752). The modulus
    cancels out.
    """
    outside = np.maximum(distance, radius)
    at, rim = (
        _mirrored(r, radius, 0.0)
        - 1.5 * _mirrored(r, radius, layer)
        + 0.5 * _mirrored(r, radius, 2 * layer)
        for r in (outside, np.array(radius))
    )
    return np.asarray(np.clip(at / rim, 0.0, 1.0))


def _mirrored(distance: FloatArray, radius: float, z: float) -> FloatArray:
    """The part of a tip that is mirrored at depth ``z``: ∫ e⁻ᵠᶻ sin(qa) J₀(qr)/q dq."""
    spans = np.hypot(distance + radius, z) + np.hypot(distance - radius, z)
    return np.asarray(np.arcsin(np.minimum(2 * radius / spans, 1.0)))


def dent_map(
    touches: Sequence[Detection],
    points: FloatArray,
    layer: float | None,
    tip: tuple[float, float] = TIP,
) -> DentMap | None:
    """The mean dent of ``touches`` at ``points`` (n, 2) m of a sheet on a ``layer`` m thick.

    Mean and deviation go over the places, depths and tips that are possible: ``tip`` is the radius,
    m, and the deviation of its logarithm. Dents of several touches add up. None where the depth of
    a touch is not known.

    Raises
    ------
    DataError
        Where the layer is not given, or the tip has no size.
    """
    if layer is None:
        raise DataError(
            "the map of a dent needs the thickness of the layer under the sheet",
            hint='say it in the skin file: layer = "3 mm" in [surface]',
        )
    if not (0 < tip[0] < math.inf and 0 <= tip[1] < math.inf):
        raise DataError(f"expected a tip with a radius above 0 m, got {tip[0]:g} ± {tip[1]:g}")
    mean, variance = np.zeros(len(points)), np.zeros(len(points))
    falls = _falls(layer, tip)
    for touch in touches:
        if touch.depth is None:
            return None
        depth, (first, second) = touch.depth, _moments(touch, points, falls)
        mean += depth.value * first
        variance += depth.value**2 * np.maximum(second - first**2, 0) + _sd(depth) ** 2 * second
    return DentMap(np.minimum(mean, layer), np.sqrt(variance))


@lru_cache(maxsize=4)
def _falls(layer: float, tip: tuple[float, float]) -> FloatArray:
    """(2, n) mean of the fall at :data:`_AWAY`, and of its square, over tip and what the sheet
    carries."""
    falls = np.zeros((2, len(_AWAY)))
    for (a, of_a), (t, of_t) in product(_nodes(7), _nodes(3)):
        radius, carried = tip[0] * math.exp(tip[1] * a), _SPREAD[0] * math.exp(_SPREAD[1] * t)
        part = fall(_AWAY, radius, carried * layer)
        falls += of_a * of_t * np.stack([part, part**2])
    return falls


def _moments(
    touch: Detection, points: FloatArray, falls: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n,) mean of the fall, and of its square, over the place too."""
    off = points - (touch.x, touch.y)
    away = np.hypot(*off.T)
    x, y = off.T / np.maximum(away, _NEAR)
    square_x, square_y, mixed = np.nan_to_num([touch.sd_x**2, touch.sd_y**2, touch.cov_xy])
    square = square_x * x**2 + square_y * y**2 + 2 * mixed * x * y + touch.bias**2
    sd = np.sqrt(np.maximum(square, 0))  # of the distance: along the line to each point
    first, second = np.zeros(len(points)), np.zeros(len(points))
    for s, weight in _nodes(3):
        from_middle = np.abs(away + s * sd)
        first += weight * np.interp(from_middle, _AWAY, falls[0])
        second += weight * np.interp(from_middle, _AWAY, falls[1])
    return first, second


def _nodes(count: int) -> list[tuple[float, float]]:
    """Points and weights of a Gaussian mean."""
    at, weight = np.polynomial.hermite_e.hermegauss(count)
    return list(zip(at.tolist(), (weight / weight.sum()).tolist(), strict=True))


def _sd(depth: Amount) -> float:
    """Deviation of a depth by its 90 % interval; by the lower half where that has no end."""
    if math.isinf(depth.high):
        return (depth.value - depth.low) / HALF
    return (depth.high - depth.low) / (2 * HALF)
