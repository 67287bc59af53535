"""Weights of the measurements, from their noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray

_QUIETEST = 0.1
"""No row is taken for quieter than this part of the median: a row that never moves is dead, not
exact."""


def noise_weights(noise: NDArray[np.floating], default: FloatArray) -> FloatArray:
    """Diagonal of W from the standard deviation of each row, W ∝ 1/sd².

    Scaled so that the weights have the geometric mean of the default ones: where the noise is as
    those suppose, they stay as they are, and alpha keeps its meaning.

    Parameters
    ----------
    noise
        (n_meas,) standard deviation of the difference data, V or a ratio.
    default
        (n_meas,) weights of a problem without known noise; see :class:`LinearProblem`.

    Raises
    ------
    DataError
        When there are more or fewer values than rows, or one is negative or not finite.
    """
    if noise.shape != default.shape:
        raise DataError(f"expected noise of shape {default.shape}, got {noise.shape}")
    good = np.isfinite(noise) & (noise >= 0)
    if not good.all():
        row = int(np.argmin(good))
        raise DataError(f"expected noise of at least 0, got {noise[row]}", where=f"row {row}")
    if not noise.any():
        return default
    sd = np.maximum(noise, _QUIETEST * np.median(noise[noise > 0]))
    return np.asarray(np.exp(np.mean(np.log(default * sd**2))) / sd**2)
