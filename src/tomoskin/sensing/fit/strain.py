"""Smooth strains of a whole sheet, by few numbers: a fold along a line, an even stretch.

A strained sheet conducts as a tensor, σ₀ exp(L). Of a strain with the principal directions d and
across it, L = A·1 + B·(2ddᵀ − 1) to first order: A is what the mean strain does, B what its
deviator does, and how they are related is the material's. A fold bends the sheet along a line, so
that its layer is strained across that: A and B fall off with the distance q from the line, in
widths, as a profile does that lies half-way between a normal distribution and an even strip of the
same second moment (Gram & Charlier: Kendall & Stuart 1977, section 6.17). An even stretch is the
same all over; so is a sheet wrapped round a cylinder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from tomoskin.core import FloatArray

Kind = Literal["fold", "stretch"]

ANGLE, OFFSET, LOG_WIDTH, LEVEL, DEVIATOR = range(5)
"""Numbers of a fold: its axis, rad from x; distance of the origin from it, m, to the right as seen
along the axis; logarithm of its width in m; and L in its middle. A stretch has the level, and xx
and xy of the deviator."""

_WIDTH = 0.09
"""Usual width of a fold, its profile's standard deviation, in parts of the sheet's breadth."""

_LEAST, _MOST = 0.03, 0.2
"""Least and largest: narrower than a touch, and a fold that is wider is a stretch."""

_INSIDE = 0.85
"""A fold runs across the sheet: no farther from its origin than this part of its reach."""

_LARGEST = 1.2
"""Largest L of mean strain and of deviator that a model holds: a third of the conductance is left.
"""

_DEVIATIONS = (0.9, 0.3, 0.6, 0.15, 0.1)
"""Of the five numbers, before the data speak: the axis is as even as a standard deviation can say,
and the offset is in parts of the breadth."""

_FLAT = 0.12
"""How much flatter than a normal distribution the profile is, as the part of the fourth Hermite
function: half of what a strip has that is bent evenly (0.245)."""

_OTHERWISE = (0.05, 0.12, 0.08, 0.08, 0.05)
"""Standard deviations of what a fold has that its profile does not say, as parts of it: it is skew,
flatter or more pointed; differs from one end to the other, and in the middle; and its line is bent.
"""

_UNEVEN = 0.03
"""By how much a stretch is uneven, standard deviation, as a part of it."""


@dataclass(frozen=True)
class StrainPrior:
    """What is likely of a deformation of a sheet.

    Attributes
    ----------
    breadth
        Of the sheet, m: of a square of the same area.
    """

    breadth: float

    @property
    def log_widths(self) -> tuple[float, float]:
        """Least and largest logarithm of a fold's width in m."""
        return math.log(_LEAST * self.breadth), math.log(_MOST * self.breadth)

    def middle(self, kind: Kind) -> FloatArray:
        """Most likely numbers of a ``kind``."""
        width = math.log(_WIDTH * self.breadth)
        return np.array([0.0, 0.0, width, 0.0, 0.0]) if kind == "fold" else np.zeros(3)

    def deviations(self, kind: Kind) -> FloatArray:
        """Standard deviations of the numbers of a ``kind``."""
        angle, offset, width, level, deviator = _DEVIATIONS
        if kind == "stretch":
            return np.array([level, deviator, deviator])
        return np.array([angle, offset * self.breadth, width, level, deviator])

    def held(self, strain: Strain, reach: float) -> Strain:
        """The same within what a sheet of that ``reach`` m from its origin can show."""
        numbers = strain.numbers.copy()
        levels = slice(LEVEL if strain.kind == "fold" else 0, None)
        numbers[levels] = np.clip(numbers[levels], -_LARGEST, _LARGEST)
        if strain.kind == "stretch":
            return Strain("stretch", numbers)
        numbers[LOG_WIDTH] = np.clip(numbers[LOG_WIDTH], *self.log_widths)
        numbers[OFFSET] = np.clip(numbers[OFFSET], -_INSIDE * reach, _INSIDE * reach)
        return Strain("fold", numbers)


