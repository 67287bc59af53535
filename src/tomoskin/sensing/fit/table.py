"""What one spot does to the voltages, tabulated: a smooth function of four numbers.

Over the position it is a cubic B-spline on a grid as fine as the spot is small (de Boor 1978,
chapter XI), over the logarithm of the radius a cubic polynomial through four nodes, over the depth
a polynomial in exp(depth/4) − 1 without a constant. Several spots add up; what they do to each
other is left to the exact model.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, finished
from tomoskin.sensing.fit.profile import FILLING
from tomoskin.sensing.fit.spot import LOG_RADIUS, X, Y, depth_of

PADDING = 2
"""Grid points beyond the sheet on each side: splines need one, the filter another."""

ABREAST = 8
"""Numbers that a processor multiplies at a time: as many more cost nothing."""

NEAR = 4
"""Radii that a spot is between."""

_TYPICAL, _PIECES = 2000, 4
"""Points of a table that tell what is typical; pieces of work in which they are read."""

N_DIRECTIONS = 2
"""Of each spot: of a stretched sheet's direction, and of its shape; see :class:`Part`."""


def spline(t: FloatArray) -> FloatArray:
    """(2, …, 4) cubic B-splines at ``t`` (…) after the second of four points, and their slopes."""
    u = 1 - t
    inner = [(3 * v**3 - 6 * v**2 + 4) / 6 for v in (t, u)]
    weights = [u**3 / 6, *inner, t**3 / 6]
    slopes = [-(u**2) / 2, (3 * t**2 - 4 * t) / 2, (4 * u - 3 * u**2) / 2, t**2 / 2]
    return np.stack([np.stack(each, axis=-1) for each in (weights, slopes)])


def through(nodes: FloatArray) -> FloatArray:
    """(n, n): coefficients of a polynomial through ``nodes`` (n,), by its values there."""
    return np.asarray(np.linalg.inv(np.vander(nodes, increasing=True)))


def between(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """(2, k, n) weights at ``t`` (k,) of a polynomial :func:`through` nodes, and their slopes."""
    order = np.arange(len(coefficients))
    powers = np.empty((2, len(t), len(order)))
    powers[0] = t[:, None] ** order
    powers[1, :, 0], powers[1, :, 1:] = 0.0, order[1:] * powers[0, :, :-1]
    return np.asarray(powers @ coefficients)


_RADII = through(np.arange(float(NEAR)))


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

    @property
    def points(self) -> FloatArray:
        """(n, 2) m of the grid, y fastest."""
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
        other: of the change divided by s at the nodes, and of directions divided by the depth. In
        single precision, far below the table's own error: a spot reads some hundred kilobytes.
    basis
        (rank, n_meas), orthonormal rows: all changes lie in their span.
    """

    log_radii: FloatArray
    grids: tuple[PositionGrid, ...]
    sign: str
    nodes: FloatArray
    values: NDArray[np.float32]
    basis: FloatArray

    def expanded(self, spots: FloatArray) -> FloatArray:
        """(k, 1 + N_PARAMETERS + N_DIRECTIONS, rank) V of spots (k, 4), each alone.

        What it changes, the derivatives of that by the spot's columns, and its directions.
        """
        points, weights = self._near(spots)
        near = self.values[points].reshape(*points.shape, self.values[0].size)
        shape = len(spots), 4, self.values.shape[1], len(self.basis)
        return self._of_depth(spots, (weights @ near).reshape(shape))

    def _near(self, spots: FloatArray) -> tuple[IntArray, FloatArray]:
        """(k, 64) points round each spot, and (k, 4, 64) weights: of values there, and of their
        slopes by x, y and log radius."""
        first, (radius, wider) = self._between(spots[:, LOG_RADIUS])
        origin, step, shape, starts = (part[first[:, None] + np.arange(NEAR)] for part in self._all)
        far = (spots[:, None, [X, Y]] - origin) / step[..., None]
        corner = np.clip(np.floor(far), 1, shape - 3)
        flat, steep = spline(far - corner)  # (k, NEAR, 2, 4)
        steep = steep / step[..., None, None]
        number = corner.astype(np.int64)[..., None] - 1 + np.arange(4)
        across = number[:, :, 0, :, None] * shape[..., 1, None, None] + number[:, :, 1, None]
        sides = [(radius, flat, flat), (radius, steep, flat), (radius, flat, steep)]
        weights = [
            level[..., None, None] * x[:, :, 0, :, None] * y[:, :, 1, None]
            for level, x, y in (*sides, (wider, flat, flat))
        ]
        k = len(spots)
        points = (starts[..., None, None] + across).reshape(k, NEAR * 16)
        return points, np.stack(weights, axis=1).reshape(k, 4, NEAR * 16)

    def _of_depth(self, spots: FloatArray, mixed: FloatArray) -> FloatArray:
        """:meth:`expanded` of values, and their slopes by x, y and log radius, at the nodes."""
        n, depth = len(self.nodes), depth_of(spots)
        s = np.expm1(depth / 4)
        weight, slope = between(self._depths, s)  # of values that are divided by s
        flat = np.einsum("kn,kmnr->kmr", s[:, None] * weight, mixed[:, :, :n])
        steep = (weight + s[:, None] * slope) * ((s + 1) / 4)[:, None]
        deeper = np.einsum("kn,knr->kr", steep, mixed[:, 0, :n])
        more = deeper / (FILLING * np.exp(2 * spots[:, LOG_RADIUS]))[:, None]
        flat[:, 3] -= 2 * depth[:, None] * deeper
        directions = depth[:, None, None] * mixed[:, 0, n:]
        return np.concatenate([flat, more[:, None], directions], axis=1)

    def _between(self, log_radius: FloatArray) -> tuple[IntArray, FloatArray]:
        """(k,) the first of four radii, and (2, k, 4): their weights, and the slopes of these."""
        step = self.log_radii[1] - self.log_radii[0]
        place = (log_radius - self.log_radii[0]) / step
        first = np.clip(np.floor(place) - 1, 0, len(self.log_radii) - NEAR)
        weights = between(_RADII, place - first)
        weights[1] /= step
        return first.astype(np.int64), weights

    @cached_property
    def _depths(self) -> FloatArray:
        """The polynomial of the depth, see :func:`through`."""
        return through(self.nodes)

    @cached_property
    def typical(self) -> FloatArray:
        """(rank, rank) V whose rows' squares are the mean ones of spots of all depths."""
        return finished(self.typifying())

    def typifying(self) -> Generator[None, None, FloatArray]:
        """:attr:`typical`, a piece of work between two yields."""
        n, rank = len(self.nodes), len(self.basis)
        some = self.values[:: max(1, len(self.values) // _TYPICAL)]
        square = np.zeros((rank, rank))
        for part in np.array_split(some, _PIECES):
            yield
            strong = (part[:, :n] * self.nodes[:, None]).reshape(-1, rank)
            square += strong.T @ strong
        yield
        mean, vectors = np.linalg.eigh(square / (n * len(some)))
        return np.asarray(vectors * np.sqrt(np.maximum(mean, 0.0)))

    @cached_property
    def _all(self) -> tuple[FloatArray, FloatArray, IntArray, IntArray]:
        """Of all grids: origins (n, 2) m, steps (n,) m, shapes (n, 2), numbers (n,) of the first
        points."""
        grids = self.grids
        shape = np.array([grid.shape for grid in grids])
        starts = np.cumsum(shape.prod(axis=1)) - shape.prod(axis=1)
        origin, step = np.array([g.origin for g in grids]), np.array([g.step for g in grids])
        return origin, step, shape, starts
