"""Classes as a mixture of Gaussians in the subspace that tells them apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.classes.examples import Examples
from tomoskin.learning.touch.gaussian_process import leading

_MOST = 20
"""Directions: eight electrodes have n(n − 3)/2 = 20 independent readings."""

_FRAMES_EACH = 4
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
    def of(cls, table: FloatArray, x: FloatArray, flags: FloatArray, group: IntArray) -> Self:
        """From labelled frames x (n, d), flags (n, f), each of a group with a mean of its own.

        m is that of the last group.
        """
        middle = np.stack([x[group == g].mean(axis=0) for g in range(group.max() + 1)])
        share = np.stack([flags[group == g].mean(axis=0) for g in range(group.max() + 1)])
        design = flags - share[group]
        effect = np.linalg.lstsq(design, x - middle[group], rcond=None)[0]
        residual = x - middle[group] - design @ effect
        templates = np.vstack([middle[-1] - share[-1] @ effect, effect])
        return cls(table, templates, shrunk(residual))

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


def shrunk(residual: FloatArray) -> FloatArray:
    """(d, d) covariance of residuals (n, d), drawn to a sphere (Ledoit & Wolf 2004)."""
    n, d = residual.shape
    raw = residual.T @ residual / n
    size = max(np.trace(raw) / d, 1e-12)
    away = ((raw - size * np.eye(d)) ** 2).sum()
    noise = (((residual**2).sum(axis=1) ** 2).sum() / n - (raw**2).sum()) / n
    part = float(np.clip(noise / away, 0.01, 1.0)) if away > 0 else 1.0
    return np.asarray((1 - part) * raw + part * size * np.eye(d))
