"""How the change of a touch falls off around it: between a spot with a tail and a bell."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tomoskin.core import FloatArray

_SCALES = 6.0
"""A spot ends at this many of its scales."""


class Profile(NamedTuple):
    """How the change falls off around a touch, as the native engine takes it.

    Between a spot with a tail, (1 + v) e⁻ᵛ with v the distance in scales, as a stretched sheet goes
    back to rest on what carries it, and a bell, as soft things press: both are level at the centre.

    Attributes
    ----------
    reach
        Where a spot ends, in radii.
    filling
        Content of a spot of depth 1, in squared radii.
    scales
        At how many of its scales the tail ends.
    narrow, height
        Squared reaches of a bell in one of the spot with a tail; its height over that.
    part
        How far the spot is on the way from a tail to a bell.
    """

    reach: float
    filling: float
    scales: float
    narrow: float
    height: float
    part: float

    @classmethod
    def on(cls, layer: float | None) -> Profile:
        """Of a press on a soft ``layer`` m thick; None where its thickness is not given.

        A sheet is carried along by what it lies on: the thicker that is, the farther, as the root
        of the thickness, and the more the dent itself stands out of that.
        """
        if layer is None:
            return PLAIN
        reach = math.hypot(_TIP, math.sqrt(_CARRIED * layer)) / USUAL
        return PLAIN._replace(reach=reach, narrow=_CORE, height=layer / _SUNK)

    def at(self, square: FloatArray) -> FloatArray:
        """Height at squared distances from the centre, in squared reaches: 1 there, 0 from 1 on."""
        size = 1.0 / (1.0 + self.part * (self.height - 1.0))
        rest = np.maximum(1.0 - self.narrow * square, 0.0)
        tail, bell = _tail_height(square), self.height * rest * rest * rest
        return np.asarray(size * tail + self.part * (size * (bell - tail)))

    def shapes(self, square: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """:meth:`at`, its derivative by its argument, and the whole way from tail to bell."""
        (tail, tail_fall), (bell, bell_fall) = _tail(square), self._bell(square)
        size = 1.0 / (1.0 + self.part * (self.height - 1.0))
        way = size * (bell - tail)
        fall = size * (tail_fall + self.part * (bell_fall - tail_fall))
        return size * tail + self.part * way, fall, way

    def _bell(self, square: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The bell, and its derivative."""
        rest = np.maximum(1.0 - self.narrow * square, 0.0)
        steep = self.height * rest * rest
        return steep * rest, -3.0 * self.narrow * steep


def _tail_height(square: FloatArray) -> FloatArray:
    """The spot with a tail, as :func:`_tail` has it."""
    inside = np.minimum(square, 1.0)
    scales = _SCALES * np.sqrt(inside)
    fading, more = np.exp(-scales), 1.0 + scales
    taper = 1.0 - inside * inside * inside
    fading *= taper
    more *= fading
    more *= taper
    return np.asarray(more)


def _tail(square: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The spot with a tail, drawn to 0 smoothly at its end; and its derivative."""
    inside = np.minimum(square, 1.0)
    scales = _SCALES * np.sqrt(inside)
    fading, third, more = np.exp(-scales), inside * inside * inside, 1.0 + scales
    taper = 1.0 - third
    fading *= taper
    height = more * fading
    height *= taper
    fall = (-6.0 * third) * more
    fall /= np.maximum(inside, 1e-30)
    fall -= 0.5 * _SCALES**2 * taper
    fall *= fading
    return height, fall


def _moments(shape: Callable[[FloatArray], FloatArray]) -> tuple[float, float]:
    """Reach in radii of the disc of the same second moment, and ∫ shape in squared radii."""
    node, weight = np.polynomial.legendre.leggauss(64)
    u = (node + 1.0) / 2.0
    ring = weight / 2.0 * shape(u**2) * u
    reach = math.sqrt(0.5 * float(ring.sum() / (ring @ u**2)))
    return reach, 2.0 * math.pi * float(ring.sum()) * reach**2


def _plain() -> Profile:
    """Half a tail, half a bell of the same content and second moment."""
    narrow, part = 1.15, 0.5
    reach, filling = _moments(lambda square: _tail(square)[0])
    bare = Profile(
        reach, filling, _SCALES, narrow, filling / reach**2 * 4.0 * narrow / math.pi, part
    )
    reach, filling = _moments(bare.at)
    return bare._replace(reach=reach, filling=filling)


PLAIN = _plain()
"""Of a press on what is thin, or is not described."""

FILLING = PLAIN.filling
"""Content of every spot of depth 1, in squared radii; with another profile by convention."""

USUAL = 0.0195
"""Radius that a spot on a layer is given, m."""

_TIP, _CARRIED = 0.027, 0.88
"""Reach of the tail on no layer, m; its square grows by so many m a metre of layer. Both read off
noise-free presses of the twin's knit on foam."""

_CORE, _SUNK = 30.0, 0.012
"""Squared reaches of the dent in one of the tail; thickness of a layer, m, on which both are as
high."""
