"""Likeness of responses at two places, and a small basis that holds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.prior import pivoted_cholesky

LENGTHS = (0.16, 0.22, 0.32, 0.45, 0.65)
"""Length scales of a response that are tried, in radii of the region."""

_CONSTANT = 0.3
"""Variance of what a map has everywhere, in parts of what varies over the skin."""

_TOLERANCE = 1e-2
"""Part of the prior variance that a basis may leave out."""

_MOST = 300
"""Functions in a basis."""

_ROUNDING = 1e-9


def squared_norms(a: FloatArray) -> FloatArray:
    """(n,) of the rows of ``a`` (n, d)."""
    return np.asarray(np.einsum("nd,nd->n", a, a))


def squared_distances(
    a: FloatArray, b: FloatArray, norms_of_b: FloatArray | None = None
) -> FloatArray:
    """(n, m) squared distances between the rows of ``a`` (n, d) and ``b`` (m, d)."""
    square = squared_norms(a)[:, None] + (squared_norms(b) if norms_of_b is None else norms_of_b)
    return np.asarray(np.maximum(square - 2 * (a @ b.T), 0.0))


def leading(data: FloatArray, count: int, rounding: float = _ROUNDING) -> FloatArray:
    """(k, c) orthonormal directions in which ``data`` (n, k) are largest, ``count`` at most.

    By the smaller of the two Gram matrices; what is ``rounding`` alone is left out.
    """
    n, k = data.shape
    if k <= n:
        return np.asarray(eigh(data.T @ data, subset_by_index=(max(k - count, 0), k - 1))[1])
    size, rows = eigh(data @ data.T, subset_by_index=(max(n - count, 0), n - 1))
    kept = size > rounding * size[-1]
    return np.asarray(data.T @ (rows[:, kept] / np.sqrt(size[kept])))


def nearness(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """(n, m) exp(−d²/2 ``length``²) of the distances d between rows of ``a`` and ``b``."""
    return np.asarray(np.exp(-0.5 * squared_distances(a, b) / length**2))


def climbed(evidence: Callable[[float], float]) -> Likeness:
    """The likeness of the length scale of the largest ``evidence``, climbed to from the middle one
    of :data:`LENGTHS`."""
    of = cache(evidence)
    best = len(LENGTHS) // 2
    while True:
        near = range(max(best - 1, 0), min(best + 2, len(LENGTHS)))
        higher = max(near, key=lambda number: of(LENGTHS[number]))
        if higher == best:
            return Likeness(LENGTHS[best])
        best = higher


def telling(n: int, most: int) -> IntArray:
    """At ``most`` so many of n rows or presses, spread over them, that tell something of all."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).astype(int))


@dataclass(frozen=True)
class Likeness:
    """Prior covariance of a response at two places; ``length`` in the unit of the places."""

    length: float

    def __call__(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """(n, m) for the places ``a`` (n, 2) and ``b`` (m, 2)."""
        return nearness(a, b, self.length) + _CONSTANT

    @property
    def variance(self) -> float:
        """The variance of a response at one place."""
        return 1.0 + _CONSTANT


@dataclass(frozen=True, eq=False)
class Basis:
    """Functions φ with φ(a)·φ(b) = likeness(a, b), up to a hundredth of the variance.

    They stand on presses chosen by pivoted Cholesky (Harbrecht, Peters & Schneider 2012), so
    that their number follows the length scale and not the number of presses.
    """

    likeness: Likeness
    centres: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, likeness: Likeness, positions: FloatArray, most: int = _MOST) -> Self:
        """Basis of at ``most`` so many functions for responses at ``positions`` (n, 2)."""
        variance = np.full(len(positions), likeness.variance)
        pivots = pivoted_cholesky(
            lambda i: likeness(positions, positions[i : i + 1])[:, 0],
            variance,
            _TOLERANCE * likeness.variance,
            most,
        )[1]
        centres = positions[pivots]
        values, vectors = eigh(likeness(centres, centres))
        keep = values > _ROUNDING * values[-1]
        return cls(likeness, centres, vectors[:, keep] / np.sqrt(values[keep]))

    def __call__(self, positions: FloatArray) -> FloatArray:
        """(n, m) values of the functions at ``positions`` (n, 2)."""
        return np.asarray(self.likeness(positions, self.centres) @ self.root)


