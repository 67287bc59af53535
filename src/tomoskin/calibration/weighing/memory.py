"""What a sheet remembers of its load, as labelled presses show it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy.special import softmax

from tomoskin.calibration.weighing.curve import ForceCurve
from tomoskin.calibration.weighing.presses import WeighedPresses
from tomoskin.core import FloatArray, IntArray
from tomoskin.skin import MaterialMemory, MemoryState, load_of

_PARTS, _WIDTHS = (0.2, 0.4), (0.1, 0.2, 0.4)
"""Plays that are averaged over, beside none: parts, and half widths over the usual depth."""

_LATE, _TIMES = (0.1, 0.2), (1.0, 3.0, 10.0)
"""Creep that is averaged over, beside none: parts, and time constants, s."""

SHALLOW = 1e-3
"""Depth, over the usual one, below which a touch is not told from none."""

_WEIGHTLESS = 1e-3
"""A part below this one of the whole response is left out."""

_STEP = 1e-3


def without_memory(
    memory: MaterialMemory, depth: FloatArray, press: IntArray, time: FloatArray
) -> FloatArray:
    """(n, k) depths that touches of ``depth`` (n, k) would have had without their past, press by
    press; each column by itself."""
    free = np.array(depth)
    for number in np.unique(press):
        rows = np.flatnonzero(press == number)
        state = MemoryState.fresh(memory, depth.shape[1])
        before = time[rows[0]]
        for row in rows.tolist():
            free[row], state = load_of(state, memory, depth[row], time[row] - before)
            before = time[row]
    return free


def averaged_memory(
    presses: WeighedPresses, depth: FloatArray, usual: float, terms: FloatArray
) -> MaterialMemory:
    """The mean of several memories, each with the evidence of the labels as its weight.

    A response is linear in the parts, so that the mean of memories is a memory.
    """
    rows, press, time = presses.labelled, presses.press, presses.time
    plays = [(), *product(_PARTS, [width * usual for width in _WIDTHS])]
    creeps = [(), *product(_LATE, _TIMES)]
    tried, evidence = list(product(plays, creeps)), []
    for play, creep in tried:
        memory = MaterialMemory(
            play=play[:1], play_widths=play[1:], creep=creep[:1], creep_times=creep[1:]
        )
        both = without_memory(memory, depth[:, None] * (1, 1 + _STEP), press, time)
        free, more = np.maximum(both, SHALLOW * usual).T
        slope = np.maximum(more - free, 1e-6 * free) / (_STEP * free)
        curve = ForceCurve.of(terms[rows], free[rows], presses.force[rows])
        evidence.append(curve.evidence + float(np.log(slope[rows]).sum()))
    weight = softmax(evidence)
    play, play_widths = _mean_parts([play for play, _ in tried], weight)
    creep, creep_times = _mean_parts([creep for _, creep in tried], weight)
    return MaterialMemory(play, play_widths, creep, creep_times)


def _mean_parts(
    pairs: Sequence[tuple[float, ...]], weight: FloatArray
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Mean parts by size, and the sizes, of ``pairs`` of a part and its size, or of nothing."""
    parts: dict[float, float] = {}
    for pair, share in zip(pairs, weight.tolist(), strict=True):
        if pair:
            parts[pair[1]] = parts.get(pair[1], 0.0) + share * pair[0]
    counts = {size: part for size, part in parts.items() if part > _WEIGHTLESS}
    return tuple(counts.values()), tuple(counts)
