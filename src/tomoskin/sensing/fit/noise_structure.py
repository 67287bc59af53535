"""What the read-out leads one to expect of the noise: two structures, fitted to a scatter.

Rows under one drive share samples; rows of different drives share none. So a structure is a block
for each drive.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma, polygamma

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Scan

_SHARED = 1 - np.concatenate([[0.0], np.geomspace(1e-3, 1.0, 40)])
"""Parts of the rows' variance that may be that of the samples that they share; finest near all."""

_FAR = 1.5
"""A row's variance is drawn towards the others' by at most so many deviations of its logarithm."""

_STEPS, _ABREAST = 30, 5
"""And how many of them in a piece of work."""

_LEAST = 1e-6


@dataclass(frozen=True, eq=False)
class Blocks:
    """The rows of each drive, padded to the same number.

    Attributes
    ----------
    rows
        (n_drives, m); where ``there``, (n_drives, m) bool.
    makes
        (n_drives, m, s) how each row is made of the drive's samples: 1 and −1.
    electrode
        (n_drives, s) that a sample is of.
    """

    rows: IntArray
    there: FloatArray
    makes: FloatArray
    electrode: IntArray

    @classmethod
    def of(cls, scan: Scan) -> Self:
        """The blocks of the rows of a scan."""
        drive, n = scan.sample_drive[scan.plus], len(scan.drives)
        members = [np.flatnonzero(drive == d) for d in range(n)]
        samples = [np.flatnonzero(scan.sample_drive == d) for d in range(n)]
        m, s = max(map(len, members)), max(map(len, samples))
        rows, there = np.zeros((n, m), dtype=np.int64), np.zeros((n, m))
        makes, electrode = np.zeros((n, m, s)), np.zeros((n, s), dtype=np.int64)
        for d, (own, read) in enumerate(zip(members, samples, strict=True)):
            rows[d, : len(own)], there[d, : len(own)] = own, 1.0
            electrode[d, : len(read)] = scan.sample_electrode[read]
            for k, row in enumerate(own):
                makes[d, k, scan.plus[row] - read[0]] = 1.0
                makes[d, k, scan.minus[row] - read[0]] = -1.0
        return cls(rows, there, makes, electrode)

    @cached_property
    def shared(self) -> tuple[FloatArray, FloatArray]:
        """(n_drives, m) eigenvalues and (n_drives, m, m) eigenvectors of the correlation of rows
        whose samples waver independently and alike."""
        values, vectors = np.linalg.eigh(self.makes @ self.makes.swapaxes(1, 2) / 2)
        return np.maximum(values, 0.0), vectors

    def cut(self, matrix: FloatArray) -> FloatArray:
        """(n_drives, m, m) blocks of a matrix (n_meas, n_meas); zero where padded."""
        both = self.there[:, :, None] * self.there[:, None, :]
        return np.asarray(matrix[self.rows[:, :, None], self.rows[:, None, :]] * both)

    def joined(self, blocks: FloatArray) -> FloatArray:
        """(n_meas, n_meas) of blocks, zero between them."""
        n = int(self.there.sum())
        matrix = np.zeros((n, n))
        for rows, there, block in zip(self.rows, self.there > 0, blocks, strict=True):
            own = rows[there]
            matrix[np.ix_(own, own)] = block[np.ix_(there, there)]
        return matrix


def target(blocks: Blocks, scatter: FloatArray, frames: int) -> Generator[None, None, FloatArray]:
    """(n_meas, n_meas) V²: the likelier structure for a ``scatter`` (n_meas, n_meas) of frames; a
    piece of work between two yields.

    Either rows differ in variance, and neighbours share a part of it; or electrodes differ, and
    every row has some noise of its own. The second has far fewer parameters: Akaike (1974).
    """
    own = blocks.cut(scatter)
    by_row, row_cost = _by_row(blocks, own, np.diag(scatter), frames)
    by_electrode, electrode_cost = yield from _by_electrode(blocks, own, frames)
    return blocks.joined(by_row if row_cost <= electrode_cost else by_electrode)


