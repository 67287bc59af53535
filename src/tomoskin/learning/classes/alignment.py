"""A mixture taken over to another session, and whether that can be believed.

Frames without labels show the combinations, but not their names: names are carried over by the
likeness of the templates, which need not hold on another day. What can be checked without labels
is checked here; a few labels settle the names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import bdtr

from tomoskin.core import FloatArray, IntArray
from tomoskin.learning.classes.mixture import Mixture, posterior

_MARGIN = 0.12
"""By how much the names must fit better than the next best ones, in cosines."""

_RELIABLE = 0.5
"""Expected part of the frames that are right, below which nothing is said of any."""

_PRIOR_FRAMES = (1.0, 0.01)
"""Frames that the templates found without labels count as beside the labelled ones, as tried."""

_DRAWS = 3
_BY_CHANCE, _HONEST = 0.05, 0.1
"""Probability below which it is no chance that so few labels agree with a fit, and by how much less
than it expects may be right."""

_LIKELY_SAME = 0.1
"""What the likeness of two templates counts beside labels that agree with each other."""


@dataclass(frozen=True)
class Alignment:
    """How a classifier's newest session, not all of whose frames have a label, was taken over.

    Attributes
    ----------
    holds
        Whether what is said of its frames can be believed.
    reliability
        Expected part of the frames whose combination is right, 0 to 1: what the fit says of them,
        less its optimism.
    grown
        Size of the templates against those learnt before.
    reasons
        What speaks against it, in words.
    """

    holds: bool
    reliability: float
    grown: float
    reasons: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """For people: what was seen, and what would mend it."""
        size = f"changes are {self.grown:.2g} times as large as in the session of the calibration"
        if self.holds:
            part = f"about {100 * self.reliability:.0f} % of its frames should be right"
            return f"the session is aligned: {size}; {part}"
        why = "; ".join(self.reasons)
        return (
            f"the session cannot be aligned: {why}; {size}. Its frames count as unknown: label "
            "ten of them (--ask 10 names the frames), or calibrate again"
        )


def aligned(
    prior: Mixture, x: FloatArray, numbers: IntArray, rest: FloatArray | None
) -> tuple[Mixture, Alignment]:
    """``prior`` fitted to frames x (n, d) of another session.

    ``numbers`` (n,) combination of each frame, −1 where it has no label; ``rest`` (1, d) a frame
    in which no flag is set, None where there is no such thing.
    """
    fitted = _fitted(prior, x, numbers)
    labelled = numbers >= 0
    reliability = _reliability(prior, fitted, x, int(labelled.sum()))
    if labelled.any():
        free = fitted.adapted(x, np.full(len(x), -1))
        reasons = _contradictions(free, x[labelled], numbers[labelled], reliability)
    else:
        reasons = _doubts(prior, fitted, rest)
    if reliability < _RELIABLE:
        reasons = (*reasons, f"only {reliability:.0%} of {len(x)} such frames would be right")
    return fitted, Alignment(not reasons, reliability, _size(fitted) / _size(prior), reasons)


def _fitted(prior: Mixture, x: FloatArray, numbers: IntArray) -> Mixture:
    """``prior`` fitted to frames x (n, d), of which ``numbers`` (n,) names some, −1 the others.

    Labels name what was found without them, and each template is tried as they alone give it, all
    of them with the noise of ``prior`` too: those that have changed much are not found from where
    they were, nor in the noise of a wrong fit. The likeliest of these fits is taken.
    """
    unnamed = prior.moved_to(x).adapted(x, np.full(len(x), -1))
    labelled = numbers >= 0
    if not labelled.any():
        return unnamed
    named = _named(prior, unnamed, x[labelled], numbers[labelled])
    starts = [named, *_from_labels(named, prior, x[labelled], numbers[labelled])]
    fits = [start.adapted(x, numbers) for start in starts]
    return max(fits, key=lambda fit: fit.log_likelihood(x, numbers))


def _from_labels(
    named: Mixture, prior: Mixture, x: FloatArray, numbers: IntArray
) -> Iterator[Mixture]:
    """``named`` with one of its templates, or all, as labelled frames x (n, d) have them."""
    design = named.table[numbers] - named.table[numbers].mean(axis=0)
    if not named.exclusive:
        for name, flag in enumerate(design.T):
            if flag.any():
                others = np.delete(design, name, axis=1) @ np.delete(
                    named.templates[1:], name, axis=0
                )
                residual = x - x.mean(axis=0) - others
                effects = named.templates[1:].copy()
                effects[name] = flag @ residual / (flag @ flag)
                yield named.about(x, numbers, effects)
    for frames in _PRIOR_FRAMES:
        weigh = design.T @ design + frames * np.eye(design.shape[1])
        pull = design.T @ (x - x.mean(axis=0)) + frames * named.templates[1:]
        made = named.about(x, numbers, np.linalg.solve(weigh, pull))
        yield from (made, replace(made, covariance=prior.covariance))


def _doubts(prior: Mixture, fitted: Mixture, rest: FloatArray | None) -> tuple[str, ...]:
    """What speaks against the names of ``fitted``, without labels."""
    doubts = []
    if rest is not None and shows(fitted, rest) != 0:
        doubts.append("an untouched frame would have flags set")
    if len(prior.templates) > 2 and _margin(_cosines(fitted, prior)) < _MARGIN:
        doubts.append("its responses do not distinguish the classes")
    return tuple(doubts)


def shows(mixture: Mixture, frame: FloatArray) -> int:
    """Number of flags that the nearest combination of a frame (1, d) has."""
    return int(mixture.table[mixture.distances(frame)[0].argmin()].sum())


def _effects(mixture: Mixture) -> FloatArray:
    """(f, d) what each flag adds; where one class holds, by how much it is off the mean of all."""
    effects = mixture.templates[1:]
    return effects - effects.mean(axis=0) if mixture.exclusive else effects


def _size(mixture: Mixture) -> float:
    return max(float(np.linalg.norm(_effects(mixture))), 1e-12)


def _cosines(fitted: Mixture, prior: Mixture) -> FloatArray:
    """(f, f) likeness of each fitted template to each earlier one."""
    rows = []
    for effects in (_effects(fitted), _effects(prior)):
        length = np.linalg.norm(effects, axis=1, keepdims=True)
        rows.append(effects / np.maximum(length, 1e-12))
    return np.asarray(rows[0] @ rows[1].T)


def _margin(cosines: FloatArray) -> float:
    """By how much keeping every name fits better than any other naming."""
    kept, worst = float(np.trace(cosines)), np.inf
    for name in range(len(cosines)):
        other = np.abs(cosines)
        other[name, name] = -len(cosines)
        rows, columns = linear_sum_assignment(-other)
        worst = min(worst, kept - float(other[rows, columns].sum()))
    return worst


def _named(prior: Mixture, fitted: Mixture, x: FloatArray, numbers: IntArray) -> Mixture:
    """``fitted`` with the names that labels say: of frames x (n, d), ``numbers`` (n,)."""
    table = fitted.table
    weights, truth = posterior(fitted.distances(x)), table[numbers]
    likely = _LIKELY_SAME * _cosines(fitted, prior)
    if fitted.exclusive:
        agree = (weights @ table).T @ truth / len(x) + likely
        rows, columns = linear_sum_assignment(-agree)
        return fitted.renamed(rows[np.argsort(columns)], np.ones(len(rows)))
    agree = (2 * weights @ table - 1).T @ (2 * truth - 1) / len(x) + likely
    rows, columns = linear_sum_assignment(-np.abs(agree))
    order = rows[np.argsort(columns)]
    return fitted.renamed(order, np.where(agree[order, np.arange(len(order))] < 0, -1.0, 1.0))


def _contradictions(
    free: Mixture, x: FloatArray, numbers: IntArray, reliability: float
) -> tuple[str, ...]:
    """What labels ``numbers`` (n,) of frames x (n, d) say against a fit ``free`` of them that began
    with them: that fewer agree than its ``reliability`` allows."""
    agree = int((free.distances(x).argmin(axis=1) == numbers).sum())
    if bdtr(agree, len(x), reliability - _HONEST) > _BY_CHANCE:
        return ()
    return (f"{len(x) - agree} of {len(x)} labels contradict the other frames",)


def _reliability(prior: Mixture, fitted: Mixture, x: FloatArray, labels: int) -> float:
    """Expected part of frames x (n, d) that are right: what ``fitted`` says, less its optimism.

    That is by how much more is said than is right of sessions that are drawn from ``fitted`` and
    fitted as this one was, with so many ``labels`` (median; parametric bootstrap: Efron &
    Tibshirani 1993, 10.6). Seeds are fixed, so that a file gives the same again.
    """
    root = np.linalg.cholesky(fitted.covariance)
    optimism = []
    for seed in range(_DRAWS):
        rng = np.random.default_rng(seed)
        truth = rng.integers(0, len(fitted.table), len(x))
        drawn = fitted.means[truth] + rng.normal(size=x.shape) @ root.T
        again = _fitted(prior, drawn, np.where(np.arange(len(x)) < labels, truth, -1))
        weights = posterior(again.distances(drawn))[labels:]
        right = weights.argmax(axis=1) == truth[labels:]
        optimism.append(float((weights.max(axis=1) - right).mean()))
    said = float(posterior(fitted.distances(x)).max(axis=1).mean())
    return float(np.clip(said - np.median(optimism), 0.0, 1.0))
