"""The covariance of idle frames: what the read-out leads one to expect, and what frames add."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtr, stdtrit

from tomoskin.core import FloatArray
from tomoskin.pattern import Scan
from tomoskin.signal import Scatter
from tomoskin.touch.fit.noise import rounding_left, row_covariance
from tomoskin.touch.fit.targets import Blocks, target

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

_PASSES = 3
"""Structure and factors are fitted by turns."""


@dataclass(frozen=True, eq=False)
class Turned:
    """A scatter in the eigenvectors in which it meets its structure.

    ``back`` (n_meas, n_meas) V makes rows of them; ``variance`` (n_meas,), ascending, are 1 where
    the structure is right; the last ``factors`` of them stand out.
    """

    back: FloatArray
    variance: FloatArray
    factors: int

    @property
    def removed(self) -> FloatArray:
        """(n_meas, k) V: the factors, each as long as its deviation."""
        first = len(self.variance) - self.factors
        return np.asarray(self.back[:, first:] * np.sqrt(self.variance[first:]))

    def likeness(self, signatures: FloatArray) -> FloatArray:
        """(k,) cosine of each factor to the nearest of ``signatures`` (n, n_meas)."""
        turned = np.linalg.solve(self.back, signatures.T)
        turned /= np.linalg.norm(turned, axis=0)
        return np.asarray(np.abs(turned[len(turned) - self.factors :]).max(axis=1))


def idle_covariance(
    scan: Scan,
    scatter: Scatter,
    *,
    least: FloatArray | float,
    step: float,
    oversampling: int,
    signatures: FloatArray | None = None,
) -> FloatArray:
    """(n_meas, n_meas) V²: of one frame less the reference, as idle frames scatter.

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
    return _uncertain(scatter.frames) * learnt_covariance(
        blocks, matrix, scatter.frames, signatures
    )


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
) -> FloatArray:
    """(n_meas, n_meas) V² for a ``scatter`` (n_meas, n_meas) V² of so many independent frames.

    The structure of the read-out (:mod:`tomoskin.touch.fit.targets`), and in it: factors that many
    rows have in common, as hum, which stand out of the spectrum of noise (Marchenko & Pastur
    1967), with the variance that was seen; and all else drawn towards the structure as far as the
    frames bear it out (oracle-approximating shrinkage: Chen, Wiesel, Eldar & Hero 2010, which
    betters Ledoit & Wolf 2004 for normal noise). A factor like one of the ``signatures``,
    (n, n_meas), is a touch that stood for a part of the frames, and no noise.
    """
    turned = _turned(blocks, scatter, frames)
    first = len(turned.variance) - turned.factors
    left = max(frames - turned.factors, 2)
    variance = turned.variance.copy()
    variance[:first] = _shrunk(variance[:first] * frames / left, left)
    if turned.factors and signatures is not None:
        variance[first:][turned.likeness(signatures) > _TOUCHLIKE] = 1.0
    return np.asarray((turned.back * variance) @ turned.back.T)


def _turned(blocks: Blocks, scatter: FloatArray, frames: int) -> Turned:
    found = None
    for _ in range(_PASSES):
        found = _once(blocks, scatter, frames, found)
        if not found.factors:
            break
    assert found is not None
    return found


def _once(blocks: Blocks, scatter: FloatArray, frames: int, before: Turned | None) -> Turned:
    """One pass: the structure of what the factors of the pass before leave, then factors."""
    rest, left = scatter, frames
    if before is not None:
        left = max(frames - before.factors, 2)
        rest = (scatter - before.removed @ before.removed.T) * (frames / left)
    values, vectors = np.linalg.eigh(target(blocks, rest, left))
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    white = vectors / np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    variance, directions = np.linalg.eigh(white.T @ scatter @ white)
    edge = _EDGE * (1 + np.sqrt(len(values) / frames)) ** 2
    factors = min(int(np.count_nonzero(variance > edge)), _MOST, frames // 3)
    return Turned(root @ directions, np.maximum(variance, 0.0), factors)


def _shrunk(variance: FloatArray, frames: int) -> FloatArray:
    """Variances drawn towards 1, by the part that makes the expected error least."""
    p, total, squares = len(variance), float(variance.sum()), float(variance @ variance)
    chance = (1 - 2 / p) * squares + total**2
    differs = (frames + 1 - 2 / p) * (squares - total**2 / p)
    part = min(1.0, chance / differs) if differs > 0 else 1.0
    return np.asarray(part + (1 - part) * variance)
