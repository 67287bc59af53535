"""Presses as another session would have measured them, channel by channel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.touch.gaussian_process import nearness

_NEAR = 0.2
"""Radius of what is called the same place, in radii of the region."""

_FEWEST = 10
"""Values of a channel, before and now, below which it stays as it was."""

CHANCE = 1.36
"""Distance of two distributions that chance exceeds once in twenty times (Kolmogorov). Sessions of
public skins are 2.4 to 5.7 apart, and touches of one session, wherever they are, 0.7 to 1.0."""


def prevalence(presses: FloatArray, touches: FloatArray) -> FloatArray:
    """(n,) how often touches come near each of ``presses`` (n, 2), over how often presses do.

    ``touches`` (m, 2), both in radii of the region. The sum is one.
    """
    often, before = (nearness(presses, some, _NEAR).mean(axis=1) for some in (touches, presses))
    weight = often / before
    return np.asarray(weight / weight.sum())


def matched(before: FloatArray, now: FloatArray, weight: FloatArray) -> FloatArray:
    """``before`` (n, k) with each channel's distribution mapped onto that of ``now`` (m, k).

    The ``weight`` (n,) of each press says how often touches are there now. A monotone mapping of
    one channel keeps the order of its values, whatever the gains and the law of the material.
    """
    like = before.copy()
    for channel, rows, values in _channels(before, now):
        part = weight[rows]
        below = (part.cumsum() - 0.5 * part) / max(part.sum(), np.finfo(float).tiny)
        like[rows, channel] = np.quantile(values, below)
    return like


def distance(before: FloatArray, now: FloatArray, weight: FloatArray) -> float:
    """How far the channels' distributions are apart: Kolmogorov's statistic, median over channels.

    Arguments as for :func:`matched`; a weighted sample counts as (Σ w)² / Σ w² values.
    """
    count = 1 / float(weight @ weight)
    scale = np.sqrt(count * len(now) / (count + len(now)))
    apart = [_apart(before[rows, k], weight[rows], v) for k, rows, v in _channels(before, now)]
    return float(scale * np.median(apart)) if apart else 0.0


def _channels(before: FloatArray, now: FloatArray) -> Iterator[tuple[int, IntArray, FloatArray]]:
    """Number of a channel, rows of ``before`` in the order of its values, and sorted values now."""
    for channel in range(before.shape[1]):
        values = now[np.isfinite(now[:, channel]), channel]
        order = before[:, channel].argsort()
        rows = order[np.isfinite(before[order, channel])]
        if min(len(values), len(rows)) >= _FEWEST:
            yield channel, rows, np.sort(values)


def _apart(ours: FloatArray, weight: FloatArray, theirs: FloatArray) -> float:
    """Largest difference of two cumulative distributions of sorted values."""
    both = np.concatenate([ours, theirs])
    share = np.append(0.0, weight.cumsum() / weight.sum())
    first = share[ours.searchsorted(both, side="right")]
    second = theirs.searchsorted(both, side="right") / len(theirs)
    return float(np.abs(first - second).max())