def moments(probability: FloatArray, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (n, 2) and covariance (n, 2, 2) of ``probability`` (n, g) on ``grid`` (g, 2)."""
    mean = probability @ grid
    pairs = (grid[:, :, None] * grid[:, None, :]).reshape(-1, 4)
    second = (probability @ pairs).reshape(-1, 2, 2)
    return mean, second - mean[:, :, None] * mean[:, None, :]


_HOLDS = 0.9


def nine_in_ten(values: FloatArray) -> float:
    """What nine in ten values to come, as ``values`` (n,) are, keep to (split-conformal: Vovk,
    Gammerman & Shafer 2005)."""
    return float(np.quantile(values, min(1.0, _HOLDS * (1 + 1 / len(values)))))


_PRIOR = {"amplitude": (-2.0, 2.0), "length": (0.3, 1.0), "noise": (-3.5, 2.0)}
"""Mean and deviation of the logarithm of each hyper-parameter."""

_LEARNT_ON = 300
"""Presses from which hyper-parameters are learnt; all of them make the answer."""

_NOISE_FLOOR = 1e-6
_STEPS = 40
_FAILED = 1e10

Distances = Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Process:
    """A sum of products of squared-exponential kernels, one for each named block of inputs.

    ``terms`` names the blocks of each product; ``logs`` holds, term by term, the logarithm of
    the amplitude and of the lengths, and last that of the noise. Targets count about ``centre``
    (q,) in units of ``scale``; ``weights`` (n, q) is (K + noise)⁻¹ of them, by the Cholesky
    ``factor``. ``left_out`` (n, q) is what each press would be told without itself (Rasmussen &
    Williams 2006, 5.12), ``missed`` (n, q) by how many of its own deviations that is off.
    """

    terms: tuple[tuple[str, ...], ...]
    logs: FloatArray
    centre: FloatArray
    scale: float
    factor: tuple[FloatArray, bool]
    weights: FloatArray
    left_out: FloatArray
    missed: FloatArray

    @classmethod
    def of(cls, terms: Sequence[tuple[str, ...]], squares: Distances, targets: FloatArray) -> Self:
        """Fit ``targets`` (n, q) from squared distances (n, n) of each block."""
        n, centre = len(targets), targets.mean(axis=0)
        scale = float((targets - centre).std()) or 1.0
        targets = (targets - centre) / scale
        chosen = telling(n, _LEARNT_ON)
        few = {name: square[np.ix_(chosen, chosen)] for name, square in squares.items()}
        logs = _learn(terms, few, targets[chosen])
        kernel = _kernel(terms, logs, squares)
        kernel[np.diag_indices(n)] += _noise(logs)
        factor = cho_factor(kernel, lower=True, overwrite_a=True, check_finite=False)
        weights = cho_solve(factor, targets, check_finite=False)
        own = np.diag(dpotri(factor[0], lower=1, overwrite_c=0)[0])
        left_out = centre + scale * (targets - weights / own[:, None])
        missed = weights / np.sqrt(own)[:, None]
        return cls(tuple(terms), logs, centre, scale, factor, weights, left_out, missed)

    def __call__(self, squares: Distances) -> FloatArray:
        """(m, q) answers for frames at squared distances (m, n) from the presses."""
        return np.asarray(self.centre + self.scale * (self._cross(squares) @ self.weights))

    def deviation(self, squares: Distances) -> FloatArray:
        """(m,) of what a target of such frames may be about the answer, its noise included."""
        cross = self._cross(squares)
        known = (cross * cho_solve(self.factor, cross.T).T).sum(axis=1)
        firsts = np.cumsum([0, *(1 + len(term) for term in self.terms)])[:-1]
        prior = float(np.exp(self.logs[firsts]).sum())
        return np.asarray(self.scale * np.sqrt(np.maximum(prior - known, 0.0) + _noise(self.logs)))

    def _cross(self, squares: Distances) -> FloatArray:
        """(m, n) prior covariance of inputs at squared distances (m, n), without noise."""
        return _kernel(self.terms, self.logs, squares)


def _noise(logs: FloatArray) -> float:
    return float(np.exp(logs[-1])) + _NOISE_FLOOR


def _products(
    terms: Sequence[tuple[str, ...]], logs: FloatArray, squares: Distances
) -> list[tuple[FloatArray, list[tuple[int, FloatArray]]]]:
    """Each term's kernel, and the index of each of its lengths with its scaled distances."""
    products, at = [], 0
    for term in terms:
        amplitude, lengths = np.exp(logs[at]), logs[at + 1 : at + 1 + len(term)]
        parts = [np.exp(-2 * x) * squares[name] for x, name in zip(lengths, term, strict=True)]
        kernel = amplitude * np.exp(-0.5 * sum(parts[1:], parts[0]))
        products.append((kernel, [(at + 1 + i, part) for i, part in enumerate(parts)]))
        at += 1 + len(term)
    return products


def _kernel(terms: Sequence[tuple[str, ...]], logs: FloatArray, squares: Distances) -> FloatArray:
    kernels = [kernel for kernel, _ in _products(terms, logs, squares)]
    return np.asarray(sum(kernels[1:], kernels[0]))


def _learn(terms: Sequence[tuple[str, ...]], squares: Distances, targets: FloatArray) -> FloatArray:
    kinds = [kind for term in terms for kind in ("amplitude", *("length" for _ in term))]
    prior = np.array([_PRIOR[kind] for kind in (*kinds, "noise")])

    def cost(logs: FloatArray) -> tuple[float, FloatArray]:
        value, slope = _cost(terms, logs, squares, targets)
        away = (logs - prior[:, 0]) / prior[:, 1]
        return value + 0.5 * float(away @ away), slope + away / prior[:, 1]

    bounds = [(m - 4 * s, m + 4 * s) for m, s in prior]
    optimum = minimize(
        cost, prior[:, 0], jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": _STEPS}
    )
    return np.asarray(optimum.x)


def _cost(
    terms: Sequence[tuple[str, ...]], logs: FloatArray, squares: Distances, targets: FloatArray
) -> tuple[float, FloatArray]:
    """Negative log marginal likelihood and its slope (Rasmussen & Williams 2006, 5.9)."""
    products = _products(terms, logs, squares)
    n, q = targets.shape
    kernel = sum((kernel for kernel, _ in products[1:]), products[0][0].copy())
    kernel[np.diag_indices(n)] += _noise(logs)
    slope = np.zeros(len(logs))
    try:
        factor = cho_factor(kernel, lower=True, check_finite=False)
    except LinAlgError:
        return _FAILED, slope
    weights = cho_solve(factor, targets, check_finite=False)
    pull = q * cho_solve(factor, np.eye(n), check_finite=False) - weights @ weights.T
    for product, parts in products:
        pulled = pull * product
        slope[parts[0][0] - 1] = 0.5 * pulled.sum()
        for index, part in parts:
            slope[index] = 0.5 * float((pulled * part).sum())
    slope[-1] = 0.5 * float(np.trace(pull)) * np.exp(logs[-1])
    value = 0.5 * float((targets * weights).sum()) + q * float(np.log(np.diag(factor[0])).sum())
    return value, slope
