"""Touches that come too close to separate, and come apart again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from tomoskin.core import FloatArray
from tomoskin.touch.tracking.motion import region_radius
from tomoskin.touch.tracking.trace import Trace, Unmerged, content

_REACH = 2.0
"""A touch merges into a region, and comes out of it, within so many of its radii."""

_CLOSE = 0.005
_CHANGED = 0.25
"""By so much a region that takes up another has grown, in parts of its content, and moved to where
that was, in parts of the way. Chosen on two presses that slide together (twin, seeds 1 to 3)."""


_PASSING = 1.2
"""Touches that have been one for longer than this many times as long as it takes to pass each other
have stopped, and come out where they went in."""


def carrier_of(lost: Trace, traces: Sequence[Trace]) -> Trace | None:
    """The touch in whose region the ``lost`` one has been since it went missing, or None.

    A touch that is lifted leaves its neighbour as it was; one that has merged makes the
    neighbour's region larger and draws it over.
    """
    near = [t for t in traces if t is not lost and t.missing is None and _holds(t, lost)]
    return min(near, key=lambda t: _between(t, lost), default=None)


def _holds(trace: Trace, lost: Trace) -> bool:
    before = lost.beside.get(trace.number)
    if before is None or trace.sign != lost.sign:
        return False
    if _between(trace, lost) > _REACH * region_radius(trace.detection):
        return False
    return trace.detection.close or _change(trace, before, lost) > _CHANGED


def _change(trace: Trace, before: Unmerged, lost: Trace) -> float:
    start = before.states.mean[0, :2]
    way = np.array([lost.detection.x, lost.detection.y]) - start
    moved = np.array([trace.detection.x, trace.detection.y]) - start
    was = content(before.detection)
    grown = content(trace.detection) / was - 1 if was > 0 else 0.0
    return float(grown + moved @ way / max(float(way @ way), _CLOSE**2))


def _between(trace: Trace, lost: Trace) -> float:
    r, (x, y) = trace.detection, lost.position.tolist()
    return min(
        math.hypot(r.x - x, r.y - y), math.hypot(r.x - lost.detection.x, r.y - lost.detection.y)
    )


def merge(carrier: Trace, lost: Trace) -> None:
    """Merge the ``lost`` touch into ``carrier``; both keep what they were alone."""
    if carrier.alone is None:
        carrier.alone = lost.beside[carrier.number]
    if lost.alone is None:
        lost.alone = lost.beside[lost.number]
    carrier.others += [lost, *lost.others]
    lost.others = []


def origin_of(branch: Trace, traces: Sequence[Trace]) -> Trace | None:
    """The merged touch that a new one has come out of, or None."""
    for trace in traces:
        if trace.others and trace.sign == branch.sign:
            away = (trace.detection.x - branch.detection.x, trace.detection.y - branch.detection.y)
            if np.hypot(*away) <= max(_REACH * region_radius(trace.detection), _spread(trace)):
                return trace
    return None


def _spread(carrier: Trace) -> float:
    """Twice the largest distance between the merged touches when they last were apart."""
    apart = [member.alone.detection for member in carrier.members if member.alone]
    positions = np.array([(detection.x, detection.y) for detection in apart])
    return 2 * float(np.linalg.norm(positions[:, None] - positions, axis=2).max(initial=0.0))


def split(carrier: Trace, branch: Trace, time: float) -> tuple[Trace, Trace]:
    """The two touches that ``carrier`` and the new ``branch`` are now.

    Each branch takes the identity that is expected nearest to it, about their common middle.
    """
    members = [carrier, *carrier.others]
    carrier.others = []
    seen = np.array([(t.detection.x, t.detection.y) for t in (carrier, branch)])
    seen -= seen.mean(axis=0)
    cost = min((_costs(expected, seen) for expected in _expected(members, time)), key=_least)
    owners, branches = linear_sum_assignment(cost)
    sides = [replace(t) for t in (carrier, branch)]
    chosen = {int(b): members[m] for m, b in zip(owners, branches, strict=True)}
    for side, trace in chosen.items():
        trace.become(sides[side])
    for number, member in enumerate(members):
        if number not in owners:
            chosen[int(cost[number].argmin())].others.append(member)
    for trace in chosen.values():
        trace.alone = trace.alone if trace.others else None
    return chosen[0], chosen[1]


def _costs(expected: FloatArray, seen: FloatArray) -> FloatArray:
    return np.asarray(((expected[:, None] - seen) ** 2).sum(axis=2))


def _least(cost: FloatArray) -> float:
    return float(cost[linear_sum_assignment(cost)].sum())


def _expected(members: Sequence[Trace], time: float) -> Iterator[FloatArray]:
    """(n, 2) m about their middle: where they went in, and where their course would be by now."""
    apart = [member.alone for member in members if member.alone]
    means = np.array([alone.states.mean[0] for alone in apart])
    since = time - max(alone.time for alone in apart)
    offset, velocity = (means[:, k : k + 2] - means[:, k : k + 2].mean(axis=0) for k in (0, 2))
    yield offset
    passing = 2 * np.linalg.norm(offset) / max(float(np.linalg.norm(velocity)), 1e-9)
    if since < _PASSING * passing:
        yield offset + velocity * since
