"""Which detection is of which touch: the most likely assignment, and what else may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tomoskin.core import Detection, FloatArray
from tomoskin.touch.tracking.motion import GATE, States, distances
from tomoskin.touch.tracking.strength import ELSEWHERE, NOISE, TouchStrength, log_content

_STRENGTH = 4.0
"""What a strength costs at the most, in logarithms of a likelihood: forces come and go."""

_PARTED = 0.02
"""How far from the middle of two, along each axis, what is seen of them may be, m."""

_JUMP = 4.0
"""What it costs that two touches are seen as one, half-way between."""

_APART = 7.5
"""Cost of a touch that ends and another that begins: of a pair that is as likely."""

_LIMIT = 60.0
"""More than any pair costs."""

_OPEN = 6.0
"""Logarithm of the odds below which two touches may have changed places."""


@dataclass(frozen=True, slots=True, eq=False)
class ExpectedTouches:
    """Touches as they are expected: ``states`` of n, ``signs`` (n,), their ``strengths``,
    ``odds`` (n,), logarithms, that they are there, and which stand for ``several`` (n,) fingers."""

    states: States
    signs: FloatArray
    strengths: Sequence[TouchStrength]
    odds: FloatArray
    several: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Association:
    """Pairs {detection: touch}; the touches that ``jumped`` with theirs to the middle of two; and
    (touch, touch, log odds) of ``exchanges`` that are not ruled out."""

    pairs: dict[int, int]
    jumped: frozenset[int]
    exchanges: tuple[tuple[int, int, float], ...]


NOTHING = Association({}, frozenset(), ())


def associate(
    followed: ExpectedTouches, detections: Sequence[Detection], seen: tuple[FloatArray, FloatArray]
) -> Association:
    """The likeliest (Kuhn 1955). ``seen`` are the detections' positions and covariances.

    A pair costs the logarithm of its likelihood: of position, strength and existence. Beyond the
    gate, and between signs, there are none. Where a detection is left over and a touch too, two of
    the touches may be seen as one in the middle of their contents.
    """
    cost = _costs(followed, detections, seen)
    pairs = _least(cost)
    jumped: frozenset[int] = frozenset()
    if len(pairs) < min(cost.shape) and len(cost) > 1:
        jumps = _jumps(followed, detections, seen)
        jumps[:, list(pairs)] = _LIMIT
        jumps[list(pairs.values())] = _LIMIT
        more = _least(jumps)
        pairs, jumped = pairs | more, frozenset(more.values())
    return Association(pairs, jumped, tuple(_exchanges(cost, pairs)))


def _costs(
    followed: ExpectedTouches, detections: Sequence[Detection], seen: tuple[FloatArray, FloatArray]
) -> FloatArray:
    positions, spreads = seen
    spreads = spreads + _PARTED**2 * followed.several[:, None, None, None] * np.eye(2)
    far = distances(followed.states, positions, spreads)
    both = followed.states.covariance[:, None, :2, :2] + spreads
    area = both[..., 0, 0] * both[..., 1, 1] - both[..., 0, 1] ** 2
    contents = np.array([log_content(d) for d in detections])
    means = np.array([s.mean for s in followed.strengths])
    variance = np.array([s.variance for s in followed.strengths]) + NOISE**2 + ELSEWHERE**2
    apart = (contents - means[:, None]) ** 2 / variance[:, None]
    cost = 0.5 * far + 0.5 * np.log(area / 1e-8) + np.minimum(0.5 * apart, _STRENGTH)
    cost += np.log1p(np.exp(-followed.odds))[:, None]
    allowed = (far <= GATE) & (cost <= _APART) & (followed.signs[:, None] == _signs(detections))
    return np.where(allowed, cost, _LIMIT)


def _jumps(
    followed: ExpectedTouches, detections: Sequence[Detection], seen: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(n, m) what it costs that a touch and another one are seen together."""
    contents = np.exp([s.mean for s in followed.strengths])
    share = (contents[:, None] / (contents[:, None] + contents))[..., None]
    x, spread = followed.states.mean[:, :2], followed.states.covariance[:, :2, :2]
    middle = share * x[:, None] + (1 - share) * x
    weights = share[..., None]
    both = weights**2 * spread[:, None] + (1 - weights) ** 2 * spread
    n, m = len(x), len(detections)
    states = States(middle.reshape(-1, 2), both.reshape(-1, 2, 2))
    far = distances(states, *seen).reshape(n, n, m)
    signs = followed.signs
    apart = signs[:, None] != signs
    far[apart | np.eye(n, dtype=bool)] = np.inf
    far[signs[:, None, None] != _signs(detections) + np.zeros((n, n, 1))] = np.inf
    nearest = far.min(axis=1)
    # the stronger one goes on
    return np.where(nearest <= GATE, _JUMP + 0.5 * nearest - np.log(contents)[:, None] / 8, _LIMIT)


def _signs(detections: Sequence[Detection]) -> FloatArray:
    return np.sign([d.peak for d in detections])


def _least(cost: FloatArray) -> dict[int, int]:
    rows, columns = linear_sum_assignment(cost)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return {column: row for row, column in pairs if cost[row, column] < _LIMIT}


def _exchanges(cost: FloatArray, pairs: dict[int, int]) -> list[tuple[int, int, float]]:
    found = list(pairs.items())
    open_ones = []
    for number, (a, i) in enumerate(found):
        for b, k in found[:number]:
            odds = cost[i, a] + cost[k, b] - cost[i, b] - cost[k, a]
            if odds > -_OPEN and cost[i, b] < _LIMIT and cost[k, a] < _LIMIT:
                open_ones.append((i, k, float(min(odds, 0.0))))
    return open_ones
