"""Probes on the sheet: their faces, where these can touch it and how far they stand off it; a
place, and the forces on it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, GeometryError, ModelError
from tomoskin.model.mesh import Outline, Polygon

LEAST_SIZE = 1e-6
"""Of a face and of its curvature, m: far below any mesh, and its square is a number still."""


class Shape(ABC):
    """The face of a rigid probe in coordinates of its own, m; equal faces are solved once.

    Raises GeometryError for a length that is no size.
    """

    def __post_init__(self) -> None:
        """Check every length; only a crown may be without end."""
        for one in fields(self):  # type: ignore[arg-type]
            if one.type == "float":
                _check(one.name, getattr(self, one.name), curved=one.name == "crown")

    @property
    @abstractmethod
    def extent(self) -> float:
        """Radius around the probe's origin that holds the whole face, m."""

    @property
    @abstractmethod
    def area(self) -> float:
        """Area of the face seen from above, m²."""

    @property
    def flat(self) -> bool:
        """Whether the whole face touches at once: then everything is linear in the force."""
        return False

    @abstractmethod
    def inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether the ``points`` (n, 2) m are on the face."""

    @abstractmethod
    def height(self, points: FloatArray) -> FloatArray:
        """(n,) m of the face above its own at the origin."""

    def gap(self, points: FloatArray) -> FloatArray:
        """(n,) m between a flat sheet and the face that just touches it; inf off the face."""
        inside, height = self.inside(points), self.height(points)
        lowest = height[inside].min(initial=np.inf) if inside.any() else 0.0
        return np.asarray(np.where(inside, height - lowest, np.inf))


class _Crowned(Shape):
    """A face that is flat, or a paraboloid with ``crown`` m as its radius of curvature."""

    crown: float

    @property
    def flat(self) -> bool:
        """Whether the face has no crown."""
        return math.isinf(self.crown)

    def height(self, points: FloatArray) -> FloatArray:
        """(n,) m of the paraboloid above its lowest point."""
        return np.asarray((points**2).sum(axis=1) / (2 * self.crown))


@dataclass(frozen=True, slots=True)
class Circle(_Crowned):
    """Round face of ``radius`` m; ``crown`` is its radius of curvature, m (inf: flat).

    A ball is a circle with its crown: a paraboloid near the point of contact.
    """

    radius: float
    crown: float = math.inf

    @property
    def extent(self) -> float:
        """The radius of the face, in m."""
        return self.radius

    @property
    def area(self) -> float:
        """The area of the round face, in m²."""
        return math.pi * self.radius**2

    def inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether points are within the radius."""
        return np.asarray((points**2).sum(axis=1) < self.radius**2)


