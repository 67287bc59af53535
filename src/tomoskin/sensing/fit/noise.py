"""Noise of difference data: as the read-out makes it, as idle frames scatter, and what makes it
independent."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.linalg.lapack import dpocon, dpotrf, dtrtri
from scipy.special import ndtr, stdtrit

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.pattern import Scan
from tomoskin.sensing.fit.noise_structure import Blocks, target
from tomoskin.sensing.signal import Reference, Scatter

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
    makes = scan.makes * sample_sd
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


_EDGE = 1.15
"""A factor is one whose variance is so many times the largest that noise has by chance."""

_MOST = 8
"""Factors at most; and no more than a third of the frames."""

_TOUCHLIKE = 0.7
"""Cosine to the signature of a touch above which a factor is one."""

_TAIL = 5.0
_DEGREES = 4
"""Degrees of freedom of the variance along a touch's signature that a frame is worth, at the least:
many rows tell of it. Between 4 and 100 in the cases of the benchmark."""

_WAVERS, _WORTH = 3e-4, 20
"""By what part of them all voltages move together between the reference and a frame, before idle
frames say; and so many frames that this is worth."""

_TINY = np.finfo(float).tiny

_PASSES = 3
"""Structure and factors are fitted by turns."""

_RIDGE = 1e-12
"""Part of the largest variance that every row has at the least."""


@dataclass(frozen=True, eq=False)
class Factors:
    """What stands out of a structure, as its root sees a scatter.

    Attributes
    ----------
    structure, root
        (n_meas, n_meas) V² and V: the structure, and its lower root.
    directions
        (n_meas, k) of length 1, in what is white by the structure.
    variance
        (k,), ascending: 1 is the structure's.
    total, squares
        Sum, and sum of squares, of the variances along all directions.
    """

    structure: FloatArray
    root: FloatArray
    directions: FloatArray
    variance: FloatArray
    total: float
    squares: float

    @property
    def back(self) -> FloatArray:
        """(n_meas, k) V: what each direction does to the rows."""
        return np.asarray(self.root @ self.directions)

    @property
    def removed(self) -> FloatArray:
        """(n_meas, k) V: the factors, each as long as its deviation."""
        return np.asarray(self.back * np.sqrt(self.variance))

    def likeness(self, signatures: FloatArray) -> FloatArray:
        """(k,) cosine of each factor to the nearest of ``signatures`` (n, n_meas)."""
        white = solve_triangular(self.root, signatures.T, lower=True, check_finite=False)
        white /= np.linalg.norm(white, axis=0)
        return np.asarray(np.abs(self.directions.T @ white).max(axis=1))


def idle_covariance(
    scan: Scan,
    scatter: Scatter,
    *,
    least: FloatArray | float,
    step: float,
    oversampling: int,
    signatures: FloatArray | None = None,
) -> Generator[None, None, FloatArray]:
    """(n_meas, n_meas) V²: of one frame less the reference, as idle frames scatter; a piece of
    work, about a millisecond, between two yields.

    Parameters
    ----------
    scan
        Which sample is in which row.
    scatter
        Of the idle frames.
    least
        V, or (n_meas,) V: no row wavers by less.
    step
        Of the converter, V, of which so many readings (``oversampling``) make a sample. What
        rounding leaves is the same in all frames, and does not show in their scatter.
    signatures
        (n, n_meas) of touches: what is like one of them is not learnt.
    """
    blocks, variance = _blocks(scan), np.diag(scatter.matrix)
    more = np.maximum(np.square(least) - variance, 0.0)
    more = more + rounding_left(variance + more, step, oversampling)
    size = np.sqrt(more)
    shared = row_covariance(scan, np.sqrt(0.5))
    matrix = scatter.matrix + shared * size[:, None] * size
    learnt = yield from learnt_covariance(blocks, matrix, scatter.frames, signatures)
    return _uncertain(scatter.frames) * learnt


def common_mode_variance(covariance: FloatArray, reference: Reference) -> float:
    """By what part of them all voltages move together from the reference to a frame, squared,
    beyond a ``covariance`` (n_meas, n_meas) V² of it.

    What idle frames show of it, mixed with what is usual: a factor like a touch's signature is no
    part of the covariance, and the change of all voltages in proportion is like a central touch's.
    """
    scatter = reference.scatter
    if scatter is None:
        return _WAVERS**2
    variance = np.diag(covariance)
    weights = np.where(variance > 0, reference.mean / np.maximum(variance, _TINY), 0.0)
    weights /= max(float(weights @ reference.mean), _TINY)
    beyond = float(weights @ (scatter.matrix - covariance) @ weights)
    frames = scatter.frames
    return (_WORTH * _WAVERS**2 + frames * max(beyond, 0.0)) / (_WORTH + frames)


def _uncertain(frames: int) -> float:
    """Factor by which a variance learnt from so many frames is to be taken larger.

    What is divided by an estimated deviation has Student's distribution, with longer tails: at
    ``_TAIL`` deviations it shall go beyond as rarely as a normal number.
    """
    return float((stdtrit(_DEGREES * frames, ndtr(-_TAIL)) / _TAIL) ** 2)


@lru_cache(maxsize=4)
def _blocks(scan: Scan) -> Blocks:
    return Blocks.of(scan)


def learnt_covariance(
    blocks: Blocks, scatter: FloatArray, frames: int, signatures: FloatArray | None = None
) -> Generator[None, None, FloatArray]:
    """(n_meas, n_meas) V² for a ``scatter`` (n_meas, n_meas) V² of so many independent frames.

    The structure of the read-out (:mod:`tomoskin.sensing.fit.noise_structure`), and in it: factors
    that many measurements have in common, as hum, which stand out of the spectrum of noise
    (Marchenko & Pastur 1967), with their own variance; and all else drawn towards the structure as
    far as the frames bear it out (oracle-approximating shrinkage: Chen, Wiesel, Eldar & Hero 2010,
    which betters Ledoit & Wolf 2004 for normal noise). A factor like one of the ``signatures``,
    (n, n_meas), is a touch that stood for a part of the frames, and no noise.
    """
    found = yield from _factors(blocks, scatter, frames)
    yield
    seen, back = found.variance, found.back
    count = len(seen)
    left = max(frames - count, 2)
    more = frames / left
    total, squares = found.total - float(seen.sum()), found.squares - float(seen @ seen)
    part = _part(len(scatter) - count, more * total, more**2 * squares, left)
    known = seen.copy()
    if count and signatures is not None:
        known[found.likeness(signatures) > _TOUCHLIKE] = 1.0
        yield
    # along each factor what is known of it, along all else the structure and the scatter
    known -= part + (1 - part) * more * seen
    covariance = part * found.structure + (1 - part) * more * scatter
    return np.asarray(covariance + (back * known) @ back.T)


def _factors(blocks: Blocks, scatter: FloatArray, frames: int) -> Generator[None, None, Factors]:
    found = None
    for _ in range(_PASSES):
        found = yield from _once(blocks, scatter, frames, found)
        if not len(found.variance):
            break
    assert found is not None
    return found


def _once(
    blocks: Blocks, scatter: FloatArray, frames: int, before: Factors | None
) -> Generator[None, None, Factors]:
    """One pass: the structure of what the factors of the pass before leave, then factors."""
    rest, left = scatter, frames
    if before is not None:
        left = max(frames - len(before.variance), 2)
        rest = (scatter - before.removed @ before.removed.T) * (frames / left)
    structure = yield from target(blocks, rest, left)
    yield
    structure[np.diag_indices_from(structure)] += _RIDGE * np.diag(structure).max()
    root = np.asarray(np.linalg.cholesky(structure))
    half = solve_triangular(root, scatter, lower=True, check_finite=False)
    white = solve_triangular(root, half.T, lower=True, check_finite=False)
    yield
    edge = _EDGE * (1 + np.sqrt(len(white) / frames)) ** 2
    variance, directions = eigh(white, driver="evr", subset_by_value=(edge, np.inf))
    most = min(len(variance), _MOST, frames // 3)
    first = len(variance) - most
    squares = float(np.einsum("ij,ij->", white, white))
    return Factors(
        structure, root, directions[:, first:], variance[first:], float(np.trace(white)), squares
    )


def _part(p: int, total: float, squares: float, frames: int) -> float:
    """How far ``p`` variances are drawn towards 1, which makes the expected error least; ``total``
    and ``squares`` are the sums of them and of their squares."""
    chance = (1 - 2 / p) * squares + total**2
    differs = (frames + 1 - 2 / p) * (squares - total**2 / p)
    return min(1.0, chance / differs) if differs > 0 else 1.0