@dataclass(frozen=True, eq=False)
class Strain:
    """A deformation of the whole sheet: its ``kind`` and ``numbers`` (d,)."""

    kind: Kind
    numbers: FloatArray

    @classmethod
    def none(cls, kind: Kind = "stretch") -> Self:
        """Of no amount."""
        return cls(kind, np.zeros(5 if kind == "fold" else 3))

    @property
    def levels(self) -> tuple[float, float]:
        """L in the middle: of the mean strain, and the size of the deviator's."""
        if self.kind == "fold":
            return float(self.numbers[LEVEL]), float(self.numbers[DEVIATOR])
        return float(self.numbers[0]), float(np.hypot(*self.numbers[1:]))

    @property
    def size(self) -> float:
        """How large L is."""
        return math.hypot(*self.levels)

    @property
    def is_beyond(self) -> bool:
        """Whether it is as large as a model holds, or would be larger."""
        return self.size >= _LARGEST

    def away(self, other: Strain) -> float:
        """How large the largest difference of L to an ``other`` strain is, about."""
        if self.kind != other.kind:
            return self.size + other.size
        points = np.outer(np.linspace(-1.0, 1.0, 9), [1.0, 0.0]) * _PROBE
        points = np.concatenate([points, points[:, ::-1]])
        return float(np.abs(self.field(points) - other.field(points)).max())

    def bends(self, step: FloatArray, breadth: float) -> float:
        """By what part derivatives at the sheet at rest are wrong after a ``step`` (d,), about: by
        L, and by how far a fold has moved in parts of its width, at the ends of its axis too."""
        if self.kind == "stretch":
            return self.size + float(np.abs(step).max())
        width = math.exp(self.numbers[LOG_WIDTH])
        turned, beside, wider, *levels = np.abs(step).tolist()
        farther: float = max((turned * breadth / 2 + beside) / width, wider)
        return farther + self.size + float(max(levels))

    def moved(self, step: FloatArray) -> Strain:
        """With other numbers, by a ``step`` (d,)."""
        return Strain(self.kind, self.numbers + step)

    def field(self, points: FloatArray) -> FloatArray:
        """(n, 3) xx, yy, xy of L at ``points`` (n, 2) m."""
        if self.kind == "stretch":
            level, xx, xy = self.numbers
            return np.tile([level + xx, level - xx, xy], (len(points), 1))
        height = profile(self._away(points)[0])[0]
        return np.asarray(height[:, None] * self._middle)

    def slopes(self, points: FloatArray) -> FloatArray:
        """(n, 3, d) derivatives of :meth:`field` by the numbers."""
        if self.kind == "stretch":
            return np.tile(np.array([[1.0, 1, 0], [1, -1, 0], [0, 0, 1]]), (len(points), 1, 1))
        (q, along), (_, _, log_width, _, _) = self._away(points), self.numbers
        width = math.exp(log_width)
        height, fall = profile(q)
        middle, (even, turned, across) = self._middle, self._tensors
        deviator = self.numbers[DEVIATOR]
        out = np.empty((len(points), 3, 5))
        # the axis turns about the origin: d(across)/dθ is the way along it
        out[..., ANGLE] = np.outer(fall * along / width, middle)
        out[..., ANGLE] += np.outer(height, deviator * across)
        out[..., OFFSET] = np.outer(-fall / width, middle)
        out[..., LOG_WIDTH] = np.outer(-q * fall, middle)
        out[..., LEVEL] = np.outer(height, even)
        out[..., DEVIATOR] = np.outer(height, turned)
        return out

    def otherwise(self, points: FloatArray, breadth: float, size: float) -> FloatArray:
        """(n, 3, k) what L may have that no numbers say, a standard deviation each.

        Of a fold: its profile is skew, or has another shape, and it differs along the axis. Of a
        stretch: it is uneven. As parts of how large L is, or has been: its ``size``.
        """
        x, y = points.T * (2.0 / breadth)
        if self.kind == "stretch":
            shapes = np.stack([x, y, x * y, x**2 - y**2, x**2 + y**2 - 0.6])
            part = _UNEVEN * size
            tensors = np.array([[1.0, 1, 0], [0.6, -0.6, 0], [0, 0, 0.6]])
        else:
            q, along = self._away(points)
            along = along * (2.0 / breadth)
            height = np.exp(-(q**2) / 2)
            skew, shape = (q**3 - 3 * q) / math.sqrt(6), (q**4 - 6 * q**2 + 3) / math.sqrt(24)
            shapes = height * np.stack([skew, shape, along, along**2, q * along**2])
            shapes *= np.array(_OTHERWISE)[:, None]
            even, turned, _ = self._tensors
            part, tensors = size, np.stack([even, 0.6 * turned])
        return np.asarray(part * np.einsum("kn,tj->njkt", shapes, tensors).reshape(len(x), 3, -1))

    def _away(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) distance from the axis, in widths, and (n,) place along it, m."""
        c, s = math.cos(self.numbers[ANGLE]), math.sin(self.numbers[ANGLE])
        across = points @ np.array([s, -c]) - self.numbers[OFFSET]
        return across / math.exp(self.numbers[LOG_WIDTH]), points @ np.array([c, s])

    @property
    def _tensors(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(3,) xx, yy, xy: of 1, of 2dd^T − 1 across the axis, and its derivative by the axis."""
        c, s = math.cos(2 * self.numbers[ANGLE]), math.sin(2 * self.numbers[ANGLE])
        return np.array([1.0, 1, 0]), np.array([-c, c, -s]), 2.0 * np.array([s, -s, -c])

    @property
    def _middle(self) -> FloatArray:
        """(3,) L on the axis."""
        even, turned, _ = self._tensors
        return np.asarray(self.numbers[LEVEL] * even + self.numbers[DEVIATOR] * turned)


_PROBE = 0.1
"""Reach of the points in which strains are compared, m."""


def profile(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n,) height of a fold at ``q`` (n,) widths from its line, about 1 there; and its slope."""
    square = q * q
    bell, part = np.exp(-square / 2), _FLAT / math.sqrt(24)
    shape = 1.0 - part * (square**2 - 6 * square + 3)
    return bell * shape, -bell * (q * shape + part * (4 * q * square - 12 * q))


def exponential(tensors: FloatArray) -> FloatArray:
    """(n, 2, 2) exp(L) of symmetric ``tensors`` (n, 3), xx, yy, xy."""
    xx, yy, xy = tensors.T
    mean, half = (xx + yy) / 2, (xx - yy) / 2
    size = np.maximum(np.hypot(half, xy), 1e-12)
    even, odd = np.exp(mean) * np.cosh(size), np.exp(mean) * np.sinh(size) / size
    return np.array([[even + odd * half, odd * xy], [odd * xy, even - odd * half]]).transpose(
        2, 0, 1
    )
