"""The one-step operator: one matrix, made once, applied per frame."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.linalg.blas import dtrsm

from tomoskin.core import DataError, FloatArray, Image, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse.priors import prior_matrix

_ZERO = 1e-9
"""A voltage below this part of the largest is zero by symmetry, and its value is rounding."""


class OneStep:
    """Linear difference imaging: x = (JᵀWJ + α²Q)⁻¹JᵀW dv, the source's (3.54) and (3.55).

    Parameters
    ----------
    model
        The forward model to linearise.
    prior
        A name from :data:`tomoskin.inverse.PRIORS`, or a symmetric (n_cells, n_cells) matrix,
        dense or sparse, or its diagonal.
    alpha
        Hyper-parameter; it enters squared.
    conductivity
        Where to linearise: (n_cells,) or one number, S or S/m.
    difference
        "plain": dv in V. "normalised": dv is a ratio; the rows of J are divided by the model's
        voltages v₀ and W = diag(v₀²), so that a gain of the read-out cancels.
    weights
        (n_meas,) diagonal of W, instead of the default.

    Attributes
    ----------
    matrix
        (n_cells, n_meas): S per V, or S per unit of normalised difference.
    reference
        (n_meas,) V: the model's voltages at ``conductivity``.

    Raises
    ------
    ModelError
        For an unknown prior or difference, alpha ≤ 0, weights that are not positive, or a
        complex conductivity or contact impedance.
    """

    def __init__(
        self,
        model: ForwardModel,
        prior: str | Any = "noser",
        *,
        alpha: float,
        conductivity: ArrayLike = 1.0,
        difference: str = "plain",
        weights: ArrayLike | None = None,
    ) -> None:
        if not (np.isfinite(alpha) and alpha > 0):
            raise ModelError(f"expected alpha above 0, got {alpha}")
        state = model.at(conductivity)
        if np.iscomplexobj(state.conductivity) or np.iscomplexobj(model.contact_impedance):
            raise ModelError("expected a real conductivity and contact impedance, got complex ones")
        self.model = model
        self.alpha = alpha
        self.difference = difference
        self.reference: FloatArray = state.voltages
        jacobian, default = _data_model(state.jacobian, self.reference, difference)
        weight = _weights(default if weights is None else weights, len(jacobian))
        q = prior_matrix(prior, model.mesh, jacobian)
        self.matrix = (
            _diagonal(jacobian, weight, alpha, q)
            if q.ndim == 1
            else _full(jacobian, weight, alpha, q)
        )
        self.unit = "S" if model.mesh.dimension == 2 else "S/m"

    def __call__(self, dv: FloatArray) -> Image:
        """Image of the difference data ``dv``, (n_meas,).

        Raises
        ------
        DataError
            When there are more or fewer values than rows, or one is not finite.
        """
        self._check(dv)
        return Image(self.matrix @ dv, self.unit, self.model.mesh.identity)

    def quick(self, dv: FloatArray) -> Image:
        """As a call, from the matrix in single precision: half the bytes, for the frame flow.

        The product reads the whole matrix once, so its time is that of the memory.
        """
        self._check(dv)
        values = (self._single @ dv.astype(np.float32)).astype(np.float64)
        return Image(values, self.unit, self.model.mesh.identity)

    @cached_property
    def _single(self) -> NDArray[np.float32]:
        return self.matrix.astype(np.float32)

    def _check(self, dv: FloatArray) -> None:
        n = self.matrix.shape[1]
        if dv.shape != (n,):
            raise DataError(f"expected difference data of shape ({n},), got {dv.shape}")
        finite = np.isfinite(dv)
        if not finite.all():
            bad = np.flatnonzero(~finite).tolist()
            raise DataError(f"expected finite difference data; rows {bad} are not")


def _data_model(
    jacobian: FloatArray, reference: FloatArray, difference: str
) -> tuple[FloatArray, FloatArray]:
    """Jacobian of the difference data, and the weights that go with it."""
    if difference == "plain":
        return jacobian, np.ones(len(reference))
    if difference == "normalised":
        _refuse_zeros(reference)
        return jacobian / np.abs(reference)[:, None], reference**2
    raise ModelError(f'expected difference "plain" or "normalised", got "{difference}"')


def _refuse_zeros(reference: FloatArray) -> None:
    size = np.abs(reference)
    if size.min() < _ZERO * size.max():
        raise ModelError(
            f"the model expects {reference[size.argmin()]:.1e} V, which cannot be normalised by",
            where=f"row {int(size.argmin())}",
            hint='choose difference "plain", or a pattern without such rows',
        )


def _weights(value: ArrayLike, n_meas: int) -> FloatArray:
    weights = np.asarray(value, dtype=np.float64)
    if weights.shape != (n_meas,):
        raise ModelError(f"expected weights of shape ({n_meas},), got {weights.shape}")
    if not (np.isfinite(weights).all() and (weights > 0).all()):
        row = int(np.argmin(np.isfinite(weights) & (weights > 0)))
        raise ModelError(f"expected weights above 0, got {weights[row]}", where=f"row {row}")
    return weights


def _diagonal(jacobian: FloatArray, weights: FloatArray, alpha: float, q: FloatArray) -> FloatArray:
    """Q⁻¹Jᵀ(JQ⁻¹Jᵀ + α²W⁻¹)⁻¹: the same matrix, solved in the small measurement space."""
    if not (q > 0).all():
        raise ModelError("expected a positive diagonal", where=f"prior, cell {int(np.argmin(q))}")
    root = np.sqrt(q)
    scaled = jacobian / root
    system = scaled @ scaled.T
    system[np.diag_indices_from(system)] += alpha**2 / weights
    scaled /= root
    factor, _ = _cholesky(system)
    # from the right and in place: the rows of measurements are the columns that BLAS wants
    half = dtrsm(1.0, factor, scaled.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    return np.asarray(dtrsm(1.0, factor, half, side=1, lower=1, overwrite_b=1))


def _full(jacobian: FloatArray, weights: FloatArray, alpha: float, q: FloatArray) -> FloatArray:
    weighted = jacobian.T * weights
    return _cholesky_solve(weighted @ jacobian + alpha**2 * q, weighted)


def _cholesky_solve(system: NDArray[Any], rhs: NDArray[Any]) -> FloatArray:
    return np.asarray(cho_solve(_cholesky(system), rhs, check_finite=False))


def _cholesky(system: NDArray[Any]) -> tuple[FloatArray, bool]:
    try:
        factor, lower = cho_factor(system, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError as error:
        raise ModelError(
            "the regularised system is not positive definite", hint="raise alpha"
        ) from error
    return factor, lower
