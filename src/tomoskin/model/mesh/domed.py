"""Sheets drawn over bodies that are curved both ways: a spherical cap, a saddle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh.surface import Surface, positive, rows_of


@dataclass(frozen=True)
class Cap(Surface):
    """Drawn over a sphere from its middle outwards, true to length along every radius.

    Lengths around shrink to R sin(r/R)/r of what they were (azimuthal equidistant map).
    """

    radius: float

    def __post_init__(self) -> None:
        """Refuse an impossible radius."""
        positive("radius", self.radius)

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        uv = rows_of(uv)
        angle = np.linalg.norm(uv, axis=1) / self.radius
        return np.column_stack(
            [uv * np.sinc(angle / np.pi)[:, None], self.radius * (np.cos(angle) - 1.0)]
        )

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """From the derivatives of sin(r/R)/(r/R), which are smooth in the middle."""
        uv = rows_of(uv)
        angle = np.linalg.norm(uv, axis=1) / self.radius
        ratio = np.sinc(angle / np.pi)
        out = np.zeros((len(uv), 3, 2))
        bend = _sinc_slope(angle) / self.radius**2
        out[:, :2] = ratio[:, None, None] * np.eye(2) + bend[:, None, None] * (
            uv[:, :, None] * uv[:, None, :]
        )
        out[:, 2] = -uv * ratio[:, None] / self.radius
        return out

    def check(self, uv: ArrayLike) -> None:
        """The sheet must end before the sphere's far side."""
        reach = float(np.linalg.norm(rows_of(uv), axis=1).max())
        if reach >= 0.95 * math.pi * self.radius:
            raise GeometryError(
                f"a sphere of radius {1e3 * self.radius:.4g} mm is covered at "
                f"{1e3 * math.pi * self.radius:.4g} mm from the middle, but the sheet extends "
                f"{1e3 * reach:.4g} mm from its middle",
                hint="take a larger radius",
            )


@dataclass(frozen=True)
class Saddle(Surface):
    """Hung over a saddle: z = v²/2R_v − u²/2R_u over the plane; R in m, inf is straight.

    A chair's back bends away to the sides (``radius_u``) and forward along its height.
    """

    radius_u: float
    radius_v: float

    def __post_init__(self) -> None:
        """Check that the radii are possible."""
        positive("radius_u", self.radius_u)
        positive("radius_v", self.radius_v)

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        u, v = rows_of(uv).T
        return np.column_stack([u, v, v**2 / (2 * self.radius_v) - u**2 / (2 * self.radius_u)])

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivatives (n, 3, 2) of the points."""
        u, v = rows_of(uv).T
        out = np.tile(np.eye(3)[:, :2], (len(u), 1, 1))
        out[:, 2] = np.column_stack([-u / self.radius_u, v / self.radius_v])
        return out


def _sinc_slope(x: FloatArray) -> FloatArray:
    """(d/dx sin(x)/x)/x, −1/3 at 0."""
    small = np.abs(x) < 1e-2
    safe = np.where(small, 1.0, x)
    exact = (safe * np.cos(safe) - np.sin(safe)) / safe**3
    return np.where(small, -1 / 3 + x**2 / 30 - x**4 / 840, exact)
