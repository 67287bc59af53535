"""Noise of difference data: of the read-out, and of what a touch leaves behind."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import compress
from typing import Self

import numpy as np
from scipy.linalg.lapack import dpocon, dpotrf, dtrtri

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.pattern import Scan
from tomoskin.sensing.fit.spot import N_PARAMETERS

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
        """(…, r) of rows (…, n_meas)."""
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


_STEP = 0.012
"""A touch that slides leaves a footprint every so many metres."""

_LEFT = 0.05
"""Deviation of the residual response of a touch, in parts of it: a quarter stands out by five."""

_STRONGER = 1.25
"""A footprint is replaced where a touch is by so much stronger than when it was made."""

_MOST = 16
"""Footprints that are kept, the newest."""


@dataclass(frozen=True, eq=False)
class ResidualResponse:
    """Where touches have been since the baseline has had time to follow.

    Attributes
    ----------
    spots
        (k, 4), the newest last.
    changes
        (n_meas,) V of each, what it did to the rows.
    quiet
        Frames without any touch since each was made.
    """

    spots: FloatArray
    changes: tuple[FloatArray, ...]
    quiet: tuple[int, ...] = ()

    @classmethod
    def none(cls) -> Self:
        """Where nothing has touched."""
        return cls(np.zeros((0, N_PARAMETERS)), ())

    def after(
        self, spots: FloatArray, changes: Callable[[FloatArray], FloatArray], frames: int
    ) -> Self:
        """With a frame in which touches ``spots`` (k, 4) were; each is forgotten after so many
        ``frames`` without one. ``changes`` gives (k, n_meas) V of spots (k, 4), each alone."""
        if not len(spots):
            return self._in_peace(frames)
        kept = self.spots.tolist()
        held = [_foot_of(spot, kept) for spot in spots.tolist()]
        news = [foot is None for foot in held]
        quiet = tuple(0 if n in held else q for n, q in enumerate(self.quiet))
        if not any(news):
            return self if quiet == self.quiet else replace(self, quiet=quiet)
        fresh = spots[news]
        stays = [not any(_is_near(foot, spot) for spot in fresh.tolist()) for foot in kept]
        return type(self)(
            np.concatenate([self.spots[stays], fresh])[-_MOST:],
            (*compress(self.changes, stays), *changes(fresh))[-_MOST:],
            (*compress(quiet, stays), *(len(fresh) * (0,)))[-_MOST:],
        )

    def _in_peace(self, frames: int) -> Self:
        """After a frame without a touch."""
        quiet = tuple(q + 1 for q in self.quiet)
        stays = [q < frames for q in quiet]
        if all(stays):
            return replace(self, quiet=quiet) if quiet else self
        return type(self)(
            self.spots[stays], tuple(compress(self.changes, stays)), tuple(compress(quiet, stays))
        )


@dataclass(frozen=True, eq=False)
class ResidualDirections:
    """Residual responses as whitened data see them, each as long as its deviation.

    Attributes
    ----------
    matrix
        (c, n_meas) 1/V, from data to whitened data.
    changes
        (n_meas,) V of each, see :class:`ResidualResponse`.
    rows
        (k, c).
    """

    matrix: FloatArray
    changes: tuple[FloatArray, ...]
    rows: FloatArray

    @classmethod
    def none(cls) -> Self:
        """Where nothing has touched."""
        return cls(np.zeros((0, 0)), (), np.zeros((0, 0)))

    def of(self, matrix: FloatArray, changes: tuple[FloatArray, ...]) -> Self:
        """Those of other ``changes``: a product for each that is new, and for all where the
        ``matrix`` is."""
        if matrix is self.matrix and changes is self.changes:
            return self
        before = zip(self.changes, self.rows, strict=True) if matrix is self.matrix else ()
        known = {id(change): row for change, row in before}
        rows = [
            known[id(change)] if id(change) in known else _LEFT * (matrix @ change)
            for change in changes
        ]
        return type(self)(matrix, changes, np.array(rows).reshape(-1, len(matrix)))


def _is_near(foot: list[float], spot: list[float]) -> bool:
    x, y = foot[0] - spot[0], foot[1] - spot[1]
    return math.sqrt(x * x + y * y) < _STEP


def _foot_of(spot: list[float], feet: list[list[float]]) -> int | None:
    """Which footprint stands for a touch that is there; None where none does."""
    x, y, _, content = spot
    for number in range(len(feet) - 1, -1, -1):  # it is one of the newest, as a rule
        there, across, _, strength = feet[number]
        near = (there - x) ** 2 + (across - y) ** 2 < _STEP**2
        if near and _STRONGER * abs(strength) >= abs(content):
            return number
    return None
