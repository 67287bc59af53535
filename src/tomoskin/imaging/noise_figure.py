"""The noise figure of an operator: how much of the data's signal-to-noise ratio its image keeps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray, TomoskinError


def deviations(noise: ArrayLike, n_meas: int, error: type[TomoskinError] = DataError) -> FloatArray:
    """(n_meas,) standard deviations of data, of these or one number; an ``error`` for others."""
    sd = np.asarray(noise, dtype=np.float64)
    if sd.shape not in ((), (n_meas,)):
        raise error(f"expected noise of shape ({n_meas},), got {sd.shape}")
    if not (np.isfinite(sd).all() and (sd >= 0).all() and sd.any()):
        raise error(f"expected finite noise above 0, got {sd.min():g} to {sd.max():g}")
    return np.broadcast_to(sd, (n_meas,))


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
    sd = deviations(noise, len(signal))
    image = np.abs(volumes * (matrix @ signal)).mean()
    if not (signal.any() and image > 0):
        raise DataError("the target causes no signal, or no image")
    spread = np.einsum("cm,cm,m->c", matrix, matrix, sd**2, optimize=True)
    image_noise = np.sqrt((volumes**2 * spread).mean())
    return float((np.abs(signal).mean() / np.sqrt((sd**2).mean())) / (image / image_noise))
