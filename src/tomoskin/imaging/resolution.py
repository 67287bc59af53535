"""What data can tell and what not: the map of what they leave open, and the Picard plot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging.linear.linear_problem import LinearProblem
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.linear.spectrum import Spectrum
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior import Diagonal

_BLOCK = 256
"""Discs that the prior is asked of at a time."""


def unresolved(
    operator: Operator, problem: LinearProblem, alpha: float, radius: float
) -> FloatArray:
    """(n_cells,) part of a change that one frame leaves open about each cell, 0 to 1.

    The change is the mean of the conductivity over a disc of ``radius`` m. Before the data its
    variance is the prior's; after them it is the expected square of the image's error, by the
    noise and the prior that ``alpha`` stands for. The value is the second over the first. Of the
    prior's free images, which have no variance before, only the error counts.

    ``operator`` may exclude measurements of the problem. Nothing here depends on a frame.

    Raises
    ------
    ModelError
        When operator and problem are not of one mesh, pattern and difference, and for a radius
        that is not above 0.
    """
    _check_pair(operator, problem)
    if not radius > 0:
        raise ModelError(f"expected a radius above 0 m, got {radius:g} m")
    discs = disc_means(problem.model.mesh, radius)
    spread, gram = problem.carried
    data = gram + np.diag(alpha**2 / problem.weights)  # covariance of the data
    prior = _prior_variance(problem, discs)
    image, shared = discs @ operator.matrix, discs @ spread
    explained = 2 * _products(image, shared) - _products(image @ data, image)
    return np.asarray(np.clip(1.0 - explained / prior, 0.0, 1.0))


def disc_means(mesh: Mesh, radius: float) -> csr_array:
    """(n_cells, n_cells) means by area over the cells within ``radius`` m of each, its own too."""
    tree = cKDTree(mesh.centroids)
    near = tree.query_ball_tree(tree, radius)
    row = np.repeat(np.arange(len(near)), [len(cells) for cells in near])
    column = np.concatenate(near)
    area = np.bincount(row, mesh.volumes[column])
    return csr_array((mesh.volumes[column] / area[row], (row, column)))


def _prior_variance(problem: LinearProblem, discs: csr_array) -> FloatArray:
    """(n_discs,) diagonal of AQ⁻¹Aᵀ for the means A."""
    prior = problem.prior
    if isinstance(prior, Diagonal):
        return np.asarray(discs.power(2) @ (1.0 / prior.matrix))
    blocks = (discs[k : k + _BLOCK].toarray() for k in range(0, discs.shape[0], _BLOCK))
    return np.concatenate([np.diag(prior.carry(block)[1]) for block in blocks])


def _products(one: NDArray[Any], other: NDArray[Any]) -> FloatArray:
    """(n,) real part of the product of each row with the other's."""
    return np.asarray(np.einsum("nm,nm->n", one, other.conj()).real)


def _check_pair(operator: Operator, problem: LinearProblem) -> None:
    one, other = (
        (part.model.mesh.identity, part.model.pattern.identity, part.difference)
        for part in (operator, problem)
    )
    if one != other:
        raise ModelError(
            "expected operator and problem of one mesh, pattern and kind of difference, got "
            f"{', '.join(one)} and {', '.join(other)}"
        )


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
