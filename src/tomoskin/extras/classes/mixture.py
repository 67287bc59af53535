"""Classes as a mixture of Gaussians in the subspace that tells them apart; one taken over to
another session, and whether that can be believed.

Frames without labels show the combinations, but not their names: names are carried over by the
likeness of the templates, which need not hold on another day. What can be checked without labels
is checked here; a few labels settle the names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import linear_sum_assignment
from scipy.special import bdtr

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.extras.classes.examples import Examples
from tomoskin.learning import leading

_MOST = 20
"""Directions: eight electrodes have n(n − 3)/2 = 20 independent readings."""

_FRAMES_EACH = 2
"""Frames for each direction."""

_QUIETEST = 0.3
"""A row is never taken for quieter than this part of the median row."""


@dataclass(frozen=True, eq=False)
class Subspace:
    """``middle`` and ``scale`` (n_meas,) of the rows; ``axes`` (n_meas, d) orthonormal.

    ``rest`` is the variance of a row, in its own units, beside those directions.
    """

    middle: FloatArray
    scale: FloatArray
    axes: FloatArray
    rest: float

    @classmethod
    def of(cls, examples: Examples) -> Self:
        """Of frames of all sessions, each about its own mean: what a session adds drops out.

        Raises DataError when no row ever changes.
        """
        scale = _noise(examples)
        middles, parts = [], []
        for number in np.unique(examples.session):
            data = examples.dv[examples.session == number]
            middles.append(session_mean(data))
            parts.append(_filled((data - middles[-1]) / scale))
        stacked = np.vstack(parts)
        d = int(np.clip(len(stacked) // _FRAMES_EACH, 2, min(_MOST, *stacked.shape)))
        axes = leading(stacked, d, 1e-12)
        outside = (stacked**2).sum() - ((stacked @ axes) ** 2).sum()
        free = max(len(stacked) * (stacked.shape[1] - d), 1)
        return cls(middles[-1], scale, axes, max(float(outside / free), 1e-12))

    def whitened(self, dv: FloatArray, middle: FloatArray | None = None) -> FloatArray:
        """(n, n_meas) about a middle, of the newest session by default, in units of noise."""
        return _filled((dv - (self.middle if middle is None else middle)) / self.scale)

    def outside(self, white: FloatArray, inside: FloatArray) -> FloatArray:
        """(n,) mean square of what the directions leave, 1 where it is as in the examples."""
        residual = (white**2).sum(axis=1) - (inside**2).sum(axis=1)
        return np.asarray(residual / (self.rest * max(white.shape[1] - self.axes.shape[1], 1)))


def _noise(examples: Examples) -> FloatArray:
    """(n_meas,) deviation of each row from what its labels explain."""
    total, count = np.zeros(examples.dv.shape[1]), 0
    for number in np.unique(examples.session):
        part = examples.part((examples.session == number) & examples.labelled)
        if len(part) < 2:
            continue
        data = _filled(part.dv - session_mean(part.dv))
        design = part.flags - part.flags.mean(axis=0)
        fitted = design @ np.linalg.lstsq(design, data, rcond=None)[0]
        total += ((data - fitted) ** 2).sum(axis=0)
        count += max(len(part) - np.linalg.matrix_rank(design) - 1, 1)
    deviation = np.sqrt(total / max(count, 1))
    alive = deviation[deviation > 0]
    if not len(alive):
        raise DataError(
            "expected frames that differ from each other, got frames that are all the same"
        )
    return np.asarray(np.maximum(deviation, _QUIETEST * np.median(alive)))


def session_mean(data: FloatArray) -> FloatArray:
    """(n_meas,) mean over the frames that have a value, 0 where none has."""
    finite = np.isfinite(data)
    return np.asarray(np.where(finite, data, 0.0).sum(axis=0) / np.maximum(finite.sum(axis=0), 1))


def _filled(data: FloatArray) -> FloatArray:
    return np.where(np.isfinite(data), data, 0.0)


_TRUST = 2.0
"""Frames that the templates of the other session count as."""

_ROUNDS = 100
_SETTLED = 1e-4


@dataclass(frozen=True, eq=False)
class Mixture:
    """``templates`` (1 + f, d), the first is m; ``covariance`` (d, d); ``table`` (k, f)."""

    table: FloatArray
    templates: FloatArray
    covariance: FloatArray

    @classmethod
    def of(
        cls,
        table: FloatArray,
        x: FloatArray,
        flags: FloatArray,
        group: IntArray,
        covariance: FloatArray | None = None,
    ) -> Self:
        """From labelled frames x (n, d), flags (n, f), each of a group with a mean of its own.

        m is that of the last group. ``covariance`` (d, d) is that of the frames' residuals without
        one.
        """
        middle = np.stack([x[group == g].mean(axis=0) for g in range(group.max() + 1)])
        share = np.stack([flags[group == g].mean(axis=0) for g in range(group.max() + 1)])
        design = flags - share[group]
        effect = np.linalg.lstsq(design, x - middle[group], rcond=None)[0]
        templates = np.vstack([middle[-1] - share[-1] @ effect, effect])
        if covariance is None:
            covariance = shrunk(x - middle[group] - design @ effect)
        return cls(table, templates, covariance)

    @property
    def exclusive(self) -> bool:
        """Whether exactly one name holds in each combination."""
        return len(self.table) == self.table.shape[1] and bool((self.table.sum(axis=1) == 1).all())

    @property
    def means(self) -> FloatArray:
        """(k, d) frame of each combination."""
        return np.asarray(self.templates[0] + self.table @ self.templates[1:])

    def distances(self, x: FloatArray) -> FloatArray:
        """(n, k) squared Mahalanobis distance to each combination."""
        solved = cho_solve(cho_factor(self.covariance, lower=True), self.means.T)
        own = (x * cho_solve(cho_factor(self.covariance, lower=True), x.T).T).sum(axis=1)
        cross = x @ solved
        return np.asarray(own[:, None] - 2 * cross + (self.means.T * solved).sum(axis=0))

    def renamed(self, order: IntArray, sign: FloatArray) -> Self:
        """The same with template ``order[j]`` under the j-th name; where ``sign`` (f,) is −1 the
        flag is set where it was not."""
        effect = sign[:, None] * self.templates[1:][order]
        first = self.templates[0] - effect[sign < 0].sum(axis=0)
        return type(self)(self.table, np.vstack([first, effect]), self.covariance)

    def about(self, x: FloatArray, numbers: IntArray, effects: FloatArray) -> Self:
        """The same with other templates ``effects`` (f, d), about frames x (n, d) of combinations
        ``numbers`` (n,)."""
        first = (x - self.table[numbers] @ effects).mean(axis=0)
        return type(self)(self.table, np.vstack([first, effects]), self.covariance)

    def log_likelihood(self, x: FloatArray, numbers: IntArray) -> float:
        """Of frames x (n, d), up to a constant; ``numbers`` (n,) as in :meth:`adapted`."""
        distances = self.distances(x)
        some = np.flatnonzero(numbers >= 0)
        near = distances.min(axis=1)
        total = -0.5 * near + np.log(np.exp(-0.5 * (distances - near[:, None])).mean(axis=1))
        total[some] = -0.5 * distances[some, numbers[some]] - np.log(len(self.table))
        return float(total.sum() - 0.5 * len(x) * np.linalg.slogdet(self.covariance)[1])

    def moved_to(self, x: FloatArray) -> Self:
        """The same with the mean and size of frames x (n, d) of a session without labels.

        Its combinations are taken to be as mixed as those of ``table``.
        """
        means = self.means - self.means.mean(axis=0)
        mine = np.trace(means.T @ means) / len(means) + np.trace(self.covariance)
        grown = np.sqrt(x.var(axis=0).sum() / mine)
        effect = grown * self.templates[1:]
        first = x.mean(axis=0) - self.table.mean(axis=0) @ effect
        return type(self)(self.table, np.vstack([first, effect]), self.covariance)

    def adapted(self, x: FloatArray, numbers: IntArray) -> Self:
        """Fitted to frames x (n, d), with this mixture as the prior.

        ``numbers`` (n,) is the combination of a frame, −1 where it is not known.
        """
        mixture, before = self, np.zeros((len(x), len(self.table)))
        for _ in range(_ROUNDS):
            weights = posterior(mixture.distances(x))
            weights[numbers >= 0] = np.eye(len(self.table))[numbers[numbers >= 0]]
            mixture = self._renewed(x, weights)
            if np.abs(weights - before).max() < _SETTLED:
                break
            before = weights
        return mixture

    def _renewed(self, x: FloatArray, weights: FloatArray) -> Self:
        """Best templates and covariance where combinations are known by ``weights`` (n, k)."""
        n, d = x.shape
        codes = np.column_stack([np.ones(len(self.table)), self.table])
        count = weights.sum(axis=0)
        prior = np.diag([1e-6] + [_TRUST] * self.table.shape[1])
        normal = codes.T @ (codes * count[:, None]) + prior
        right = codes.T @ (weights.T @ x) + prior @ self.templates
        templates = np.linalg.solve(normal, right)
        means, residual = codes @ templates, x - weights @ (codes @ templates)
        mixed = weights @ means
        unsure = means.T @ (means * count[:, None]) - mixed.T @ mixed
        covariance = (residual.T @ residual + unsure + d * self.covariance) / (n + d)
        return type(self)(self.table, templates, covariance)


def posterior(distances: FloatArray, sharpness: float = 1.0) -> FloatArray:
    """(n, k) probability of each combination, all as likely beforehand."""
    weights = np.exp(-0.5 * sharpness * (distances - distances.min(axis=1, keepdims=True)))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def shrunk(residual: FloatArray, part: float | None = None) -> FloatArray:
    """(d, d) covariance of residuals (n, d), drawn to a sphere by a ``part``; None: by as much as
    is best where they do not depend on each other (Ledoit & Wolf 2004)."""
    n, d = residual.shape
    raw = residual.T @ residual / n
    size = max(np.trace(raw) / d, 1e-12)
    if part is None:
        away = ((raw - size * np.eye(d)) ** 2).sum()
        noise = (((residual**2).sum(axis=1) ** 2).sum() / n - (raw**2).sum()) / n
        part = float(np.clip(noise / away, 0.01, 1.0)) if away > 0 else 1.0
    return np.asarray((1 - part) * raw + part * size * np.eye(d))


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
