"""Pressed frames against the untouched frames around them, which are many and share their noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from tomoskin.calibration.locator.presses import frames
from tomoskin.core import DataError, FloatArray


def against_rest(pressed: ArrayLike, rest: ArrayLike) -> FloatArray:
    """(n, n_meas) change of each pressed frame against the level of the untouched ones.

    Each press has an untouched frame just before it. Their level is a random walk under white
    noise; how much either is worth follows from the differences between consecutive ones:
    variance q + 2r, covariance of neighbours −r. The steady Kalman smoother of that model (Harvey
    1989, 4.2 and 4.6) averages as many before and after as the drift allows.

    Parameters
    ----------
    pressed, rest
        (n, n_meas) in the order in which they were taken; ``rest[k]`` before ``pressed[k]``.

    Raises
    ------
    DataError
        For shapes that do not belong together, or values at rest that are not finite.
    """
    level = frames(rest)
    data = frames(pressed, level.shape[1])
    if len(data) != len(level) or not np.isfinite(level).all():
        raise DataError(
            f"expected a finite untouched frame for each of {len(data)} presses, got {len(level)}"
        )
    gain = _gain(level)
    before, after = _filtered(level, gain), _filtered(level[::-1], gain)[::-1]
    return np.asarray(data - (before + after - gain * level) / (2 - gain))


def _filtered(level: FloatArray, gain: float) -> FloatArray:
    start = (1 - gain) * level[:1]
    return np.asarray(lfilter([gain], [1, gain - 1], level, axis=0, zi=start)[0])


def _gain(level: FloatArray) -> float:
    """Part of a new frame that is believed; 1 where there is nothing to average."""
    steps = np.diff(level, axis=0)
    if len(steps) < 2:
        return 1.0
    white = max(-float(np.mean(steps[1:] * steps[:-1])), 0.0)
    walk = max(float(np.mean(steps**2)) - 2 * white, 0.0)
    if not white:
        return 1.0
    ahead = (walk + np.sqrt(walk**2 + 4 * walk * white)) / 2
    return max(float(ahead / (ahead + white)), 1 / len(level))
