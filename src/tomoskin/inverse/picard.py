"""The Picard plot: whether data fall faster than the singular values, and where noise begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.inverse.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class Picard:
    """Coefficients of data against the singular values (discrete Picard condition, Hansen 1990).

    Attributes
    ----------
    singular_values
        (r,) σ, descending.
    coefficients
        (r,) root mean square over the frames of |uᴴW^½dv|.
    solution
        (r,) coefficients / σ: what they would add to the image without regularisation.
    noise
        (r,) standard deviation of the coefficients that noise alone causes; NaN where unknown.
    """

    singular_values: FloatArray
    coefficients: FloatArray
    solution: FloatArray
    noise: FloatArray

    @property
    def above_noise(self) -> int:
        """Number of coefficients that are more than noise: above three deviations."""
        return int(np.count_nonzero(self.coefficients > 3.0 * self.noise))


def picard(spectrum: Spectrum, dv: NDArray[Any], noise: FloatArray | None = None) -> Picard:
    """Picard data of difference data ``dv``, (n_meas,) or (n_frames, n_meas).

    ``noise`` is (n_meas,), the standard deviation of one frame. Images that the prior leaves
    free have no singular value and are not among the coefficients.
    """
    frames = np.atleast_2d(dv)
    sigma = spectrum.singular_values
    first = int(np.isinf(spectrum.values).sum())
    kept = slice(first, first + len(sigma))
    size = np.sqrt(np.mean(np.abs(spectrum.coefficients(frames)[:, kept]) ** 2, axis=0))
    spread = np.full(len(sigma), np.nan)
    if noise is not None:
        variance = np.real(np.diag(spectrum.noise_coefficients(noise)))[kept]
        spread = np.sqrt(variance)
    return Picard(sigma, size, size / sigma, spread)
