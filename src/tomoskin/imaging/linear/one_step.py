"""The one-step operator: one matrix, made once, applied per frame."""

from __future__ import annotations

from numpy.typing import ArrayLike

from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.linear.problem import LinearProblem
from tomoskin.model.forward import ForwardModel
from tomoskin.model.prior import PriorLike


class OneStep(Operator):
    """Linear difference imaging: x = (JᵀWJ + α²Q)⁻¹JᵀW dv, the thesis's (3.54) and (3.55).

    Parameters
    ----------
    model
        The forward model to linearise.
    prior
        A name from :data:`tomoskin.imaging.PRIORS`, a prior such as ``Noser(exponent=1.0)``, or
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
