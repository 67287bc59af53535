"""What an untouched skin scatters by about its level: all measurements together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
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
