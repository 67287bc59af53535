"""What an untouched skin scatters by about its level: all measurements together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.signal.health import Mask

MEMORY = 512
"""Frames that a scatter rests on at most: older ones fade."""

_WILD = 9.0
"""A frame counts for at most so many times the squares that one has as a rule."""


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

        A frame that is wild beside those known is made smaller first: a knock at a cable is not
        the noise of all times. Noise that lasts is learnt in a few steps all the same.
        """
        usual = np.maximum(np.diag(self.matrix), np.finfo(float).tiny)
        size = np.mean(deviations[:, ~lost] ** 2 / usual[~lost], axis=1)
        held = deviations * np.sqrt(np.minimum(1.0, _WILD / np.maximum(size, _WILD)))[:, None]
        total = self.frames + len(held)
        matrix = (self.frames * self.matrix + held.T @ held) / total
        if lost.any():
            matrix = np.where(lost[:, None] | lost, self.matrix, matrix)
        return Scatter(matrix, min(total, MEMORY))
