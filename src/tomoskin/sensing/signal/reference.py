"""The reference: what an untouched skin reads, and how much it wavers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import DataError, FloatArray
from tomoskin.sensing.signal.health import Mask

MEMORY = 512
"""Frames that a scatter rests on at most: older ones fade."""

_WILD = 6.0
"""A value counts for at most so many deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class Scatter:
    """Mean product of the deviations of an idle frame from its reference, whose own error is in it.

    Attributes
    ----------
    matrix
        (n_meas, n_meas) V².
    frames
        How many independent frames it rests on.
    """

    matrix: FloatArray
    frames: int

    @classmethod
    def of(cls, values: FloatArray) -> Self:
        """About the mean of idle frames (n, n_meas) V, two at least."""
        away = values - values.mean(axis=0)
        n = len(values) - 1
        return cls(away.T @ away * ((n + 2) / (n + 1) / n), n)

    def after(self, deviations: FloatArray, lost: Mask) -> Scatter:
        """With further idle frames, (n, n_meas) V of deviation from what was expected of them.

        ``lost`` rows, (n_meas,) bool, say nothing: they stay as they were.

        What is wild beside those known is cut off: a knock at a cable is not the noise of all
        times. Noise that lasts is learnt in a few steps all the same.
        """
        most = _WILD * np.sqrt(np.diag(self.matrix))
        held = np.clip(deviations, -most, most)
        total = self.frames + len(held)
        matrix = (self.frames * self.matrix + held.T @ held) / total
        if lost.any():
            matrix = np.where(lost[:, None] | lost, self.matrix, matrix)
        return Scatter(matrix, min(total, MEMORY))


_QUIET = 0.5
"""A channel is never taken for quieter than this fraction of the median channel: a standard
deviation from a few frames can come out near zero by chance."""


@dataclass(frozen=True, eq=False)
class Reference:
    """Mean and noise of idle frames.

    ``mean`` (n_meas,) V; ``noise`` (n_meas,) standard deviation of one frame, V, NaN when there
    was a single frame; ``n_frames`` how many were averaged; ``least`` V, or (n_meas,) V, below
    which noise is never taken to be: what rounding leaves though nothing flickers.
    """

    mean: FloatArray
    noise: FloatArray
    n_frames: int
    least: FloatArray | float = 0.0
    scatter: Scatter | None = None

    @classmethod
    def of(cls, values: FloatArray, least: FloatArray | float = 0.0) -> Self:
        """Reference from idle frames, (n_frames, n_meas) V.

        Raises
        ------
        DataError
            When there is no frame, or a value is not finite.
        """
        if values.ndim != 2 or not len(values):
            raise DataError(f"expected frames (n, n_meas) for a reference, got {values.shape}")
        finite = np.isfinite(values)
        if not finite.all():
            frame, row = np.argwhere(~finite)[0].tolist()
            raise DataError(
                f"expected finite voltages, got {values[frame, row]}",
                where=f"reference frame {frame}, row {row}",
            )
        noise = np.maximum(_noise(values), least)
        scatter = Scatter.of(values) if len(values) > 1 else None
        return cls(values.mean(axis=0), noise, len(values), least, scatter)

    @property
    def noise_is_known(self) -> bool:
        """Whether there were frames enough to tell the noise."""
        return self.n_frames > 1


def _noise(values: FloatArray) -> FloatArray:
    if len(values) < 2:
        return np.full(values.shape[1], np.nan)
    spread = values.std(axis=0, ddof=1)
    return np.asarray(np.maximum(spread, _QUIET * np.median(spread)))
