"""Outlines with straight sides: any simple polygon, and the rectangle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, GeometryError
from tomoskin.mesh.outline import Outline, check_size
from tomoskin.mesh.simple import check_simple


@dataclass(frozen=True, eq=False)
class Polygon(Outline):
    """Simple polygon through ``vertices`` (n, 2) m; s = 0 at vertex 0.

    Clockwise vertices are turned round (vertex 0 stays the first).

    Raises
    ------
    GeometryError
        For fewer than three vertices, a repeated vertex, sides that cross or touch, or no area.
    """

    vertices: FloatArray

    def __post_init__(self) -> None:
        """Check the vertices, order them counter-clockwise and freeze them."""
        given = np.array(self.vertices, dtype=float)
        check_simple(given)
        if _signed_area(given) < 0:
            given = np.roll(given[::-1], 1, axis=0)
        given.flags.writeable = False
        object.__setattr__(self, "vertices", given)

    @cached_property
    def length(self) -> float:
        """Length of the curve, m."""
        return float(self._sides.sum())

    @cached_property
    def area(self) -> float:
        """Area inside, m²."""
        return _signed_area(self.vertices)

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) centroid of the area, m."""
        origin = self.vertices.mean(axis=0)
        a = self.vertices - origin
        b = np.roll(a, -1, axis=0)
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return np.asarray(origin + ((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum()))

    @cached_property
    def corners(self) -> FloatArray:
        """(n,) arclengths of the vertices, m."""
        return np.concatenate([[0.0], np.cumsum(self._sides)[:-1]])

    def point(self, s: ArrayLike) -> FloatArray:
        """(n, 2) points at arclengths ``s``, m."""
        along = np.atleast_1d(np.asarray(s, dtype=float)) % self.length
        side = np.searchsorted(self.corners, along, side="right") - 1
        part = (along - self.corners[side]) / self._sides[side]
        return np.asarray(self.vertices[side] + part[:, None] * self._steps[side])

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(n,) True where a point of ``xy`` (n, 2) lies inside."""
        return inside(self.vertices, np.atleast_2d(np.asarray(xy, dtype=float)))

    def nearest(self, xy: ArrayLike) -> FloatArray:
        """(n,) arclengths of the rim points that are nearest to ``xy`` (n, 2)."""
        target = np.atleast_2d(np.asarray(xy, dtype=float))
        offset = target[:, None] - self.vertices[None]
        along = (offset * self._steps).sum(axis=2) / self._sides**2
        along = np.clip(along, 0.0, 1.0)
        gap = np.linalg.norm(offset - along[:, :, None] * self._steps, axis=2)
        side = gap.argmin(axis=1)
        rows = np.arange(len(target))
        s = self.corners[side] + along[rows, side] * self._sides[side]
        return np.asarray(s % self.length)

    def toward(self, angle: float) -> float:
        """Arclength where the ray from ``centre`` at ``angle`` rad leaves the sheet for good."""
        ray = np.array([math.cos(angle), math.sin(angle)])
        offset = self.vertices - self.centre
        cross = ray[0] * self._steps[:, 1] - ray[1] * self._steps[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (offset[:, 0] * self._steps[:, 1] - offset[:, 1] * self._steps[:, 0]) / cross
            part = (offset[:, 0] * ray[1] - offset[:, 1] * ray[0]) / cross
        hit = (np.abs(cross) > 1e-12 * self._sides) & (reach > 0)
        hit &= (part > -1e-12) & (part < 1 + 1e-12)
        if not hit.any():
            raise GeometryError(
                f"the ray from the centre at {math.degrees(angle):g} deg does not meet the outline",
                hint="choose another direction, or place the electrodes one by one",
            )
        side = int(np.argmax(np.where(hit, reach, -np.inf)))
        s = self.corners[side] + min(max(float(part[side]), 0.0), 1.0) * self._sides[side]
        return float(s % self.length)

    @cached_property
    def _steps(self) -> FloatArray:
        return np.asarray(np.roll(self.vertices, -1, axis=0) - self.vertices)

    @cached_property
    def _sides(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self._steps, axis=1))


class Rectangle(Polygon):
    """Rectangle around the origin, sides in m; s = 0 at the lower left corner."""

    def __init__(self, width: float, height: float) -> None:
        check_size("width", width)
        check_size("height", height)
        x, y = width / 2, height / 2
        super().__init__(np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))

    @property
    def width(self) -> float:
        """Extent along x, m."""
        return float(self.vertices[1, 0] - self.vertices[0, 0])

    @property
    def height(self) -> float:
        """Extent along y, m."""
        return float(self.vertices[2, 1] - self.vertices[1, 1])


def inside(ring: FloatArray, xy: FloatArray) -> NDArray[np.bool_]:
    """(n,) True where ``xy`` (n, 2) lies inside the polygon ``ring`` (k, 2): even-odd rule.

    Points are sorted by y once, so that each side is compared with its own band only.
    """
    order = np.argsort(xy[:, 1], kind="stable")
    x, y = xy[order, 0], xy[order, 1]
    odd = np.zeros(len(xy), dtype=bool)
    end = np.roll(ring, -1, axis=0)
    for (ax, ay), (bx, by) in zip(ring.tolist(), end.tolist(), strict=True):
        first, last = np.searchsorted(y, [min(ay, by), max(ay, by)], side="left")
        if first < last:
            band = slice(first, last)
            odd[band] ^= x[band] < ax + (y[band] - ay) * ((bx - ax) / (by - ay))
    result = np.empty_like(odd)
    result[order] = odd
    return result


def _signed_area(vertices: FloatArray) -> float:
    a = vertices - vertices.mean(axis=0)
    b = np.roll(a, -1, axis=0)
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)
