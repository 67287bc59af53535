"""Sheets wrapped around round bodies: a cylinder, a limb with a joint, a hinge."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh.outline import check_size
from tomoskin.model.mesh.surface import Surface, rows_of

_ROUNDING = 1e-12


@dataclass(frozen=True)
class Cylinder(Surface):
    """Wrapped on a cylinder, the middle of the sheet on top; bent, not stretched.

    Attributes
    ----------
    radius
        m.
    axis
        Direction of the cylinder's axis in the sheet, rad from u.
    """

    radius: float
    axis: float = math.pi / 2

    def __post_init__(self) -> None:
        """Refuse an impossible radius."""
        check_size("radius", self.radius)

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        across, along = (rows_of(uv) @ self._frame).T
        angle = across / self.radius
        x, height = self.radius * np.sin(angle), self.radius * (np.cos(angle) - 1.0)
        return np.column_stack([x, along, height]) @ _into_space(self._frame)

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Along the axis as it was, across it around the cylinder."""
        return _rolled((rows_of(uv) @ self._frame)[:, 0] / self.radius, self._frame)

    def check(self, uv: ArrayLike) -> None:
        """The ends must not overlap at the seam."""
        extent = float(np.ptp(rows_of(uv) @ self._frame, axis=0)[0])
        _check_seam(extent, self.radius)

    @property
    def _frame(self) -> FloatArray:
        return _across_and_along(self.axis)


@dataclass(frozen=True)
class Arm(Surface):
    """Wrapped around a limb with a joint: u around it, v along it.

    The middle line of the limb is straight, then an arc over the joint, then straight; the sheet
    on the outside of the bend (u = 0) is stretched to 1 + r·κ, inside it is pressed together.

    Attributes
    ----------
    radius
        Of the limb, m.
    angle
        Of the joint, rad; 0 is straight, positive bends away from u = 0.
    joint
        Length of the middle line over which it bends, m; its middle is at v = 0.
    """

    radius: float
    angle: float
    joint: float

    def __post_init__(self) -> None:
        """Refuse a joint so sharp that the skin would fold."""
        check_size("radius", self.radius)
        check_size("joint", self.joint)
        if abs(self.angle) * self.radius >= 0.95 * self.joint:
            raise GeometryError(
                f"a limb of radius {1e3 * self.radius:.4g} mm folds when it bends by "
                f"{math.degrees(self.angle):.4g}° over {1e3 * self.joint:.4g} mm",
                hint=f"bend it by less than {math.degrees(0.95 * self.joint / self.radius):.4g}°, "
                "or over a greater length",
            )

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        u, v = rows_of(uv).T
        around = u / self.radius
        turn, middle = _middle_line(v, self.angle, self.joint)
        y, z = (middle + self._away(turn) * (self.radius * np.cos(around))[:, None]).T
        return np.column_stack([self.radius * np.sin(around), y, z - self.radius])

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Around the limb true to length, along it 1 + κ r cos(u/r)."""
        u, v = rows_of(uv).T
        around = u / self.radius
        turn, _ = _middle_line(v, self.angle, self.joint)
        stretch = 1.0 + self._curvature(v) * self.radius * np.cos(around)
        out = np.zeros((len(u), 3, 2))
        out[:, 0, 0] = np.cos(around)
        out[:, 1:, 0] = -np.sin(around)[:, None] * self._away(turn)
        out[:, 1:, 1] = stretch[:, None] * np.column_stack([np.cos(turn), -np.sin(turn)])
        return out

    def check(self, uv: ArrayLike) -> None:
        """The ends must not overlap at the seam."""
        _check_seam(float(np.ptp(rows_of(uv)[:, 0])), self.radius)

    def _curvature(self, v: FloatArray) -> FloatArray:
        return np.where(np.abs(v) < self.joint / 2, self.angle / self.joint, 0.0)

    @staticmethod
    def _away(turn: FloatArray) -> FloatArray:
        """(n, 2) from the middle line towards u = 0, in (y, z)."""
        return np.column_stack([np.sin(turn), np.cos(turn)])


@dataclass(frozen=True)
class Hinge(Surface):
    """Bent along a strip, flat on both sides of it; not stretched.

    Attributes
    ----------
    angle
        Between the two sides, rad; positive where the front is convex.
    length
        Width of the strip across the axis, m; over all of the sheet, take its size.
    axis
        Direction of the axis in the sheet, rad from u.
    at
        Distance of the strip's middle line from the middle of the sheet, m, to the right as seen
        along the axis.
    """

    angle: float
    length: float
    axis: float = math.pi / 2
    at: float = 0.0

    def __post_init__(self) -> None:
        """Check that the strip is possible."""
        check_size("length", self.length)
        if not abs(self.angle) <= 2 * math.pi:
            raise GeometryError(
                f"expected an angle of at most 360°, got {math.degrees(self.angle):.4g}°"
            )

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        across, along = (rows_of(uv) @ self._frame).T
        _, position = _middle_line(across - self.at, self.angle, self.length)
        x, height = position.T
        return np.column_stack([x + self.at, along, height]) @ _into_space(self._frame)

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Along the axis as it was, across it along the arc."""
        across = (rows_of(uv) @ self._frame)[:, 0]
        turn, _ = _middle_line(across - self.at, self.angle, self.length)
        return _rolled(turn, self._frame)

    def check(self, uv: ArrayLike) -> None:
        """Check that the sides do not cross."""
        across = (rows_of(uv) @ self._frame)[:, 0] - self.at
        beyond = float(np.abs(across).max()) > self.length / 2 * (1 + _ROUNDING)
        if beyond and abs(self.angle) > math.pi * (1 + _ROUNDING):
            raise GeometryError(
                "expected at most 180° where the sheet extends beyond the bent strip, got "
                f"{math.degrees(self.angle):.4g}°",
                hint="bend it over a greater length",
            )

    @property
    def _frame(self) -> FloatArray:
        return _across_and_along(self.axis)


