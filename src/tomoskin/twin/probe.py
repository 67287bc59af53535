"""Probes on the sheet: a shape, a place, and the forces on it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from tomoskin.core import GeometryError, ModelError
from tomoskin.model.mesh import Outline
from tomoskin.twin.shape import Circle, Shape


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
        _check_place(self.x, self.y)
        _check_force(self.force)
        if not math.isfinite(self.angle):
            raise GeometryError(f"expected a finite angle, got {self.angle}", where="press")
        if not all(map(math.isfinite, self.drag)):
            raise ModelError(f"expected a finite drag, got {self.drag}", where="press")

    @property
    def radius(self) -> float:
        """Radius of the circle with the area of the face, m."""
        return math.sqrt(self.shape.area / math.pi)

    def moving(self, vx: float, vy: float, friction: float) -> Self:
        """This probe sliding or rolling towards (vx, vy): dragging with ``friction`` · force.

        ``friction`` is the coefficient of sliding, or of rolling friction. Only the direction of
        (vx, vy) counts (Coulomb); at rest nothing is dragged.
        """
        speed = math.hypot(vx, vy)
        drag = friction * self.force / speed if speed > 0 else 0.0
        return replace(self, drag=(drag * vx, drag * vy))


@dataclass(frozen=True, slots=True)
class Press:
    """A flat round probe, as a page sends it.

    ``x``, ``y`` and ``radius`` in m, ``force`` in N (0: it only rests there).

    Raises
    ------
    GeometryError
        When a place is not finite, or the radius no size of a face.
    ModelError
        When the force is negative or not finite.
    """

    x: float
    y: float
    force: float
    radius: float

    def __post_init__(self) -> None:
        """Check the place, radius and force."""
        _check_place(self.x, self.y)
        _circle(self.radius)
        _check_force(self.force)

    @property
    def shape(self) -> Circle:
        """The face of the tip, which is a circle."""
        return _circle(self.radius)

    @property
    def angle(self) -> float:
        """The angle is zero, for the tip is round."""
        return 0.0

    @property
    def drag(self) -> tuple[float, float]:
        """The drag is zero, for the tip does not slide."""
        return 0.0, 0.0


_circle = lru_cache(maxsize=64)(Circle)
"""The same for the same radius, since a press that moves is another at each step."""


Contact = Press | Probe
"""What may press on a twin."""


def check_on_skin(contacts: Sequence[Contact], outline: Outline) -> None:
    """Raise GeometryError that names the first press whose centre is off the skin."""
    if not contacts:
        return
    inside = outline.contains(np.array([(c.x, c.y) for c in contacts]))
    if not all(inside.tolist()):
        number = int(np.argmin(inside))
        x, y = contacts[number].x * 1e3, contacts[number].y * 1e3
        raise GeometryError(
            f"its centre ({x:.1f} mm, {y:.1f} mm) is off the skin", where=f"press {number}"
        )


def _check_place(x: float, y: float) -> None:
    if not (math.isfinite(x) and math.isfinite(y)):
        raise GeometryError(f"expected a finite position, got ({x}, {y})", where="press")


def _check_force(force: float) -> None:
    if not 0 <= force < math.inf:
        raise ModelError(
            f"expected a force of 0 N or more, got {force}",
            where="press",
            hint="a probe can only push",
        )
