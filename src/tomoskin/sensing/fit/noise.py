"""Noise of difference data, as the read-out makes it, and what makes it independent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg.lapack import dpocon, dpotrf, dtrtri

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.pattern import Scan

_LEAST = 1e-10
"""Directions with less than this part of the largest variance hold no data: rows that follow
from others."""

_FRAMES = 20
"""Idle frames that the rows' common variance is worth."""


@dataclass(frozen=True, eq=False)
class Whitener:
    """What makes correlated rows independent, of variance one.

    ``matrix`` (r, n_meas) 1/V; r is the rank of the covariance, at most n_meas.
    """

    matrix: FloatArray

    @classmethod
    def of(cls, noise: FloatArray) -> Self:
        """From a covariance (n_meas, n_meas) V², or a standard deviation per row (n_meas,) V.

        Raises
        ------
        ModelError
            When a value is not finite, or nothing varies.
        """
        noise = np.asarray(noise, dtype=np.float64)
        if not np.isfinite(noise).all() or noise.ndim not in (1, 2) or not np.any(noise > 0):
            raise ModelError(
                "expected finite noise above 0, (n_meas,) V or (n_meas, n_meas) V², "
                f"got shape {noise.shape}"
            )
        covariance = np.diag(noise**2) if noise.ndim == 1 else (noise + noise.T) / 2
        size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        scale = np.where(size > 0, size, 1.0)
        even = covariance / scale[:, None] / scale
        root, singular = dpotrf(even, lower=1, clean=1)
        if not singular and dpocon(root, np.abs(even).sum(axis=0).max(), uplo="L")[0] > _LEAST:
            return cls(dtrtri(root, lower=1)[0] / scale)
        variance, direction = np.linalg.eigh(even)
        kept = variance > _LEAST * variance[-1]
        return cls((direction[:, kept] / np.sqrt(variance[kept])).T / scale)

    def without(self, directions: FloatArray) -> Whitener:
        """The same where ``directions`` (n_meas, k) are a nuisance subspace: unbounded noise there.

        An excluded row is a direction with a single one in it.
        """
        if not directions.shape[1]:
            return self
        basis, singular, _ = np.linalg.svd(self.matrix @ directions)
        rank = int(np.count_nonzero(singular > _LEAST * singular[0]))
        return Whitener(basis[:, rank:].T @ self.matrix)

    def __call__(self, rows: FloatArray) -> FloatArray:
        """(…, r) whitened values of rows (…, n_meas)."""
        return np.asarray(rows @ self.matrix.T)


def row_covariance(scan: Scan, sample_sd: FloatArray | float) -> FloatArray:
    """(n_meas, n_meas) V²: rows are differences of two samples, and neighbours share one.

    ``sample_sd`` is the standard deviation of a sample, V, or one per sample (n_samples,).
    """
    n_meas = len(scan.plus)
    makes = np.zeros((n_meas, scan.n_samples))
    rows = np.arange(n_meas)
    makes[rows, scan.plus] = 1.0
    makes[rows, scan.minus] = -1.0
    makes *= sample_sd
    return np.asarray(makes @ makes.T)


def measured_covariance(
    scan: Scan, sd: FloatArray, n_frames: int, *, predicted: float, step: float, oversampling: int
) -> FloatArray:
    """(n_meas, n_meas) V²: of one frame less a mean of ``n_frames`` idle ones.

    How rows are correlated follows from the samples that they share; how much each wavers was
    measured, but on few frames: its variance is mixed with that of all rows, which counts as much
    as ``_FRAMES`` frames. What rounding adds is not seen in idle frames.

    Parameters
    ----------
    scan
        Which sample is in which row.
    sd
        (n_meas,) V, standard deviation of each row over the idle frames; NaN where unknown.
    predicted
        Standard deviation of a row by the read-out alone, V: counts where nothing was measured.
    step
        Of the converter, V, of which so many readings (``oversampling``) make a sample.
    """
    if np.isfinite(sd).all():
        pooled = np.median(sd**2)
        variance = (n_frames * sd**2 + _FRAMES * pooled) / (n_frames + _FRAMES)
    else:
        variance = np.full(len(scan.plus), predicted**2)
    variance = variance + rounding_left(variance, step, oversampling)
    size = np.sqrt(variance * (1 + 1 / max(n_frames, 1)))
    shared = row_covariance(scan, np.sqrt(0.5))
    return np.asarray(shared * size[:, None] * size)


def rounding_left(variance: FloatArray, step: float, oversampling: int) -> FloatArray:
    """(n_meas,) V² that rounding leaves in rows that waver by ``variance`` (n_meas,) V².

    ``step`` V of the converter; so many readings (``oversampling``) make a sample.
    """
    return np.asarray(2 * _rounding(variance * oversampling / 2 / step**2) * step**2)


def _rounding(variance: FloatArray) -> FloatArray:
    """Square of what rounding leaves in the mean of readings that waver by ``variance``; steps².

    The first harmonic of the staircase, which Gaussian noise s evens out to exp(−2π²s²)/π
    (Widrow & Kollár 2008, section 4.3); 1/12 of ``variance`` is rounding's own.
    """
    own = np.maximum(variance - 1 / 12, 0.0)
    return np.asarray(np.exp(-4 * np.pi**2 * own) / (2 * np.pi**2))
