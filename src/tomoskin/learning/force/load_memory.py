"""What a sheet remembers of its load, as labelled presses show it."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.special import softmax

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.force.curve import ForceCurve
from tomoskin.learning.force.weighed_presses import WeighedPresses
from tomoskin.model.skin import MaterialMemory, MemoryState, load_of

_PARTS, _WIDTHS = (0.2, 0.4), (0.1, 0.2, 0.4)
"""Plays that are averaged over, beside none: parts, and half widths over the usual depth."""

_FAST, _SLOW = (0.0, 0.03, 0.06, 0.12), (0.0, 0.01, 0.02)
_TIMES = (1.0, 10.0, 100.0)
"""Creep that is averaged over: the part that comes within a second, and that of each further decade
of time, s. Materials creep for minutes; presses of a second or two cannot tell how much."""

SHALLOW = 1e-3
"""Depth, over the usual one, below which a touch is not told from none."""

_SMALL = 1e-3
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
    widths = tuple(width * usual for width in _WIDTHS)
    alone = np.eye(len(widths))
    plays = np.vstack([0 * alone[:1], *(part * alone for part in _PARTS)])
    creeps = np.array([(fast, slow, slow) for fast in _FAST for slow in _SLOW])
    tried, evidence = list(product(plays, creeps)), []
    for play, creep in tried:
        memory = _memory(play, widths, creep)
        both = without_memory(memory, depth[:, None] * (1, 1 + _STEP), press, time)
        free, more = np.maximum(both, SHALLOW * usual).T
        slope = np.maximum(more - free, 1e-6 * free) / (_STEP * free)
        curve = ForceCurve.of(terms[rows], free[rows], presses.force[rows])
        evidence.append(curve.evidence + float(np.log(slope[rows]).sum()))
    weight = softmax(evidence).reshape(len(plays), len(creeps))
    return _memory(weight.sum(axis=1) @ plays, widths, weight.sum(axis=0) @ creeps)


def _memory(play: FloatArray, widths: tuple[float, ...], creep: FloatArray) -> MaterialMemory:
    """Of parts ``play`` with ``widths`` and ``creep`` with its times; small parts are left out."""
    plays, creeps = (
        [(part, size) for part, size in zip(parts.tolist(), sizes, strict=True) if part > _SMALL]
        for parts, sizes in ((play, widths), (creep, _TIMES))
    )
    return MaterialMemory(
        play=tuple(part for part, _ in plays),
        play_widths=tuple(width for _, width in plays),
        creep=tuple(part for part, _ in creeps),
        creep_times=tuple(time for _, time in creeps),
    )
