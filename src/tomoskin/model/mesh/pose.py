"""Where one frame of coordinates lies in another, and surfaces there."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from tomoskin.core import FloatArray
from tomoskin.model.mesh.surface import Surface


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
        rotation = Rotation.from_euler("xyz", np.asarray(angles, dtype=np.float64))
        return cls(np.asarray(position, dtype=np.float64), rotation.as_matrix())

    def degrees(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw, as :meth:`of` takes them but in degrees."""
        with warnings.catch_warnings():
            # where x points along z, the data give only the sum or difference of roll and yaw
            warnings.simplefilter("ignore", UserWarning)
            roll, pitch, yaw = Rotation.from_matrix(self.rotation).as_euler("xyz", degrees=True)
        return float(roll), float(pitch), float(yaw)

    def quaternion(self) -> tuple[float, ...]:
        """The rotation as a quaternion x, y, z, w."""
        return quaternion(self.rotation.T)

    def __call__(self, points: FloatArray) -> FloatArray:
        """(n, 3) m: points of the inner frame, in the outer one."""
        return np.asarray(points @ self.rotation.T + self.position)

    def inside(self, points: FloatArray) -> FloatArray:
        """(n, 3) m: points of the outer frame, in the inner one."""
        return np.asarray((points - self.position) @ self.rotation)

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


def quaternion(axes: ArrayLike) -> tuple[float, ...]:
    """X, y, z, w of the rotation to three ``axes`` (3, 3), one a row."""
    xyzw: list[float] = Rotation.from_matrix(np.transpose(axes)).as_quat().tolist()
    return tuple(xyzw)


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