def _by_row(
    blocks: Blocks, own: FloatArray, variance: FloatArray, frames: int
) -> tuple[FloatArray, float]:
    """Correlation (1 − ρ) 1 + ρ · shared between rows of their own variances."""
    drawn, parameters = drawn_together(variance, frames)
    size = np.where(blocks.there > 0, np.sqrt(drawn[blocks.rows]), 1.0)
    values, vectors = blocks.shared
    turned = vectors.swapaxes(1, 2) @ (own / size[:, :, None] / size[:, None, :]) @ vectors
    seen = np.maximum(np.einsum("dii->di", turned), 0.0)
    expected = np.maximum(1 - _SHARED[:, None, None] * (1 - values), _LEAST)
    # directions of rows that follow from others, or of padding, say nothing
    says = (values > _LEAST) | (seen > _LEAST)
    fit = np.where(says, np.log(expected) + seen / expected, 0.0).sum(axis=(1, 2))
    best = int(fit.argmin())
    block = (vectors * expected[best][:, None, :]) @ vectors.swapaxes(1, 2)
    block *= size[:, :, None] * size[:, None, :]
    logs = np.log(drawn).sum()
    return block, frames * float(fit[best] + logs) + 2 * (parameters + 1)


def _by_electrode(
    blocks: Blocks, own: FloatArray, frames: int
) -> Generator[None, None, tuple[FloatArray, float]]:
    """Samples with the variance of their electrode, rows with one of their own.

    Variance components by steps that never fall below zero (Zhou, Hu, Qiao & Yau 2015).
    """
    n = int(blocks.electrode.max()) + 1
    read = np.abs(blocks.makes).sum(axis=1) > 0
    level = float(np.einsum("dii->", own) / blocks.there.sum())
    sample, row = np.full(n, level / 4), level / 2
    empty = np.eye(own.shape[1]) * (1 - blocks.there)[:, :, None]
    for step in range(_STEPS):
        if step % _ABREAST == 0:
            yield
        block = _components(blocks, sample, row) + empty
        inverse: FloatArray = np.asarray(np.linalg.inv(block), dtype=np.float64)
        explained: FloatArray = np.asarray(inverse @ own @ inverse, dtype=np.float64)
        seen, expected = (_by_sample(blocks, part, read, n) for part in (explained, inverse))
        sample = np.clip(sample * _bounded(seen, expected), _LEAST * level, level / _LEAST)
        there = blocks.there
        both = (np.einsum("dii,di->", part, there) for part in (explained, inverse))
        row = max(row * float(_bounded(*both)), _LEAST * level)
    block = _components(blocks, sample, row) + empty
    fit = np.linalg.slogdet(block)[1].sum() + np.einsum("dij,dji->", np.linalg.inv(block), own)
    return _components(blocks, sample, row), frames * float(fit) + 2 * (n + 1)


def _by_sample(blocks: Blocks, part: FloatArray, read: NDArray[np.bool_], n: int) -> FloatArray:
    """(n,) sums of aᵀ · part · a over what each electrode's samples do to the rows."""
    sums = np.einsum("dis,dij,djs->ds", blocks.makes, part, blocks.makes)
    return np.asarray(np.bincount(blocks.electrode[read], sums[read], n), dtype=np.float64)


def _bounded(seen: FloatArray, expected: FloatArray) -> FloatArray:
    """By how much a variance is to change in one step."""
    return np.asarray(np.clip(seen / np.maximum(expected, np.finfo(float).tiny), 0.25, 4.0))


def _components(blocks: Blocks, sample: FloatArray, row: float) -> FloatArray:
    weighed = blocks.makes * sample[blocks.electrode][:, None, :]
    alone = row * np.eye(blocks.makes.shape[1]) * blocks.there[:, :, None]
    return np.asarray(weighed @ blocks.makes.swapaxes(1, 2) + alone)


def drawn_together(variance: FloatArray, frames: int) -> tuple[FloatArray, float]:
    """(n,) variances of rows, and how many of them are free.

    Logarithms of sample variances are nearly normal about the true ones, by ψ′(ν/2) wide; they are
    drawn towards their median as far as they do not spread more than that (empirical Bayes),
    but one that stands out stays there (limited translation: Efron & Morris 1972).
    """
    half = max(frames, 2) / 2
    wide = float(polygamma(1, half))
    logs = np.log(np.maximum(variance, np.finfo(float).tiny)) - (digamma(half) - np.log(half))
    middle = np.median(logs)
    away = logs - middle
    spread = (1.4826 * float(np.median(np.abs(away)))) ** 2
    free = max(spread - wide, 0.0) / max(spread, wide)
    kept = np.maximum(free * np.abs(away), np.abs(away) - _FAR * np.sqrt(wide))
    parameters = 1 + free * len(away)
    return np.exp(middle + np.sign(away) * kept), float(parameters)
