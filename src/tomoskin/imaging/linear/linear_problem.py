"""The linear problem that spectrum and choice of alpha start from, and its one-step operator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import DataError, FloatArray, ModelError, check_positive, refuse_first
from tomoskin.imaging.linear.operator import Operator
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import Carried, Penalty, PriorLike, penalty_of

_ZERO = 1e-9
"""A voltage below this part of the largest is zero by symmetry, and its value is rounding."""

_ILL_CONDITIONED = 1e12
"""Above this condition number a product with the inverse has lost digits worth getting back."""


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """Minimise ‖Jx − dv‖²_W + α²xᵀQx over images x, for any alpha.

    Attributes
    ----------
    model
        The forward model that was linearised.
    jacobian
        (n_meas, n_cells) J of the difference data: V per S, or 1 per S when normalised; real
        or complex.
    weights
        (n_meas,) diagonal of W.
    prior
        Q on this mesh.
    difference
        "plain" or "normalised".
    reference
        (n_meas,) V: the model's voltages where it was linearised.
    conductivity
        (n_cells,) S or S/m: where that was.
    """

    model: ForwardModel
    jacobian: NDArray[Any]
    weights: FloatArray
    prior: Penalty
    difference: str
    reference: NDArray[Any]
    conductivity: NDArray[Any]

    @classmethod
    def of(
        cls,
        model: ForwardModel,
        prior: PriorLike = "noser",
        *,
        conductivity: ArrayLike = 1.0,
        difference: str = "plain",
        weights: ArrayLike | None = None,
    ) -> Self:
        """Linearise ``model``; the parameters are those of :class:`OneStep`.

        Raises
        ------
        ModelError
            For an unknown prior or difference, weights that are not positive, or a
            conductivity that is impossible or a tensor.
        """
        state = model.at(conductivity)
        if state.conductivity.ndim > 1:
            raise ModelError("expected one conductivity per cell, got tensors")
        reference = state.voltages
        jacobian, default = _data_model(state.jacobian, reference, difference)
        weight = _weights(default if weights is None else weights, len(jacobian))
        penalty = penalty_of(prior, model.mesh, jacobian)
        return cls(model, jacobian, weight, penalty, difference, reference, state.conductivity)

    @cached_property
    def carried(self) -> Carried:
        """Q⁻¹Jᴴ (n_cells, n_meas) and JQ⁻¹Jᴴ (n_meas, n_meas), which hold for every alpha."""
        return self.prior.carry(self.jacobian)

    def without(self, rows: NDArray[Any]) -> Self:
        """The problem of a pattern that never had ``rows``; prior and linearisation stay.

        Raises DataError when no row is left.
        """
        kept = np.delete(np.arange(len(self.weights)), rows)
        if not len(kept):
            raise DataError("expected at least one row that is not left out, got none")
        full = self.model
        pattern = Pattern.from_tables(
            full.pattern.drive[kept], full.pattern.measure[kept], full.pattern.n_electrodes
        )
        current = np.empty(pattern.n_drive)
        current[pattern.drive_index] = full.current[full.pattern.drive_index[kept]]
        return replace(
            self,
            model=ForwardModel(
                full.mesh, pattern, full.contact_impedance, current, order=full.order
            ),
            jacobian=self.jacobian[kept],
            weights=self.weights[kept],
            reference=self.reference[kept],
        )

    def weighed(self, prior: PriorLike, weights: FloatArray) -> Self:
        """The problem of other weights, (n_meas,) above 0.

        The prior goes with them: one that weighs cells by their sensitivity sees W^½J.
        """
        weight = _weights(weights, len(self.jacobian))
        penalty = penalty_of(prior, self.model.mesh, np.sqrt(weight)[:, None] * self.jacobian)
        return replace(self, weights=weight, prior=penalty)

    def operator(self, alpha: float) -> Operator:
        """Minimiser of the problem as a matrix, made in the space of the measurements.

        With K = JQ⁻¹Jᴴ + α²W⁻¹ it is Q⁻¹JᴴK⁻¹. Free images N are fitted first, by generalised
        least squares with B = JN: they get C = (BᴴK⁻¹B)⁻¹BᴴK⁻¹, the rest gets the residual
        (universal kriging; Rasmussen & Williams 2006, equations 2.41 and 2.42).

        Raises
        ------
        ModelError
            When alpha is not above 0, or so small that the system is singular.
        """
        check_positive(alpha, "alpha")
        spread, gram = self.carried
        system = gram.copy()
        system[np.diag_indices_from(system)] += alpha**2 / self.weights
        precision = _inverse(system)
        matrix = (precision.T @ spread.T).T  # by columns, as a product with a vector reads fastest
        if np.linalg.norm(system, 1) * np.linalg.norm(precision, 1) > _ILL_CONDITIONED:
            matrix += (spread - matrix @ system) @ precision  # refined once
        free = self.prior.free
        if free.shape[1]:
            response = self.jacobian @ free
            precision, fitted = _fitted(precision, response)
            matrix += (free - matrix @ response) @ fitted
        return self.operator_of(matrix, precision)

    def operator_of(self, matrix: NDArray[Any], precision: NDArray[Any]) -> Operator:
        """The operator of that matrix (n_cells, n_meas) and precision (n_meas, n_meas)."""
        reference, difference = self.reference, self.difference
        return Operator(
            self.model, matrix, precision=precision, reference=reference, difference=difference
        )


class OneStep(Operator):
    """Linear difference imaging: x = (JᵀWJ + α²Q)⁻¹JᵀW dv, the thesis's (3.54) and (3.55).

    Parameters
    ----------
    model
        The forward model to linearise.
    prior
        A name from :data:`tomoskin.model.prior.PRIORS`, a prior such as ``Noser(exponent=1.0)``, or
        a symmetric (n_cells, n_cells) matrix Q, dense or sparse, or its diagonal.
    alpha
        Hyper-parameter; it enters squared.
    conductivity
        Where to linearise: (n_cells,) or one number, S or S/m; real or complex.
    difference
        "plain": dv in V. "normalised": dv is a ratio; the rows of J are divided by the model's
        voltages |v₀| and W = diag(|v₀|²), so that a gain of the read-out cancels.
    weights
        (n_meas,) diagonal of W, instead of the default.

    Attributes
    ----------
    alpha
        As given.
    problem
        What the operator solves: Jacobian, weights and prior.

    Raises
    ------
    ModelError
        For an unknown prior or difference, alpha ≤ 0, weights that are not positive, or a
        tensor conductivity.
    """

    def __init__(
        self,
        model: ForwardModel,
        prior: PriorLike = "noser",
        *,
        alpha: float,
        conductivity: ArrayLike = 1.0,
        difference: str = "plain",
        weights: ArrayLike | None = None,
    ) -> None:
        problem = LinearProblem.of(
            model, prior, conductivity=conductivity, difference=difference, weights=weights
        )
        made = problem.operator(alpha)
        super().__init__(
            model,
            made.matrix,
            precision=made.precision,
            reference=made.reference,
            difference=difference,
        )
        self.problem = problem
        self.alpha = alpha


def _fitted(precision: NDArray[Any], response: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """K⁻¹ less the part of the free images, and C (k, n_meas); ``seen`` is B."""
    half = precision @ response
    fitted = _inverse(response.conj().T @ half) @ half.conj().T
    return precision - half @ fitted, fitted


def _inverse(system: NDArray[Any]) -> NDArray[Any]:
    """Of a small Hermitian matrix: times many cells it is faster than two triangular solutions."""
    try:
        factor = cho_factor(system, lower=True, check_finite=False)
    except LinAlgError as error:
        raise ModelError(
            "the regularised system is not positive definite", hint="raise alpha"
        ) from error
    return np.asarray(cho_solve(factor, np.eye(len(system)), check_finite=False))


def _data_model(
    jacobian: NDArray[Any], reference: NDArray[Any], difference: str
) -> tuple[NDArray[Any], FloatArray]:
    """Jacobian of the difference data, and the weights that go with it."""
    if difference == "plain":
        return jacobian, np.ones(len(reference))
    if difference == "normalised":
        size = np.abs(reference)
        _refuse_zeros(size)
        return jacobian / size[:, None], size**2
    raise ModelError(f'expected difference "plain" or "normalised", got "{difference}"')


def _refuse_zeros(size: FloatArray) -> None:
    if size.min() < _ZERO * size.max():
        raise ModelError(
            f"the model predicts only {size.min():.1e} V, too little to divide by",
            where=f"row {int(size.argmin())}",
            hint='choose difference "plain", or a pattern without such rows',
        )


def _weights(value: ArrayLike, n_meas: int) -> FloatArray:
    weights = np.asarray(value, dtype=np.float64)
    if weights.shape != (n_meas,):
        raise ModelError(f"expected weights of shape ({n_meas},), got {weights.shape}")
    bad = ~(np.isfinite(weights) & (weights > 0))
    refuse_first(bad, weights, "weights above 0", "row", ModelError)
    return weights
