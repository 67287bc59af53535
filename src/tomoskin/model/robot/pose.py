"""Where one frame of coordinates lies in another, and a surface that is moved with its frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Surface

_UPRIGHT = 1e-9
"""Cosine of the pitch below which it is a right angle."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A rigid motion: a point p of the inner frame is at ``rotation`` p + ``position``.

    Attributes
    ----------
    position
        (3,) m.
    rotation
        (3, 3) orthogonal.
    """

    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of(cls, position: ArrayLike, angles: ArrayLike) -> Self:
        """``position`` (3,) m; ``angles`` (3,) rad about the outer frame's fixed x, y and z.

        That is roll, pitch and yaw as a URDF has them.
        """
        rotation = np.eye(3)
        for axis, angle in enumerate(np.asarray(angles, dtype=np.float64).tolist()):
            rotation = turn(np.eye(3)[axis], angle) @ rotation
        return cls(np.asarray(position, dtype=np.float64), rotation)

    def degrees(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw, as :meth:`of` takes them but in degrees."""
        r = self.rotation
        pitch = np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))
        if np.hypot(r[0, 0], r[1, 0]) > _UPRIGHT:
            roll, yaw = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
        else:  # x points along z: only the sum or difference of the two is told
            roll, yaw = 0.0, np.arctan2(-r[0, 1], r[1, 1])
        found: list[float] = np.degrees([roll, pitch, yaw]).tolist()
        return found[0], found[1], found[2]

    def quaternion(self) -> tuple[float, ...]:
        """The rotation as x, y, z, w."""
        return quaternion(self.rotation.T.tolist())

    def __call__(self, points: FloatArray) -> FloatArray:
        """(n, 3) m: points of the inner frame, in the outer one."""
        return np.asarray(points @ self.rotation.T + self.position)

    def __matmul__(self, inner: Pose) -> Pose:
        """A frame inside this one's inner frame, in this one's outer frame."""
        position = self.rotation @ inner.position + self.position
        return Pose(position, self.rotation @ inner.rotation)


def pose_numbers(text: str, units: str) -> tuple[float, ...]:
    """The six of "X/Y/Z" or "X/Y/Z/ROLL/PITCH/YAW"; zeros of "".

    Raises ValueError that names the ``units``.
    """
    try:
        numbers = tuple(map(float, text.split("/"))) if text else (0.0, 0.0, 0.0)
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 6) or not all(map(math.isfinite, numbers)):
        raise ValueError(f'expected X/Y/Z or X/Y/Z/ROLL/PITCH/YAW in {units}, got "{text}"')
    return (*numbers, 0.0, 0.0, 0.0)[:6]


def quaternion(axes: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """X, y, z, w of the rotation to three ``axes``; of 4 q qᵀ the row that is best conditioned."""
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = axes
    rows = (
        (1 + xx - yy - zz, xy + yx, xz + zx, zy - yz),
        (xy + yx, 1 - xx + yy - zz, yz + zy, xz - zx),
        (xz + zx, yz + zy, 1 - xx - yy + zz, yx - xy),
        (zy - yz, xz - zx, yx - xy, 1 + xx + yy + zz),
    )
    best = max(enumerate(rows), key=lambda item: item[1][item[0]])[1]
    length = math.hypot(*best)
    return tuple(value / length for value in best)


def turn(axis: FloatArray, angle: float) -> FloatArray:
    """(3, 3) rotation by ``angle`` rad about a unit vector (Rodrigues 1840)."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


@dataclass(frozen=True)
class Moved(Surface):
    """A ``surface`` in the outer frame of a ``pose``."""

    surface: Surface
    pose: Pose

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        return self.pose(self.surface.point(uv))

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivatives (n, 3, 2) of the points."""
        return np.asarray(self.pose.rotation @ self.surface.jacobian(uv))

    def check(self, uv: ArrayLike) -> None:
        """Check the surface that is moved."""
        self.surface.check(uv)


@dataclass(frozen=True, slots=True)
class Place:
    """Which of a robot's skins it is, and where: ``pose`` in the frame ``link``.

    ``link`` is "" where it is not known: coordinates are then the skin's own.
    """

    name: str
    link: str = ""
    pose: Pose = field(default_factory=Pose)

    def moved(self, surface: Surface) -> Surface:
        """The skin's ``surface`` in the coordinates of the link."""
        return Moved(surface, self.pose) if self.link else surface
