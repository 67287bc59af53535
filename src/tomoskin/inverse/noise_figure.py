"""Noise figure: how much of the signal-to-noise ratio an operator loses."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray


def noise_figure(
    matrix: FloatArray, volumes: FloatArray, signal: FloatArray, noise: ArrayLike = 1.0
) -> float:
    """Signal-to-noise ratio of the data over that of the image (Adler & Guardo 1996).

    With image x = A B z, where A is the area of each cell and B the operator,

        NF = (mean|z| / rms sd(z)) / (mean|x| / rms sd(x)),

    z the data of a small target in the middle. Independent of the size of signal and noise.
    Definitions differ in how they average (EIDORS has several); compare like with like.

    Parameters
    ----------
    matrix
        (n_cells, n_meas).
    volumes
        (n_cells,) m² or m³.
    signal
        (n_meas,) noise-free difference data of the target.
    noise
        Standard deviation of the data: one number, or (n_meas,).

    Raises
    ------
    DataError
        When the signal is zero, or the noise is not above 0 or of another shape.
    """
    sd = np.asarray(noise, dtype=np.float64)
    if sd.shape not in ((), signal.shape):
        raise DataError(f"expected noise of shape {signal.shape}, got {sd.shape}")
    sd = np.broadcast_to(sd, signal.shape)
    if not (np.isfinite(sd).all() and (sd >= 0).all() and sd.any()):
        raise DataError("expected noise above 0")
    image = np.abs(volumes * (matrix @ signal)).mean()
    if not (signal.any() and image > 0):
        raise DataError("the target makes no signal, or no image")
    spread = np.einsum("cm,cm,m->c", matrix, matrix, sd**2, optimize=True)
    image_noise = np.sqrt((volumes**2 * spread).mean())
    return float((np.abs(signal).mean() / np.sqrt((sd**2).mean())) / (image / image_noise))
