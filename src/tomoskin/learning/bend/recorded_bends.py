"""Recorded bends: what the data were at known angles, and references between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from tomoskin.core import DataError, FloatArray
from tomoskin.sensing.signal import Reference

_LEAST = 6
"""Frames of a bent sheet from which something can be learnt."""

_SAME = 1e-6
"""Axes that differ by less, rad, are the same."""


@dataclass(frozen=True, eq=False)
class BendExamples:
    """Frames in the order of their times, nothing touching.

    Attributes
    ----------
    dv
        (n, n_meas) V minus the straight sheet.
    angle, axis
        (n,) rad: angle of the bend, and direction of its axis from u, which is a direction
        without a sense; whatever it is where the angle is 0.
    time
        (n,) s, ascending.
    """

    dv: FloatArray
    angle: FloatArray
    axis: FloatArray
    time: FloatArray

    @classmethod
    def checked(cls, dv: ArrayLike, angle: ArrayLike, axis: ArrayLike, time: ArrayLike) -> Self:
        """Check the frames and their labels.

        Raises
        ------
        DataError
            For arrays that do not belong together, times that do not go on, fewer than six bent
            frames, or one angle only.
        """
        data = np.asarray(dv, dtype=np.float64)
        one = [np.asarray(a, dtype=np.float64) for a in (angle, axis, time)]
        if data.ndim != 2 or any(a.shape != (len(data),) for a in one):
            shapes = ", ".join(str(a.shape) for a in (data, *one))
            raise DataError(f"expected (n, n_meas) frames and (n,) labels, got {shapes}")
        if not all(np.isfinite(a).all() for a in (data, *one)):
            raise DataError(
                "expected finite frames, angles, axes and times, got values that are not finite"
            )
        if not (np.diff(one[2]) > 0).all():
            raise DataError(
                "expected frames in the order of their times, got a time that does not increase"
            )
        bent = np.abs(one[0]) > _SAME
        if np.count_nonzero(bent) < _LEAST or len(np.unique(one[0])) < 3:
            raise DataError(
                f"expected the straight sheet and at least {_LEAST} bent frames at two or more "
                f"angles, got {np.count_nonzero(bent)} bent frames at "
                f"{len(np.unique(one[0][bent]))} angles",
                hint="bend the skin to a few known angles, and back",
            )
        return cls(data, *one)

    @property
    def axes(self) -> FloatArray:
        """(k,) different directions of axes, rad from 0 to π."""
        bent = np.abs(self.angle) > _SAME
        return np.unique(np.round(np.mod(self.axis[bent], np.pi), 5))

    @property
    def turns(self) -> bool:
        """Whether there are axes enough to tell others from: three."""
        return len(self.axes) >= 3

    @property
    def targets(self) -> FloatArray:
        """(n, 1) angle; or (n, 3) angle · (1, cos 2a, sin 2a) where the axis a is told too.

        These three are the curvature's trace and deviator, which small bends' voltages are
        linear in.
        """
        if not self.turns:
            return self.angle[:, None]
        double = 2 * self.axis
        parts = np.column_stack([np.ones_like(double), np.cos(double), np.sin(double)])
        return np.asarray(self.angle[:, None] * parts)


_SAME_JOINT = 1e-4
"""Angles that differ by less, rad, are one."""


@dataclass(frozen=True, eq=False)
class JointReference:
    """What the untouched skin reads at each angle of a joint.

    Attributes
    ----------
    angles
        (k,) rad, ascending.
    means
        (k, n_meas) V.
    noise
        (n_meas,) V of one frame.
    n_frames
        At the angle with the fewest.
    """

    angles: FloatArray
    means: FloatArray
    noise: FloatArray
    n_frames: int

    @classmethod
    def of(cls, voltages: ArrayLike, angle: ArrayLike) -> Self:
        """From untouched frames (n, n_meas) V at the encoder's angles (n,) rad.

        Raises
        ------
        DataError
            For arrays that do not belong together, or fewer than two angles.
        """
        v, a = np.asarray(voltages, dtype=np.float64), np.asarray(angle, dtype=np.float64)
        if (
            v.ndim != 2
            or a.shape != (len(v),)
            or not (np.isfinite(v).all() and np.isfinite(a).all())
        ):
            raise DataError(
                f"expected finite frames (n, n_meas) and angles (n,), got {v.shape}, {a.shape}"
            )
        order = np.argsort(a, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(a[order]) > _SAME_JOINT) + 1)
        if len(groups) < 2:
            raise DataError(
                "expected frames at two or more angles of the joint, got one",
                hint="move the joint and record again",
            )
        means = np.array([v[g].mean(axis=0) for g in groups])
        residual = np.concatenate([v[g] - v[g].mean(axis=0) for g in groups])
        degrees = max(len(v) - len(groups), 1)
        noise = np.sqrt(np.sum(residual**2, axis=0) / degrees)
        if len(v) == len(groups):
            noise = np.full(v.shape[1], np.nan)
        return cls(
            np.array([a[g].mean() for g in groups]), means, noise, min(len(g) for g in groups)
        )

    def at(self, angle: float) -> Reference:
        """The reference at ``angle`` rad: a monotone cubic between the angles (Fritsch & Carlson
        1980).

        Raises
        ------
        DataError
            For an angle beyond those that were recorded.
        """
        low, high = self.angles[0], self.angles[-1]
        if not low - _SAME_JOINT <= angle <= high + _SAME_JOINT:
            raise DataError(
                f"expected an angle from {np.degrees(low):.1f}° to {np.degrees(high):.1f}°, got "
                f"{np.degrees(angle):.1f}°",
                where="joint",
                hint="record references at that angle as well",
            )
        held = float(np.clip(angle, low, high))
        return Reference(np.asarray(self._course(held)), self.noise, self.n_frames)

    @cached_property
    def _course(self) -> PchipInterpolator:
        return PchipInterpolator(self.angles, self.means, axis=0)
