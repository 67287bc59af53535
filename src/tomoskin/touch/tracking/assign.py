"""Which reading is of which touch."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from tomoskin.core import FloatArray, Reading
from tomoskin.touch.tracking.motion import GATE, States, distances

_BEHIND = 4.0
"""Added to the cost of what is not yet a touch, or was not seen last: one that was comes first."""


_LEAST = 1e-9


def region_radius(reading: Reading) -> float:
    """Radius of the disc of the reading's area, m; 0 where it has none."""
    return math.sqrt(reading.area / math.pi) if reading.area > 0 else 0.0


def assigned(
    states: States,
    signs: FloatArray,
    behind: FloatArray,
    readings: Sequence[Reading],
    seen: tuple[FloatArray, FloatArray],
) -> tuple[dict[int, int], FloatArray]:
    """Pairs {reading: trace} of least cost (Kuhn 1955), and the distances (n, m).

    ``signs`` and ``behind`` are (n,), ``seen`` the readings' places and covariances. A pair costs
    its squared Mahalanobis distance, but no more than the gate where the trace is within the
    reading's region: when two regions become one, its centre jumps. Beyond the gate, and between
    signs, there are none.
    """
    places, spreads = seen
    far = distances(states, places, spreads)
    radii = np.array([max(region_radius(r), _LEAST) for r in readings])
    away = (states.mean[:, None, :2] - places) / radii[:, None]
    share = away[..., 0] ** 2 + away[..., 1] ** 2
    cost = np.minimum(far, np.where(share < 1, GATE * (0.5 + 0.5 * share), np.inf))
    cost[signs[:, None] != np.sign([r.peak for r in readings])] = np.inf
    allowed = cost <= GATE
    limit = GATE + _BEHIND + 1
    cost = np.where(allowed, cost + _BEHIND * behind[:, None], limit)
    rows, columns = linear_sum_assignment(cost)
    found = zip(rows.tolist(), columns.tolist(), strict=True)
    return {column: row for row, column in found if allowed[row, column]}, far
