"""Response maps: likeness among measurements, and what each answers to a press anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy.linalg import eigh

from tomoskin.core import FloatArray
from tomoskin.learning.touch.gaussian_process import Basis, Likeness, leading

_PSEUDO_ROWS = 60.0
"""Weight of the prior of both covariances, which is their own diagonal."""

_SIGNAL_AT_FIRST = 0.7
_ITERATIONS = 8
"""Of the expectation maximisation: thirty locate no better on noPattern, radial, cam09_05 and the 8
electrodes of eskin_hydrogel_round."""

_FLOOR = 1e-6


@dataclass(frozen=True, eq=False)
class Projected:
    """Presses in coordinates in which a response's prior is diagonal.

    ``weights`` (m,) prior variance of each coordinate; ``rows`` (m, k) the features there;
    ``rest`` (k, k) scatter of the ``n_rest`` coordinates that hold noise only.
    """

    weights: FloatArray
    rows: FloatArray
    rest: FloatArray
    n_rest: int

    @property
    def n(self) -> int:
        """The number of presses, those at rest included."""
        return len(self.weights) + self.n_rest


@dataclass(frozen=True, eq=False)
class Coregion:
    """Signal A = S Q diag(gain) Qᵀ S and noise S with QᵀSQ = 1: a feature's Q coordinates are
    independent, with noise of variance 1 and signal of variance ``gain`` (k,).

    ``evidence`` is the log marginal likelihood of the presses, up to a constant.
    """

    gain: FloatArray
    whiten: FloatArray
    evidence: float

    @classmethod
    def of(cls, data: Projected) -> Self:
        """Fit A and S by expectation maximisation.

        Row j of the data is Gaussian with covariance weights[j] A + S (the linear model of
        coregionalisation, Bonilla, Chai & Williams 2008). The eigenvectors of (A, S) make the
        expectation diagonal (as in Rakitsch et al. 2013); an inverse-Wishart prior draws both
        covariances to their diagonals.
        """
        m, k = data.rows.shape
        total = ((data.rows**2).sum(axis=0) + np.diag(data.rest)) / data.n
        total = total + _FLOOR * total.mean()
        signal = np.diag(_SIGNAL_AT_FIRST * total * data.n / data.weights.sum())
        noise = np.diag((1 - _SIGNAL_AT_FIRST) * total)
        for _ in range(_ITERATIONS):
            gain, q = _modes(signal, noise)
            rows = data.rows @ q
            ratio = data.weights[:, None] * gain
            part = ratio / (1 + ratio)
            inside, outside = part * rows, rows - part * rows
            weighed = part / data.weights[:, None]
            back = noise @ q
            signal = _back(back, (inside / data.weights[:, None]).T @ inside, weighed.sum(axis=0))
            noise = _back(back, outside.T @ outside, part.sum(axis=0)) + data.rest
            signal, noise = _shrunk(signal, m), _shrunk(noise, data.n)
            noise[np.diag_indices(k)] += _FLOOR * np.diag(noise).mean()
        gain, q = _modes(signal, noise)
        return cls(gain, q, _evidence(data, gain, q))


def _modes(signal: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    gain, q = eigh(signal, noise)
    return np.maximum(gain, 0.0), q


def _evidence(data: Projected, gain: FloatArray, q: FloatArray) -> float:
    rows, ratio = data.rows @ q, 1 + data.weights[:, None] * gain
    quadratic = (np.log(ratio) + rows**2 / ratio).sum() + (q * (data.rest @ q)).sum()
    return float(data.n * np.linalg.slogdet(q)[1] - 0.5 * quadratic)


def _back(back: FloatArray, scatter: FloatArray, variance: FloatArray) -> FloatArray:
    return np.asarray(back @ (scatter + np.diag(variance)) @ back.T)


def _shrunk(scatter: FloatArray, n: int) -> FloatArray:
    target = _PSEUDO_ROWS * np.diag(np.diag(scatter)) / n
    return np.asarray((scatter + target) / (n + _PSEUDO_ROWS))


_ROUNDING = 1e-9

_MANY, _DIRECTIONS = 256, 128
"""Of more features than that, maps and noise are learnt in so many directions: the work grows
with their cube."""


def principal(features: FloatArray) -> FloatArray:
    """(k, d) orthonormal directions of the largest variance of features (n, k); all where they
    are few."""
    n, k = features.shape
    if k <= _MANY:
        return np.eye(k)
    return leading(features - features.mean(axis=0), min(_DIRECTIONS, n - 1))


@dataclass(frozen=True, eq=False)
class ResponseMaps:
    """A matrix-variate Gaussian process from place to features.

    Cov(features) = likeness ⊗ A + 1 ⊗ S: the rows' maps are alike where A says so, and their
    noise is correlated by S. Features count along ``directions`` (k, d) only.
    """

    mean: FloatArray
    directions: FloatArray
    basis: Basis
    data: Projected
    axes: FloatArray
    coregion: Coregion

    @classmethod
    def of(
        cls,
        likeness: Likeness,
        positions: FloatArray,
        features: FloatArray,
        directions: FloatArray,
    ) -> Self:
        """Maps for ``features`` (n, k) of presses at ``positions`` (n, 2)."""
        mean = features.mean(axis=0)
        centred = (features - mean) @ directions
        basis = Basis.of(likeness, positions)
        values = basis(positions)
        weights, axes = np.linalg.eigh(values.T @ values)
        keep = weights > _ROUNDING * weights[-1]
        weights, axes = weights[keep], axes[:, keep]
        rows = (axes / np.sqrt(weights)).T @ (values.T @ centred)
        n_rest = len(positions) - len(weights)
        rest = centred.T @ centred - rows.T @ rows if n_rest else np.zeros(2 * (centred.shape[1],))
        data = Projected(weights, rows, rest, n_rest)
        return cls(mean, directions, basis, data, axes, Coregion.of(data))

    @property
    def evidence(self) -> float:
        """Log marginal likelihood, up to a constant of the features."""
        return self.coregion.evidence

    def whitened(self, features: FloatArray) -> FloatArray:
        """(n, d) coordinates in which the noise is independent with variance 1."""
        return np.asarray((features - self.mean) @ self.whiten)

    def at(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (n, d), of the whitened features of a press at ``positions``."""
        at = self.basis(positions) @ self.axes
        mean_of, variance_of = self._solved
        gain = self.coregion.gain
        remaining = self.basis.likeness.variance * gain - (at**2) @ variance_of
        return at @ mean_of, 1.0 + np.maximum(remaining, 0.0)

    def features_at(self, positions: FloatArray) -> FloatArray:
        """(n, k) features that are expected of presses at ``positions`` (n, 2)."""
        return np.asarray(self.at(positions)[0] @ self._unwhiten + self.mean)

    @cached_property
    def whiten(self) -> FloatArray:
        """(k, d) what takes features to :meth:`whitened` ones."""
        return np.asarray(self.directions @ self.coregion.whiten)

    @cached_property
    def _unwhiten(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.coregion.whiten) @ self.directions.T)

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray]:
        """What takes a basis function to the mean, and its square to the known variance."""
        weights, gain = self.data.weights[:, None], self.coregion.gain
        posterior = gain / (1 + weights * gain)
        rows = self.data.rows @ self.coregion.whiten
        return np.sqrt(weights) * posterior * rows, weights * gain * posterior
