"""Rows that cannot be used, left out of the picture without solving the problem again.

For data whose covariance is P⁻¹, the missing rows m are expected to be −P_mm⁻¹P_mk dv_k, given
the rows k that are kept. Data that are as expected add nothing to the picture. So an operator R
without the rows m is R_k − R_m P_mm⁻¹P_mk, from the inverse of a block (Schur complement); and R
applied to data whose missing rows are as expected gives the same picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import DataError


def expected(
    dv: NDArray[Any],
    missing: NDArray[np.bool_],
    ignored: NDArray[np.bool_],
    precision: NDArray[Any],
) -> NDArray[Any]:
    """Difference data with the missing rows as the others lead one to expect them.

    Parameters
    ----------
    dv
        (n_meas,) difference data; what stands in missing rows is not used.
    missing
        (n_meas,) bool.
    ignored
        (n_meas,) bool: rows that the operator leaves out itself.
    precision
        (n_meas, n_meas) P.
    """
    if not missing.any():
        return dv
    kept = ~(missing | ignored)
    filled = dv.copy()
    filled[missing] = -_solved(precision, missing, precision[np.ix_(missing, kept)] @ dv[kept])
    return filled


def downdated(
    matrix: NDArray[Any],
    precision: NDArray[Any],
    lost: NDArray[np.bool_],
    left_out: NDArray[np.bool_],
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Matrix and precision without the ``lost`` rows, zero in all that are ``left_out``."""
    replaced = _solved(precision, lost, precision[lost])
    smaller = matrix - matrix[:, lost] @ replaced
    smaller[:, left_out] = 0.0
    inner = precision - precision[:, lost] @ replaced
    inner[left_out] = 0.0
    inner[:, left_out] = 0.0
    return smaller, inner


def _solved(precision: NDArray[Any], missing: NDArray[np.bool_], rhs: NDArray[Any]) -> NDArray[Any]:
    block = precision[np.ix_(missing, missing)]
    try:
        return np.asarray(cho_solve(cho_factor(block, check_finite=False), rhs))
    except LinAlgError as error:
        raise DataError(
            f"too few rows are left without {np.flatnonzero(missing).tolist()}",
        ) from error
