"""The spectrum of a linear problem: every alpha from one decomposition."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, qr, solve_triangular

from tomoskin.core import FloatArray, ModelError, check_positive, finished
from tomoskin.imaging.linear.linear_problem import LinearProblem
from tomoskin.imaging.linear.operator import Operator

_ROUNDING = 1e-14
"""An eigenvalue below this part of the largest is rounding (a reciprocal row, for one)."""

_UNSEEN = 1e-12
"""Data of a free image below this part of what they could be at most are rounding."""

_SPAN = (1e-5, 10.0)
"""Alphas worth looking at, in parts of the largest singular value."""

_PER_DECADE = 40


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Modes of W^½JQ⁻¹JᴴW^½ = U diag(λ) Uᴴ: data and images that go with each other.

    Data dv have coefficients β = UᴴW^½dv; the image is Σ bᵢ gᵢ βᵢ with gᵢ = 1/(λᵢ + α²). So a
    new alpha costs one product, and its noise next to nothing. The
    images that Q does not weigh are modes of their own, with λ = ∞ and g = 1 (the standard form
    of Eldén 1982); the others are orthogonal to what the data tell of these.

    Attributes
    ----------
    problem
        What was decomposed.
    values
        (n_meas,) λ in descending order, ∞ for the images that cost nothing.
    analysis
        (n_meas, n_meas) UᴴW^½: difference data → β.
    modes
        (n_cells, n_meas) b, the image of each mode.
    """

    problem: LinearProblem
    values: FloatArray
    analysis: NDArray[Any]
    modes: NDArray[Any]

    @classmethod
    def of(cls, problem: LinearProblem) -> Self:
        """Decompose ``problem``.

        Raises
        ------
        ModelError
            When the data do not see an image that the prior leaves free.
        """
        root = np.sqrt(problem.weights)
        spread, gram = problem.carried
        system = root[:, None] * gram * root
        free = problem.prior.free
        k = free.shape[1]
        if not k:
            values, u = _eigen(system)
            return cls(problem, values, u.conj().T * root, (spread * root) @ u)
        basis, rest, upper = _free_part(root[:, None] * problem.jacobian, free)
        values, inner = _eigen(rest.conj().T @ system @ rest)
        u = rest @ inner
        fitted = solve_triangular(upper, basis.conj().T @ system @ u)
        cheap = solve_triangular(upper, np.eye(k))
        return cls(
            problem,
            np.concatenate([np.full(k, np.inf), values]),
            np.hstack([basis, u]).conj().T * root,
            np.hstack([free @ cheap, (spread * root) @ u - free @ fitted]),
        )

    @cached_property
    def singular_values(self) -> FloatArray:
        """σ = √λ of the modes that the prior weighs, none of mere rounding, in descending order."""
        values = self.values[np.isfinite(self.values)]
        return np.asarray(np.sqrt(values[values > _ROUNDING * values.max()]))

    @property
    def condition(self) -> float:
        """Largest singular value over the smallest."""
        return float(self.singular_values[0] / self.singular_values[-1])

    @property
    def alphas(self) -> FloatArray:
        """Fine grid of the alphas worth looking at, ascending."""
        low, high = np.multiply(_SPAN, self.singular_values[0])
        count = 1 + round(_PER_DECADE * np.log10(high / low))
        return np.asarray(np.geomspace(low, high, count))

    def gains(self, alpha: float) -> FloatArray:
        """(n_meas,) g, by which each coefficient enters the image.

        Raises ModelError when alpha is not above 0.
        """
        check_positive(alpha, "alpha")
        weighed = np.isfinite(self.values)
        return np.where(weighed, 1.0 / (np.where(weighed, self.values, 0.0) + alpha**2), 1.0)

    def filters(self, alpha: float) -> FloatArray:
        """(n_meas,) filter factors λ/(λ + α²): the part of each coefficient that is believed."""
        return 1.0 - np.where(np.isfinite(self.values), alpha**2 * self.gains(alpha), 0.0)

    def operator(self, alpha: float) -> Operator:
        """The operator of ``alpha``, the same as ``problem.operator(alpha)``, by one product."""
        return finished(self.operator_in_pieces(alpha, len(self.modes)))

    def operator_in_pieces(self, alpha: float, rows: int) -> Generator[None, None, Operator]:
        """Make the operator of ``alpha``, so many of its rows at a time."""
        filtered = self.gains(alpha)[:, None] * self.analysis
        matrix = np.empty_like(self.modes)
        for start in range(0, len(matrix), rows):
            piece = slice(start, start + rows)
            np.matmul(self.modes[piece], filtered, out=matrix[piece])
            yield
        weighed = np.isfinite(self.values)
        precision = self.analysis[weighed].conj().T @ filtered[weighed]
        return self.problem.operator_of(matrix, precision)

    def coefficients(self, dv: NDArray[Any]) -> NDArray[Any]:
        """(…, n_meas) β of difference data (…, n_meas)."""
        return np.asarray(dv @ self.analysis.T)

    def noise_coefficients(self, noise: FloatArray) -> NDArray[Any]:
        """(n_meas, n_meas) covariance of β for independent ``noise`` (n_meas,) of the data."""
        spread = self.analysis * noise
        return np.asarray(spread @ spread.conj().T)

    def energies(self, alphas: FloatArray, covariance: NDArray[Any]) -> FloatArray:
        """(k,) expected ∫x² over the sheet, for coefficients of that covariance."""
        gains = np.array([self.gains(float(a)) for a in alphas])
        shared = np.real(self.overlap * covariance.T)
        return np.asarray(np.einsum("am,am->a", gains @ shared, gains))

    @cached_property
    def overlap(self) -> NDArray[Any]:
        """(n_meas, n_meas) ∫bᵢ*bⱼ over the sheet."""
        volumes = self.problem.model.mesh.volumes
        return np.asarray((self.modes.conj().T * volumes) @ self.modes)


def _eigen(system: NDArray[Any]) -> tuple[FloatArray, NDArray[Any]]:
    values, vectors = eigh(system, check_finite=False)
    return np.maximum(values[::-1], 0.0), vectors[:, ::-1]


def _free_part(
    jacobian: NDArray[Any], free: FloatArray
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """What the data see of the free images N: JN = QR, with the rest of the data's space."""
    k = free.shape[1]
    basis, upper = qr(jacobian @ free)
    least = np.abs(np.diag(upper)).min()
    if least <= _UNSEEN * np.linalg.norm(jacobian) * np.linalg.norm(free):
        raise ModelError(
            "the data do not determine an image that the prior leaves free",
            hint="choose another prior, or a pattern that is sensitive to the whole mesh",
        )
    return basis[:, :k], basis[:, k:], upper[:k]