def _middle_line(v: FloatArray, angle: float, joint: float) -> tuple[FloatArray, FloatArray]:
    """(n,) direction, rad, 0 in the middle of the joint, and (n, 2) position (y, z), m."""
    half = joint / 2
    inside = np.clip(v, -half, half)
    turn = angle * inside / joint
    # ∫ (cos, −sin) of the turning direction, by the chord of the arc
    chord = np.sinc(turn / (2 * np.pi)) * inside
    position = chord[:, None] * np.column_stack([np.cos(turn / 2), -np.sin(turn / 2)])
    beyond = (v - inside)[:, None] * np.column_stack([np.cos(turn), -np.sin(turn)])
    return turn, position + beyond


def _across_and_along(axis: float) -> FloatArray:
    """(2, 2): columns across and along an axis, so that front stays front."""
    c, s = math.cos(axis), math.sin(axis)
    return np.array([[s, c], [-c, s]])


def _into_space(frame: FloatArray) -> FloatArray:
    """(3, 3): from (across, along, height) to x, y, z, for rows."""
    turn = np.eye(3)
    turn[:2, :2] = frame.T
    return turn


def _rolled(turn: FloatArray, frame: FloatArray) -> FloatArray:
    """(n, 3, 2) derivative of a sheet whose direction across the axis has turned by ``turn``."""
    local = np.zeros((len(turn), 3, 2))
    local[:, 0, 0], local[:, 2, 0], local[:, 1, 1] = np.cos(turn), -np.sin(turn), 1.0
    return np.asarray(_into_space(frame).T @ local @ frame.T)


def _check_seam(extent: float, radius: float) -> None:
    around = 2 * math.pi * radius
    if extent > around * (1 + _ROUNDING):
        raise GeometryError(
            f"the sheet is {1e3 * extent:.4g} mm wide and overlaps itself: a cylinder of radius "
            f"{1e3 * radius:.4g} mm has a circumference of {1e3 * around:.4g} mm",
            hint="take a larger radius, a narrower sheet, or another direction of the axis",
        )
