"""Recorded bends: what the data were at known angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray

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
