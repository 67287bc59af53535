"""Additive responses under Gaussian noise: which combination does a frame show?

x = m + Σ b_k t_k + e, with e ~ N(0, S): what each flag adds is a template, the combinations b are
those of the codes. For states of which one holds this is linear discriminant analysis. Without
labels the combinations are hidden and the templates follow by expectation maximisation
(Dempster, Laird & Rubin 1977), from those of another session as the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from tomoskin.core import FloatArray, IntArray

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
        left = x - middle[group] - design @ effect
        templates = np.vstack([middle[-1] - share[-1] @ effect, effect])
        return cls(table, templates, shrunk(left))

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

    def adapted(self, x: FloatArray, known: IntArray) -> Self:
        """Fitted to frames x (n, d), with this mixture as the prior.

        ``known`` (n,) is the combination of a frame, −1 where it is not known.
        """
        mixture, before = self, np.zeros((len(x), len(self.table)))
        for _ in range(_ROUNDS):
            weights = posterior(mixture.distances(x))
            weights[known >= 0] = np.eye(len(self.table))[known[known >= 0]]
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
        means, left = codes @ templates, x - weights @ (codes @ templates)
        mixed = weights @ means
        unsure = means.T @ (means * count[:, None]) - mixed.T @ mixed
        covariance = (left.T @ left + unsure + d * self.covariance) / (n + d)
        return type(self)(self.table, templates, covariance)


def posterior(distances: FloatArray, sharpness: float = 1.0) -> FloatArray:
    """(n, k) probability of each combination, all as likely beforehand."""
    weights = np.exp(-0.5 * sharpness * (distances - distances.min(axis=1, keepdims=True)))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def shrunk(left: FloatArray) -> FloatArray:
    """(d, d) covariance of residuals (n, d), drawn to a sphere (Ledoit & Wolf 2004)."""
    n, d = left.shape
    raw = left.T @ left / n
    size = max(np.trace(raw) / d, 1e-12)
    away = ((raw - size * np.eye(d)) ** 2).sum()
    noise = (((left**2).sum(axis=1) ** 2).sum() / n - (raw**2).sum()) / n
    part = float(np.clip(noise / away, 0.01, 1.0)) if away > 0 else 1.0
    return np.asarray((1 - part) * raw + part * size * np.eye(d))


def entropy(weights: NDArray[np.float64]) -> FloatArray:
    """(n,) nat, how open it is which combination a frame shows."""
    return np.asarray(-(weights * np.log(np.maximum(weights, 1e-300))).sum(axis=1))
