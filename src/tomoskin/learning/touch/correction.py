"""What labelled presses say of a fit: where it puts them instead, and how far it misses them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import Detection, FloatArray

_FEWEST = 8
"""Presses that were fitted, and part of all, from which something is said of the fit."""

_HALF = 0.5

_NOTHING = 1.0
"""m², more than any skin: nothing is known."""

_WORTH = 0.7
"""Part of the squared errors, each press left out, down to which a turn and a stretch must bring
them to be believed. Chosen on the twin's textile discs, seeds 31 to 33, turned by 0 and 14°."""

_ASTRAY = 3.0
"""Median errors beyond which a press was fitted elsewhere, and tells nothing of the others."""

_MEDIAN = float(2 * np.log(2))
"""Squared median error over the variance along an axis, of Gaussian errors in a plane."""


@dataclass(frozen=True, eq=False)
class FitCorrection:
    """From fitted positions to those that labels say: x → linear x + offset.

    Attributes
    ----------
    linear, offset
        (2, 2), and (2,) m.
    variance
        m² along an axis that errors have beyond what the fit says.
    """

    linear: FloatArray
    offset: FloatArray
    variance: float

    @classmethod
    def of(cls, fitted: FloatArray, variance: FloatArray, positions: FloatArray) -> Self:
        """Of presses ``fitted`` at (n, 2) m, NaN where none was, with the ``variance`` (n,) m² that
        the fit says, and their labels (n, 2) m."""
        found = np.flatnonzero(np.isfinite(fitted).all(axis=1))
        if len(found) < max(_FEWEST, _HALF * len(fitted)):
            return cls(np.eye(2), np.zeros(2), _NOTHING)
        fitted, positions, said = fitted[found], positions[found], float(np.median(variance[found]))
        plain = np.linalg.norm(fitted - positions, axis=1)
        linear, offset, left = _affine(fitted, positions)
        near = left <= _ASTRAY * np.median(left)
        linear, offset, left = _affine(fitted[near], positions[near])
        if (left @ left) > _WORTH * (plain[near] @ plain[near]):
            linear, offset, left = np.eye(2), np.zeros(2), plain
        beyond = float(np.median(left)) ** 2 / _MEDIAN - said
        return cls(linear, offset, max(beyond, 0.0))

    def __call__(self, fitted: Detection) -> tuple[FloatArray, FloatArray]:
        """Position (2,) m and covariance (2, 2) m² of a fitted touch."""
        own = np.array([[fitted.sd_x**2, fitted.cov_xy], [fitted.cov_xy, fitted.sd_y**2]])
        position = self.linear @ [fitted.x, fitted.y] + self.offset
        return position, self.linear @ own @ self.linear.T + self.variance * np.eye(2)


def _affine(fitted: FloatArray, positions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares: linear (2, 2), offset (2,), and (n,) m by which each is missed when it is left
    out."""
    rows = np.column_stack([fitted, np.ones(len(fitted))])
    inverse = np.linalg.pinv(rows)
    solution = inverse @ positions
    leverage = np.clip((rows * inverse.T).sum(axis=1), 0.0, 1 - 1e-9)
    left = np.linalg.norm(positions - rows @ solution, axis=1) / (1 - leverage)
    return solution[:2].T, solution[2], left
