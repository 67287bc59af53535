"""Where a touch is in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from tomoskin.core import Detection, FloatArray
from tomoskin.model.mesh import Surface
from tomoskin.model.robot import quaternion

UNKNOWN = 1e6
"""Variance of what is not measured, m² or rad²: what filters take for no knowledge."""

Vector = tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SpacePose:
    """A touch in space.

    Attributes
    ----------
    position
        m, on the surface.
    axes
        Unit vectors: along the sheet's x, across it, and away from the body.
    slope
        (3, 2): derivative of the position by the sheet's x and y.
    """

    position: Vector
    axes: tuple[Vector, Vector, Vector]
    slope: FloatArray = field(repr=False)

    @classmethod
    def of(cls, detection: Detection, surface: Surface) -> Self:
        """Where a detection of the sheet is on its ``surface``; plain numbers, which is faster."""
        uv = [[detection.x, detection.y]]
        slope = surface.jacobian(uv)[0]
        along, up = map(_unit, slope.T.tolist())
        normal = _unit(_cross(along, up))
        x, y, z = surface.point(uv)[0].tolist()
        return cls((x, y, z), (along, _cross(normal, along), normal), slope)

    def covariance(self, detection: Detection) -> FloatArray:
        """(6, 6) of position and rotation, m² and rad².

        Along the normal, and of rotations, it is :data:`UNKNOWN`.
        """
        found = UNKNOWN * np.eye(6)
        normal = np.array(self.axes[2])
        found[:3, :3] = self._in_space(_on_sheet(detection))
        found[:3, :3] += UNKNOWN * normal[:, None] * normal
        return found

    def position_covariance(self, detection: Detection) -> FloatArray | None:
        """(3, 3) m² of the position, along the surface only; None where it is not known."""
        known = math.isfinite(detection.sd_x) and math.isfinite(detection.sd_y)
        return self._in_space(_on_sheet(detection)) if known else None

    def _in_space(self, sheet: FloatArray) -> FloatArray:
        """(3, 3) of a covariance (2, 2) on the sheet."""
        return np.asarray(self.slope @ sheet @ self.slope.T)

    def quaternion(self) -> Vector:
        """X, y, z, w of the rotation to the axes."""
        return quaternion(self.axes)


def _on_sheet(detection: Detection) -> FloatArray:
    """(2, 2) m²."""
    variance = np.array([detection.sd_x**2, detection.sd_y**2])
    if np.isfinite(variance).all():
        return np.diag(variance) + detection.cov_xy * np.eye(2)[::-1]
    return np.diag(np.where(np.isfinite(variance), variance, UNKNOWN))


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(vector: Sequence[float]) -> Vector:
    length = math.hypot(*vector)
    return tuple(value / length for value in vector)
