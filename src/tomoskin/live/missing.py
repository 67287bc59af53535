"""Rows that cannot be used in one frame, left out of the picture without a new operator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray


def fill(dv: FloatArray, missing: NDArray[np.bool_], predictor: FloatArray) -> FloatArray:
    """Difference data with the missing rows set so that they do not count.

    With R = (JᵀWJ + α²Q)⁻¹JᵀW and H = JR, a row that is predicted exactly by the picture adds
    nothing to its normal equations. So the missing rows m are given dv_m = H_mk dv_k + H_mm dv_m,
    k the rows that are kept, and R applied to the result is the picture that an operator built
    without the rows m would give.

    Parameters
    ----------
    dv
        (n_meas,) difference data; what stands in missing rows is ignored.
    missing
        (n_meas,) bool.
    predictor
        (n_meas, n_meas) H.
    """
    if not missing.any():
        return dv
    lost, kept = np.flatnonzero(missing), np.flatnonzero(~missing)
    filled = dv.copy()
    loop = np.eye(len(lost)) - predictor[np.ix_(lost, lost)]
    filled[lost] = np.linalg.solve(loop, predictor[np.ix_(lost, kept)] @ dv[kept])
    return filled
