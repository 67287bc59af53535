"""Outlines: closed curves walked counter-clockwise by arclength."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ellipeinc

from tomoskin.core import FloatArray, GeometryError


class Outline(Protocol):
    """The rim of a sheet: a simple closed curve, counter-clockwise, by arclength s in m.

    s is taken modulo ``length`` everywhere.
    """

    @property
    def length(self) -> float:
        """The length of the closed curve, in m."""

    @property
    def area(self) -> float:
        """The area inside the curve, in m²."""

    @property
    def centre(self) -> FloatArray:
        """(2,) centroid of the area, m; directions are seen from here. The origin, for a curve."""
        return np.zeros(2)

    @property
    def corners(self) -> FloatArray:
        """(k,) arclengths at which the direction jumps, ascending, m. A curve has none."""
        return np.zeros(0)

    def point(self, s: ArrayLike) -> FloatArray:
        """(n, 2) points at arclengths ``s``, m."""

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(n,) True where a point of ``xy`` (n, 2) lies inside."""

    def nearest(self, xy: ArrayLike) -> FloatArray:
        """(n,) arclengths of the rim points that are nearest to ``xy`` (n, 2)."""

    def toward(self, angle: float) -> float:
        """Arclength where the ray from ``centre`` leaves the sheet for good.

        ``angle`` is in rad, counter-clockwise from +x.
        """

    def polyline(self, step: float) -> FloatArray:
        """(n, 2) rim points at most ``step`` apart, corners among them, not closed."""
        if not step > 0:
            raise GeometryError(f"expected a step above 0 m, got {step:g} m")
        breaks = np.unique(np.append(self.corners, 0.0))
        ends = np.append(breaks[1:], breaks[0] + self.length)
        pieces = [
            np.linspace(a, b, max(3, math.ceil((b - a) / step)), endpoint=False)
            for a, b in zip(breaks, ends, strict=True)
        ]
        return self.point(np.concatenate(pieces))


@dataclass(frozen=True)
class Ellipse(Outline):
    """Ellipse around the origin with half axes in m; s = 0 at (semi_x, 0)."""

    semi_x: float
    semi_y: float

    def __post_init__(self) -> None:
        """Check that both half axes are sizes."""
        check_size("half axis along x", self.semi_x)
        check_size("half axis along y", self.semi_y)

    @cached_property
    def length(self) -> float:
        """Length of the curve, m: a complete elliptic integral of the second kind."""
        return float(self._arclength(2 * math.pi))

    @property
    def area(self) -> float:
        """The area inside the ellipse, in m²."""
        return math.pi * self.semi_x * self.semi_y

    def point(self, s: ArrayLike) -> FloatArray:
        """(n, 2) points at arclengths ``s``, m."""
        t = self._parameter(np.atleast_1d(np.asarray(s, dtype=float)) % self.length)
        return np.column_stack([self.semi_x * np.cos(t), self.semi_y * np.sin(t)])

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(n,) True where a point of ``xy`` (n, 2) lies inside."""
        scaled = np.atleast_2d(np.asarray(xy, dtype=float)) / [self.semi_x, self.semi_y]
        return np.asarray((scaled**2).sum(axis=1) < 1.0)

    def nearest(self, xy: ArrayLike) -> FloatArray:
        """(n,) arclengths of the rim points that are nearest to ``xy`` (n, 2)."""
        target = np.atleast_2d(np.asarray(xy, dtype=float))
        grid = np.linspace(0, 2 * math.pi, 721)[:-1]
        rim = np.column_stack([self.semi_x * np.cos(grid), self.semi_y * np.sin(grid)])
        near = np.linalg.norm(rim[None] - target[:, None], axis=2).argmin(axis=1)
        step = grid[1]
        low, high = grid[near] - step, grid[near] + step
        for _ in range(60):  # bisection on the slope of the squared distance
            middle = (low + high) / 2
            rising = self._slope(middle, target) > 0
            low, high = np.where(rising, low, middle), np.where(rising, middle, high)
        return np.asarray(self._arclength((low + high) / 2) % self.length)

    def toward(self, angle: float) -> float:
        """Arclength where the ray from the origin at ``angle`` rad meets the curve."""
        t = math.atan2(self.semi_x * math.sin(angle), self.semi_y * math.cos(angle))
        return float(self._arclength(t) % self.length)

    def _slope(self, t: FloatArray, target: FloatArray) -> FloatArray:
        a, b = self.semi_x, self.semi_y
        along_x = (a * np.cos(t) - target[:, 0]) * -a * np.sin(t)
        return np.asarray(along_x + (b * np.sin(t) - target[:, 1]) * b * np.cos(t))

    def _arclength(self, t: ArrayLike) -> FloatArray:
        """∫₀ᵗ √(a² sin² + b² cos²) = b·E(t | 1 − a²/b²)."""
        a, b = self.semi_x, self.semi_y
        return np.asarray(b * ellipeinc(np.asarray(t, dtype=float), 1 - (a / b) ** 2))

    def _parameter(self, s: FloatArray) -> FloatArray:
        """Invert the arclength: table, then Newton held inside the table's bracket."""
        grid = np.linspace(0, 2 * math.pi, 1025)
        table = self._arclength(grid)
        piece = np.clip(np.searchsorted(table, s, side="right") - 1, 0, len(grid) - 2)
        low, high = grid[piece], grid[piece + 1]
        t = np.interp(s, table, grid)
        for _ in range(20):
            speed = np.hypot(self.semi_x * np.sin(t), self.semi_y * np.cos(t))
            step = (self._arclength(t) - s) / speed
            t = np.clip(t - step, low, high)
            if np.abs(step).max(initial=0.0) < 1e-15:
                break
        return t


@dataclass(frozen=True)
class Disc(Outline):
    """Disc around the origin, radius in m; s = 0 at (radius, 0)."""

    radius: float

    def __post_init__(self) -> None:
        """Check that the radius is a size."""
        check_size("radius", self.radius)

    @property
    def length(self) -> float:
        """The circumference of the disc, in m."""
        return 2 * math.pi * self.radius

    @property
    def area(self) -> float:
        """The area inside the circle, in m²."""
        return math.pi * self.radius**2

    def point(self, s: ArrayLike) -> FloatArray:
        """(n, 2) points at arclengths ``s``, m."""
        t = np.atleast_1d(np.asarray(s, dtype=float)) / self.radius
        return self.radius * np.column_stack([np.cos(t), np.sin(t)])

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(n,) True where a point of ``xy`` (n, 2) lies inside."""
        target = np.atleast_2d(np.asarray(xy, dtype=float))
        return np.asarray(np.hypot(target[:, 0], target[:, 1]) < self.radius)

    def nearest(self, xy: ArrayLike) -> FloatArray:
        """(n,) arclengths of the rim points that are nearest to ``xy`` (n, 2)."""
        target = np.atleast_2d(np.asarray(xy, dtype=float))
        turn = np.arctan2(target[:, 1], target[:, 0]) % (2 * math.pi)
        return np.asarray(self.radius * turn)

    def toward(self, angle: float) -> float:
        """Arclength where the ray from the origin at ``angle`` rad meets the curve."""
        return self.radius * (angle % (2 * math.pi))


def check_size(name: str, value: float, *, straight: bool = False) -> None:
    """Raise GeometryError unless ``value`` is a length above 0; infinite only where that means
    ``straight``."""
    if not (0 < value < math.inf or (straight and value == math.inf)):
        raise GeometryError(f"expected a {name} above 0 m, got {value:g} m")
