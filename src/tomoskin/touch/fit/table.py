"""What one spot does to the voltages, tabulated: a smooth function of four numbers.

Over the position it is a cubic B-spline on a grid as fine as the spot is small (de Boor 1978,
chapter XI), over the logarithm of the radius a cubic polynomial through four nodes, over the depth
a polynomial in exp(depth/4) − 1 without a constant. Several spots add up; what they do to each
other is left to the exact model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.touch.fit.spot import FILLING, LOG_RADIUS, N_PARAMETERS, X, Y, depth_of

PADDING = 2
"""Grid points beyond the sheet on each side: splines need one, the filter another."""

NEAR = 4
"""Radii that a spot is between."""

N_DIRECTIONS = 2
"""Of each spot: of a stretched sheet's direction, and of its shape; see :class:`Part`."""


def spline(t: float) -> FloatArray:
    """(2, 4) cubic B-splines at ``t`` after the second of four points, and their slopes."""
    u = 1 - t
    return np.array([
        [u**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (3 * u**3 - 6 * u**2 + 4) / 6, t**3 / 6],
        [-(u**2) / 2, (3 * t**2 - 4 * t) / 2, (4 * u - 3 * u**2) / 2, t**2 / 2],
    ])  # fmt: skip


def between(nodes: FloatArray, t: float) -> FloatArray:
    """(2, n) weights at ``t`` of the polynomial through ``nodes`` (n,), and their slopes."""
    powers = t ** np.arange(len(nodes))
    slopes = np.append(0.0, np.arange(1, len(nodes)) * powers[:-1])
    return np.asarray(np.stack([powers, slopes]) @ np.linalg.inv(np.vander(nodes, increasing=True)))


@dataclass(frozen=True, eq=False)
class Along:
    """Points (4,) of one axis, their weights (4,), and the slopes of these (4,), 1/m."""

    points: IntArray
    weight: FloatArray
    slope: FloatArray


@dataclass(frozen=True)
class PositionGrid:
    """Positions of one radius: ``shape`` points from ``origin`` m on, every ``step`` m."""

    origin: tuple[float, float]
    step: float
    shape: tuple[int, int]

    @classmethod
    def over(cls, points: FloatArray, step: float) -> Self:
        """A grid that covers ``points`` (n, 2) m and two steps more."""
        low, high = points.min(axis=0), points.max(axis=0)
        count = np.ceil((high - low) / step).astype(int) + 1 + 2 * PADDING
        x, y = (low + high - (count - 1) * step) / 2
        return cls((float(x), float(y)), step, (int(count[0]), int(count[1])))

    def at(self, axis: int, place: float) -> Along:
        """The four points of an ``axis`` that make a spline at a ``place`` m."""
        far = (place - self.origin[axis]) / self.step
        first = int(np.clip(math.floor(far), 1, self.shape[axis] - 3))
        weight, slope = spline(far - first)
        return Along(first - 1 + np.arange(4), weight, slope / self.step)

    @property
    def points(self) -> FloatArray:
        """(n, 2) m, y fastest."""
        x, y = (o + self.step * np.arange(n) for o, n in zip(self.origin, self.shape, strict=True))
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class ResponseTable:
    """Changes of voltages by one spot.

    Attributes
    ----------
    log_radii
        (n_radii,) evenly apart; a grid of positions belongs to each.
    grids
        Of these.
    sign
        Of the spots: as in a skin's ``[touch]``.
    nodes
        (n_nodes,) of the depth: s = exp(depth/4) − 1.
    values
        (n_points, n_nodes + N_DIRECTIONS, rank) V: spline coefficients, of all grids one after the
        other: of the change divided by s at the nodes, and of directions divided by the depth.
    basis
        (rank, n_meas), orthonormal rows: all changes lie in their span.
    """

    log_radii: FloatArray
    grids: tuple[PositionGrid, ...]
    sign: str
    nodes: FloatArray
    values: FloatArray
    basis: FloatArray

    def expanded(self, spots: FloatArray) -> FloatArray:
        """(k, 1 + N_PARAMETERS + N_DIRECTIONS, rank) V of spots (k, 4), each alone.

        What it changes, the derivatives of that by the spot's columns, and its directions.
        """
        shape = len(spots), 1 + N_PARAMETERS + N_DIRECTIONS, len(self.basis)
        return np.array([self._expanded(spot) for spot in spots]).reshape(shape)

    def _expanded(self, spot: FloatArray) -> FloatArray:
        first, (weight, slope) = self._between(spot[LOG_RADIUS])
        rows, parts = [], []
        for number in range(len(weight)):
            points, here, across = self._at(first + number, spot)
            rows.append(points)
            level = [weight[number] * here, *(weight[number] * across), slope[number] * here]
            parts.append(np.stack(level))
        points, weights = np.concatenate(rows), np.concatenate(parts, axis=1)
        near = self.values[points].reshape(len(points), -1)
        return self._of_depth(spot, (weights @ near).reshape(4, -1, len(self.basis)))

    def _at(self, number: int, spot: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """(16,) points of one grid, their weights (16,), and the slopes of these (2, 16)."""
        grid = self.grids[number]
        x, y = (grid.at(axis, spot[axis]) for axis in (X, Y))
        points = self._starts[number] + x.points[:, None] * grid.shape[1] + y.points
        across = np.stack([np.outer(x.slope, y.weight), np.outer(x.weight, y.slope)])
        return points.ravel(), np.outer(x.weight, y.weight).ravel(), across.reshape(2, -1)

    def _of_depth(self, spot: FloatArray, mixed: FloatArray) -> FloatArray:
        """:meth:`expanded` of values, and their slopes by x, y and log radius, at the nodes."""
        n, depth = len(self.nodes), float(depth_of(spot))
        s = math.expm1(depth / 4)
        weight, slope = between(self.nodes, s)  # of values that are divided by s
        flat = s * weight @ mixed[:, :n]
        deeper = (weight + s * slope) * (s + 1) / 4 @ mixed[0, :n]
        more = deeper / (FILLING * math.exp(2 * spot[LOG_RADIUS]))
        flat[3] -= 2 * depth * deeper
        return np.concatenate([flat, more[None], depth * mixed[0, n:]])

    def _between(self, log_radius: float) -> tuple[int, FloatArray]:
        """The first of four radii, and (2, 4): their weights, and the slopes of these."""
        step = self.log_radii[1] - self.log_radii[0]
        place = (log_radius - self.log_radii[0]) / step
        first = int(np.clip(math.floor(place) - 1, 0, len(self.log_radii) - NEAR))
        weights = between(np.arange(float(NEAR)), place - first)
        return first, weights / np.array([[1.0], [step]])

    @cached_property
    def _starts(self) -> IntArray:
        return np.cumsum([0, *(nx * ny for nx, ny in (grid.shape for grid in self.grids))])
