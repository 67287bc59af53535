"""Force or depth of a touch from how much it changes the sheet: a curve, how sure it is, and what
the sheet remembers of its load.

A touch of content c (how much conductivity it takes away in all) stands for a depth u = c/r̄², r̄ the
usual radius. With F the force, or how far the tip has moved,

    log u = φ(position, radius)·β + p log F/(F + F₀) + noise.

What position and radius do is linear in β with a normal prior; p, F₀ and the noise are averaged,
each by its evidence (MacKay 2003, chapter 28). F is then read from the curve with a prior on
log F: where the curve is flat a touch says little of its force, and the interval says so. A force
has p = 1, since the soft layer under the sheet is squeezed solid in the end; a depth bends the
curve by p alone (:class:`~.measurand.Measurand`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import softmax

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.amount.measurand import LabelledPresses, Measurand
from tomoskin.model.skin import MaterialMemory, MemoryState, load_of

_NOISE = np.geomspace(0.01, 0.6, 9)
"""Deviations of log u about the curve."""

_LEVEL, _SLOPE, _RADIUS, _OUTWARD = 3.0, 0.3, 0.7, 1.0
"""Prior deviations of β: of the level, of each term of the position, of log radius, and of how that
changes towards the rim. Noise moves radius and depth together, in the middle less than outside."""

_WIDER = 1.25
"""The prior of log F is so many times as wide as the labels are."""

_LEAST_WIDTH = 0.5
_COUNTS = 3e-3
_AMOUNTS = 161
_BEYOND = 4.0
_LEVELS = np.array([0.5, 0.05, 0.95])
"""The median, and what nine in ten lie between."""


def basis(xy: FloatArray, radius: FloatArray, unit: float) -> FloatArray:
    """(n, 6) terms of a touch at ``xy`` (n, 2) over ``unit`` m, of log ``radius`` (n,) beside the
    usual."""
    terms = np.empty((len(xy), 6))
    x, y = terms[:, 1:3].T
    np.divide(xy, unit, out=terms[:, 1:3])
    terms[:, 0] = 1.0
    terms[:, 3] = x * x + y * y - 0.5
    terms[:, 4] = radius
    terms[:, 5] = radius * terms[:, 3]
    return terms


_PRIOR = np.array([_LEVEL, _SLOPE, _SLOPE, _SLOPE, _RADIUS, _OUTWARD]) ** 2


@dataclass(frozen=True, eq=False)
class AmountCurve:
    """The curve as labelled touches tell it.

    Attributes
    ----------
    half, bend, noise
        (g,) F₀ in SI, p and deviation of log u, of each member of the average.
    weight
        (g,) of each, 1 together.
    mean, covariance
        (g, 6), (g, 6, 6) of β.
    evidence
        Log marginal likelihood of the labelled touches.
    log_amount
        Mean and deviation of the prior of log F.
    """

    half: FloatArray
    bend: FloatArray
    noise: FloatArray
    weight: FloatArray
    mean: FloatArray
    covariance: FloatArray
    evidence: float
    log_amount: tuple[float, float]

    @classmethod
    def of(
        cls, of: Measurand, terms: FloatArray, depth: FloatArray, amount: FloatArray
    ) -> AmountCurve:
        """Learn from ``terms`` (n, 6), ``depth`` u (n,) and ``amount`` (n,) SI, all above 0."""
        bend, half = np.array(list(product(of.bends, of.halves))).T
        half = half * float(np.median(amount))
        level = np.log(depth)[:, None] - bend * np.log(amount[:, None] / (amount[:, None] + half))
        members = [_members(terms, level, noise) for noise in _NOISE]
        mean = np.concatenate([member[0] for member in members])
        evidence = np.concatenate([member[2] for member in members])
        weight = np.exp(evidence - evidence.max())
        total = float(evidence.max() + np.log(weight.mean()))
        weight /= weight.sum()
        counts = weight > _COUNTS * weight.max()
        logs = np.log(amount)
        width = max(_WIDER * float(logs.std()), _LEAST_WIDTH)
        return cls(
            half=np.tile(half, len(_NOISE))[counts],
            bend=np.tile(bend, len(_NOISE))[counts],
            noise=np.repeat(_NOISE, len(half))[counts],
            weight=weight[counts] / weight[counts].sum(),
            mean=mean[counts],
            covariance=np.repeat([member[1] for member in members], len(half), axis=0)[counts],
            evidence=total,
            log_amount=(float(logs.mean()), width),
        )

    def posterior(
        self, terms: FloatArray, depth: FloatArray, sd: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Grid (f,) of log F, and (n, f) probabilities on it.

        Parameters
        ----------
        terms, depth, sd
            (n, 6); u (n,); its relative deviation (n,) beyond the labelled touches'.
        """
        grid, prior, curves = self._tabulated
        level = terms @ self.mean.T
        variance = ((terms @ self.covariance) * terms).sum(axis=2).T
        variance += self.noise**2 + sd[:, None] ** 2
        away = (np.log(depth)[:, None] - level)[:, :, None] - curves
        away *= away
        away *= -0.5 / variance[:, :, None]
        weight = self.weight / np.sqrt(variance)
        likely = (weight[:, None] @ np.exp(away, out=away))[:, 0]
        chance = np.maximum(likely, 1e-300) * prior
        return grid, chance / chance.sum(axis=1, keepdims=True)

    @cached_property
    def _tabulated(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Grid (f,) of log F, its prior (f,), and p log F/(F + F₀) of each member (g, f)."""
        middle, width = self.log_amount
        steps = np.linspace(-_BEYOND, _BEYOND, _AMOUNTS)
        amount = np.exp(middle + width * steps)
        curves = self.bend[:, None] * np.log(amount / (amount + self.half[:, None]))
        return middle + width * steps, np.exp(-0.5 * steps**2), curves

    def log_amounts(self, terms: FloatArray, depth: FloatArray, sd: FloatArray) -> FloatArray:
        """(n, 3): median, 5 % and 95 % point of log F, F in SI; see :meth:`posterior`."""
        grid, chance = self.posterior(terms, depth, sd)
        below = np.cumsum(chance, axis=1)
        below -= 0.5 * chance
        return np.array([np.interp(_LEVELS, row, grid) for row in below])


def _members(
    terms: FloatArray, level: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means (h, 6) and one covariance (6, 6) of β where each column of ``level`` (n, h) is
    ``terms`` β + noise; evidence (h,)."""
    n = len(level)
    carried = terms * _PRIOR
    factor = cho_factor(carried @ terms.T + noise**2 * np.eye(n), lower=True)
    solved = cho_solve(factor, level)
    covariance = np.diag(_PRIOR) - carried.T @ cho_solve(factor, carried)
    size = 2 * float(np.log(np.diag(factor[0])).sum())
    return solved.T @ carried, covariance, -0.5 * ((level * solved).sum(axis=0) + size)


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
    presses: LabelledPresses, depth: FloatArray, usual: float, terms: FloatArray
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
        curve = AmountCurve.of(presses.of_what, terms[rows], free[rows], presses.amount[rows])
        evidence.append(curve.evidence + float(np.log(slope[rows]).sum()))
    weight = softmax(evidence).reshape(len(plays), len(creeps))
    return _memory(weight.sum(axis=1) @ plays, widths, weight.sum(axis=0) @ creeps)


def _memory(play: FloatArray, widths: tuple[float, ...], creep: FloatArray) -> MaterialMemory:
    """Of parts ``play`` with ``widths`` and ``creep`` with its times; small parts are left out."""
    kept: list[tuple[float, ...]] = []
    for parts, sizes in ((play, np.array(widths)), (creep, np.array(_TIMES))):
        kept += [tuple(column[parts > _SMALL].tolist()) for column in (parts, sizes)]
    return MaterialMemory(*kept)
