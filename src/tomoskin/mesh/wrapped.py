"""Sheets wrapped around round bodies: a cylinder, a limb with a joint."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError
from tomoskin.mesh.surface import Surface, positive, rows_of

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
        positive("radius", self.radius)

    def point(self, uv: ArrayLike) -> FloatArray:
        """(n, 3) m."""
        across, along = (rows_of(uv) @ self._frame).T
        angle = across / self.radius
        height = self.radius * (np.cos(angle) - 1.0)
        return np.column_stack([self.radius * np.sin(angle), along, height]) @ self._turn

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Along the axis as it was, across it around the cylinder."""
        angle = (rows_of(uv) @ self._frame)[:, 0] / self.radius
        local = np.zeros((len(angle), 3, 2))
        local[:, 0, 0], local[:, 2, 0], local[:, 1, 1] = np.cos(angle), -np.sin(angle), 1.0
        return np.asarray(self._turn.T @ local @ self._frame.T)

    def check(self, uv: ArrayLike) -> None:
        """The ends must not overlap at the seam."""
        extent = float(np.ptp(rows_of(uv) @ self._frame, axis=0)[0])
        _check_seam(extent, self.radius)

    @property
    def _frame(self) -> FloatArray:
        """(2, 2): columns across and along the axis, so that front stays front."""
        c, s = math.cos(self.axis), math.sin(self.axis)
        return np.array([[s, c], [-c, s]])

    @property
    def _turn(self) -> FloatArray:
        """(3, 3): from (across, along, height) to x, y, z, for rows."""
        turn = np.eye(3)
        turn[:2, :2] = self._frame.T
        return turn


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
        positive("radius", self.radius)
        positive("joint", self.joint)
        if abs(self.angle) * self.radius >= 0.95 * self.joint:
            raise GeometryError(
                f"a limb of {1e3 * self.radius:.4g} mm folds when it bends by "
                f"{math.degrees(self.angle):.4g}° over {1e3 * self.joint:.4g} mm",
                hint=f"expected less than {math.degrees(0.95 * self.joint / self.radius):.4g}°",
            )

    def point(self, uv: ArrayLike) -> FloatArray:
        """(n, 3) m."""
        u, v = rows_of(uv).T
        around = u / self.radius
        turn, middle = self._middle_line(v)
        y, z = (middle + self._away(turn) * (self.radius * np.cos(around))[:, None]).T
        return np.column_stack([self.radius * np.sin(around), y, z - self.radius])

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Around the limb true to length, along it 1 + κ r cos(u/r)."""
        u, v = rows_of(uv).T
        around = u / self.radius
        turn, _ = self._middle_line(v)
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

    def _middle_line(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) direction, rad, 0 in the middle of the joint, and (n, 2) place (y, z), m."""
        half = self.joint / 2
        inside = np.clip(v, -half, half)
        turn = self.angle * inside / self.joint
        # ∫ (cos, −sin) of the turning direction, by the chord of the arc
        chord = np.sinc(turn / (2 * np.pi)) * inside
        place = chord[:, None] * np.column_stack([np.cos(turn / 2), -np.sin(turn / 2)])
        beyond = (v - inside)[:, None] * np.column_stack([np.cos(turn), -np.sin(turn)])
        return turn, place + beyond

    @staticmethod
    def _away(turn: FloatArray) -> FloatArray:
        """(n, 2) from the middle line towards u = 0, in (y, z)."""
        return np.column_stack([np.sin(turn), np.cos(turn)])


def _check_seam(extent: float, radius: float) -> None:
    around = 2 * math.pi * radius
    if extent > around * (1 + _ROUNDING):
        raise GeometryError(
            f"the sheet is {1e3 * extent:.4g} mm wide and overlaps itself: a radius of "
            f"{1e3 * radius:.4g} mm is {1e3 * around:.4g} mm around",
            hint="take a larger radius, a narrower sheet, or another direction of the axis",
        )
