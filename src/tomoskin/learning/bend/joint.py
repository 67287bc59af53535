"""A reference that follows a joint's encoder: interpolated between recorded angles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from tomoskin.core import DataError, FloatArray
from tomoskin.sensing.signal import Reference

_SAME = 1e-4
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
        groups = np.split(order, np.flatnonzero(np.diff(a[order]) > _SAME) + 1)
        if len(groups) < 2:
            raise DataError(
                "expected frames at two or more angles of the joint, got one",
                hint="move the joint and record again",
            )
        means = np.array([v[g].mean(axis=0) for g in groups])
        left = np.concatenate([v[g] - v[g].mean(axis=0) for g in groups])
        degrees = max(len(v) - len(groups), 1)
        noise = np.sqrt(np.sum(left**2, axis=0) / degrees)
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
        if not low - _SAME <= angle <= high + _SAME:
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
