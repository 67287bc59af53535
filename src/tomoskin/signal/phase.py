"""Complex recordings (AC instruments) → the part that a real model explains."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray


def in_phase(
    values: NDArray[Any], reference: NDArray[Any], model: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rotate by the instrument's phase and keep the real part.

    The phase is one for all rows: that of Σ model · reference, so that each row keeps its sign.

    Parameters
    ----------
    values, reference
        (n_frames, n_meas) and (n_meas,), complex or real (then they pass unchanged).
    model
        (n_meas,) V, what a real model expects of the reference.
    """
    if not (np.iscomplexobj(values) or np.iscomplexobj(reference)):
        return values, reference
    phase = np.exp(-1j * np.angle(np.nansum(model * reference)))
    return (values * phase).real, (reference * phase).real
