"""A recorded motion: what the data were, and at which states of the body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray

_LEAST = 6
"""Frames of a moved body from which something can be learnt."""

_SAME = 1e-6
"""A coordinate that is below this is at rest."""

MOST_COORDINATES = 3

TENSOR = ("curvature", "deviator xx", "deviator xy")
"""Coordinates of a bend whose axis is not known: angle · (1, cos 2a, sin 2a)."""


@dataclass(frozen=True, eq=False)
class BodyExamples:
    """Frames of a body that moves, in the order of their times, nothing touching.

    Attributes
    ----------
    dv
        (n, n_meas) V minus the skin at rest.
    time
        (n,) s, ascending.
    state
        (n, d) coordinates of the body, 0 at rest, d from 1 to 3. Without a column where nothing
        has measured them.
    names
        (d,) what the coordinates are. A name that begins with "angle" is in rad.
    axis
        Rad from u, of a bend that has one axis only.
    """

    dv: FloatArray
    time: FloatArray
    state: FloatArray
    names: tuple[str, ...]
    axis: FloatArray

    @classmethod
    def checked(
        cls,
        dv: ArrayLike,
        time: ArrayLike,
        *,
        state: FloatArray | None = None,
        names: tuple[str, ...] = (),
        axis: FloatArray | None = None,
        angle: FloatArray | None = None,
    ) -> Self:
        """Check the frames and their states.

        Instead of ``state``, ``angle`` (n,) rad may say how the body is bent, and then ``axis``
        (n,) rad from u about which, a direction without a sense.

        Raises
        ------
        DataError
            For arrays that do not belong together, times that do not go on, fewer than six moved
            frames, a coordinate that does not move, or more than three coordinates.
        """
        data, times = np.asarray(dv, dtype=np.float64), np.asarray(time, dtype=np.float64)
        about = np.asarray(np.pi / 2 if axis is None else axis, dtype=np.float64)
        if angle is not None:
            names, state, about = _of_bends(np.asarray(angle, dtype=np.float64), about)
        values = np.zeros((len(data), 0)) if state is None else np.asarray(state, np.float64)
        if data.ndim != 2 or times.shape != (len(data),) or values.shape != (len(data), len(names)):
            shapes = ", ".join(str(a.shape) for a in (data, times, values))
            raise DataError(
                "expected (n, n_meas) frames, (n,) times and (n, d) states with d names, got "
                f"{shapes} and {len(names)} names"
            )
        if not all(np.isfinite(a).all() for a in (data, times, values)):
            raise DataError(
                "expected finite frames, times and states, got values that are not finite"
            )
        if not (np.diff(times) > 0).all():
            raise DataError(
                "expected frames in the order of their times, got a time that does not increase"
            )
        _check_moves(values, names)
        return cls(data, times, values, names, about)

    @cached_property
    def size(self) -> FloatArray:
        """(d,) the largest of each coordinate."""
        return np.asarray(np.abs(self.state).max(axis=0))

    @property
    def turns(self) -> bool:
        """Whether the axis of a bend is among the coordinates."""
        return self.names == TENSOR


def _of_bends(
    angle: FloatArray, axis: FloatArray
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, state and axis of a bend: its angle about one axis, or angle · (1, cos 2a, sin 2a)
    where there are three axes a or more.

    These are the curvature's trace and deviator, in which small bends' voltages are linear.
    """
    axis = np.broadcast_to(axis, angle.shape) if axis.ndim == 0 else axis
    if angle.ndim != 1 or angle.shape != axis.shape:
        raise DataError(f"expected (n,) labels, got {angle.shape} angles and {axis.shape} axes")
    bent = np.abs(angle) > _SAME
    axes = np.mod(axis[bent], np.pi)
    if len(np.unique(axes.round(5))) < 3:
        return ("angle",), angle[:, None], axes[:1].sum()
    parts = np.column_stack([np.ones_like(axis), np.cos(2 * axis), np.sin(2 * axis)])
    return TENSOR, angle[:, None] * parts, np.zeros(())


def _check_moves(values: FloatArray, names: tuple[str, ...]) -> None:
    if len(names) > MOST_COORDINATES:
        raise DataError(
            f"expected at most {MOST_COORDINATES} coordinates of a body, got {len(names)}"
        )
    moved = np.abs(values) > _SAME
    if values.shape[1] and np.count_nonzero(moved.any(axis=1)) < _LEAST:
        raise DataError(
            f"expected the body at rest and at least {_LEAST} moved frames, got "
            f"{np.count_nonzero(moved.any(axis=1))} moved frames",
            hint="move the body through what it will do, and back",
        )
    for name, column in zip(names, values.T, strict=True):
        if len(np.unique(column)) < 3:
            raise DataError(
                f"expected the body at rest and at two or more values of {name}, got "
                f"{len(np.unique(column))} values",
                hint="move the body through what it will do, and back",
            )