@dataclass(frozen=True, slots=True)
class Square(_Crowned):
    """Square face with ``side`` m, along the probe's axes, and a ``crown`` as :class:`Circle`."""

    side: float
    crown: float = math.inf

    @property
    def extent(self) -> float:
        """The half of a diagonal, in m."""
        return self.side / math.sqrt(2)

    @property
    def area(self) -> float:
        """The area of the square face, in m²."""
        return self.side**2

    def inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether points are within the square."""
        return np.asarray(np.abs(points).max(axis=1) < self.side / 2)


@dataclass(frozen=True, slots=True)
class Finger(Shape):
    """Fingertip: an elliptic paraboloid, which is never flat.

    Attributes
    ----------
    length, width
        Full axes of the pad along the probe's x and y, m.
    along, across
        Radii of curvature in these directions, m. A fingertip of 16 mm has about 8 mm across and
        12 mm along (assumed).
    """

    length: float = 22e-3
    width: float = 16e-3
    along: float = 12e-3
    across: float = 8e-3

    @property
    def extent(self) -> float:
        """The half of the longer axis, in m."""
        return max(self.length, self.width) / 2

    @property
    def area(self) -> float:
        """The area of the finger's pad, in m²."""
        return math.pi * self.length * self.width / 4

    def inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether points are on the pad."""
        return np.asarray(points**2 @ np.array([4 / self.length**2, 4 / self.width**2]) < 1)

    def height(self, points: FloatArray) -> FloatArray:
        """(n,) m of the pad above its lowest point."""
        return np.asarray(points**2 @ np.array([0.5 / self.along, 0.5 / self.across]))


@dataclass(frozen=True)
class Face(_Crowned):
    """Free polygon with ``vertices`` ((x, y), …) m around the probe's origin, and a ``crown``.

    Raises
    ------
    GeometryError
        For fewer than three vertices, sides that cross or touch, or no area.
    """

    vertices: tuple[tuple[float, float], ...]
    crown: float = math.inf

    def __post_init__(self) -> None:
        """Check the crown and the vertices."""
        super().__post_init__()
        _ = self._polygon

    @cached_property
    def _polygon(self) -> Polygon:
        return Polygon(np.array(self.vertices, dtype=float))

    @property
    def extent(self) -> float:
        """Distance of the farthest vertex, m."""
        return float(np.linalg.norm(self._polygon.vertices, axis=1).max())

    @property
    def area(self) -> float:
        """The area of the face's polygon, in m²."""
        return self._polygon.area

    def inside(self, points: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether points are within the polygon."""
        return self._polygon.contains(points)


def _finger(half_length: float) -> Finger:
    """The finger of this length, in usual proportions."""
    usual = Finger()
    scale = 2 * half_length / usual.length
    return Finger(*(scale * v for v in (usual.length, usual.width, usual.along, usual.across)))


FACES: dict[str, Callable[[float], Shape]] = {
    "circle": Circle,
    "square": lambda half: Square(2 * half),
    "finger": _finger,
}
"""Faces by their name and half of their extent along x, m."""


def _check(name: str, value: float, *, curved: bool = False) -> None:
    if not (LEAST_SIZE <= value < math.inf or (curved and value == math.inf)):
        least = f"{1e6 * LEAST_SIZE:g} µm"
        raise GeometryError(f"expected {name} of {least} or more, got {value} m", where="probe")


@dataclass(frozen=True, slots=True)
class Probe:
    """A rigid probe, guided so that it does not tilt, pressed on the sheet.

    Attributes
    ----------
    shape
        Its face.
    x, y
        Where the shape's origin is on the sheet, m.
    force
        Across the sheet, N (0: it only rests there).
    angle
        By which the shape is turned, counter-clockwise, rad.
    drag
        Force along the sheet, N: friction drags the sheet with a sliding probe.

    Raises
    ------
    GeometryError
        When a place or angle is not finite.
    ModelError
        When the force is negative or not finite, or the drag is not finite.
    """

    shape: Shape
    x: float
    y: float
    force: float
    angle: float = 0.0
    drag: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the place, force, angle and drag."""
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise GeometryError(
                f"expected a finite position, got ({self.x}, {self.y})", where="press"
            )
        if not 0 <= self.force < math.inf:
            raise ModelError(
                f"expected a force of 0 N or more, got {self.force}",
                where="press",
                hint="a probe can only push",
            )
        if not math.isfinite(self.angle):
            raise GeometryError(f"expected a finite angle, got {self.angle}", where="press")
        if not all(map(math.isfinite, self.drag)):
            raise ModelError(f"expected a finite drag, got {self.drag}", where="press")

    @property
    def radius(self) -> float:
        """Radius of the circle with the area of the face, m."""
        if isinstance(self.shape, Circle):
            return self.shape.radius
        return math.sqrt(self.shape.area / math.pi)

    def moving(self, vx: float, vy: float, friction: float) -> Self:
        """This probe sliding or rolling towards (vx, vy): dragging with ``friction`` · force.

        ``friction`` is the coefficient of sliding, or of rolling friction. Only the direction of
        (vx, vy) counts (Coulomb); at rest nothing is dragged.
        """
        speed = math.hypot(vx, vy)
        drag = friction * self.force / speed if speed > 0 else 0.0
        return replace(self, drag=(drag * vx, drag * vy))


class Press(Probe):
    """A flat round probe of ``radius`` m, as a page sends it."""

    __slots__ = ()

    def __init__(self, x: float, y: float, force: float, radius: float) -> None:
        super().__init__(_circle(radius), x, y, force)


_circle = lru_cache(maxsize=64)(Circle)
"""The same for the same radius, since a press that moves is another at each step."""


def check_on_skin(probes: Sequence[Probe], outline: Outline) -> None:
    """Raise GeometryError that names the first press whose centre is off the skin."""
    if not probes:
        return
    inside = outline.contains(np.array([(p.x, p.y) for p in probes]))
    if not all(inside.tolist()):
        number = int(np.argmin(inside))
        x, y = probes[number].x * 1e3, probes[number].y * 1e3
        raise GeometryError(
            f"its centre ({x:.1f} mm, {y:.1f} mm) is off the skin", where=f"press {number}"
        )
