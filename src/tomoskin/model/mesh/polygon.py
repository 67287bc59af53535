"""Outlines with straight sides: any simple polygon, and the rectangle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh.outline import Outline, check_size
from tomoskin.model.mesh.triangles import check_finite

_TOUCH = 1e-9
"""Two points nearer than this fraction of the polygon's size count as one."""

_TINY = np.finfo(float).tiny


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
        if signed_area(given) < 0:
            given = np.roll(given[::-1], 1, axis=0)
        given.flags.writeable = False
        object.__setattr__(self, "vertices", given)

    @cached_property
    def length(self) -> float:
        """The length of all sides together, in m."""
        return float(self._sides.sum())

    @cached_property
    def area(self) -> float:
        """The area inside the polygon, in m²."""
        return signed_area(self.vertices)

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) centroid of the area, m."""
        return centroid(self.vertices)

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


def centroid(vertices: FloatArray) -> FloatArray:
    """(2,) centroid of the area inside a polygon's ``vertices`` (n, 2)."""
    origin = vertices.mean(axis=0)
    a = vertices - origin
    b = np.roll(a, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(origin + ((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum()))


def signed_area(vertices: FloatArray) -> float:
    """The area inside a polygon, below 0 where the ``vertices`` (n, 2) run clockwise."""
    a = vertices - vertices.mean(axis=0)
    b = np.roll(a, -1, axis=0)
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def check_simple(vertices: FloatArray) -> None:
    """Raise GeometryError that names the first vertex or side that is wrong."""
    _check_table(vertices)
    size = float(np.ptp(vertices, axis=0).max())
    _check_repeats(vertices, size)
    offset = vertices - vertices[0]
    far = offset[np.argmax(np.linalg.norm(offset, axis=1))]
    if np.abs(offset[:, 0] * far[1] - offset[:, 1] * far[0]).max() <= _TOUCH * size**2:
        raise GeometryError("the polygon has no area", hint="its vertices lie on a line")
    _check_crossings(vertices, size)


def _check_table(vertices: FloatArray) -> None:
    if vertices.ndim != 2 or vertices.shape[1:] != (2,) or len(vertices) < 3:
        raise GeometryError(
            f"expected at least 3 vertices of 2 coordinates, got shape {vertices.shape}"
        )
    check_finite(vertices, "vertex")


def _check_repeats(vertices: FloatArray, size: float) -> None:
    for i in range(len(vertices)):
        gap = np.abs(vertices[i + 1 :] - vertices[i]).max(axis=1)
        if (gap <= _TOUCH * size).any():
            j = i + 1 + int(np.argmax(gap <= _TOUCH * size))
            raise GeometryError(
                f"repeats vertex {i}",
                where=f"vertex {j}",
                hint="leave it out; an outline closes by itself",
            )


def _check_crossings(vertices: FloatArray, size: float) -> None:
    """Each side against all later ones that are not its neighbours, and spikes."""
    n = len(vertices)
    ends = np.roll(vertices, -1, axis=0)
    for i in range(n):
        others = np.arange(i + 1, n)
        others = others[((others - i) % n != 1) & ((i - others) % n != 1)]
        apart = _separation(vertices[i], ends[i], vertices[others], ends[others])
        if (apart <= _TOUCH * size).any():
            j = int(others[np.argmax(apart <= _TOUCH * size)])
            raise GeometryError(
                f"the side from vertex {i} to {(i + 1) % n} meets "
                f"the side from vertex {j} to {(j + 1) % n}",
                where=f"vertex {i}",
                hint="an outline may not cross or touch itself",
            )
        back, ahead = vertices[i - 1] - vertices[i], ends[i] - vertices[i]
        cross = abs(back[0] * ahead[1] - back[1] * ahead[0])
        if back @ ahead > 0 and cross <= _TOUCH * size * np.linalg.norm(ahead):
            raise GeometryError("the outline turns back on itself", where=f"vertex {i}")


def _separation(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(n,) distance between segment ab and each segment cd; 0 where they cross."""
    crossing = (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)
    gaps = [off_segment(c, a, b), off_segment(d, a, b), off_segment(a, c, d), off_segment(b, c, d)]
    return np.where(crossing, 0.0, np.min(gaps, axis=0))


def _side(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    u, v = b - a, p - a
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def off_segment(p: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Distance from points ``p`` to segments ``ab``."""
    step = b - a
    along = np.clip(
        ((p - a) * step).sum(axis=-1) / np.maximum((step**2).sum(axis=-1), _TINY), 0.0, 1.0
    )
    return np.asarray(np.linalg.norm(p - a - along[..., None] * step, axis=-1))
