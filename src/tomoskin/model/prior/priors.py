"""Priors: what is held to be likely before there are data.

A prior is a small frozen object. On a mesh, with the Jacobian of the difference data, it becomes
a penalty xᵀQx. Its fields made by ``key`` are parameters that a skin file may set. A sharp prior is
for images with edges, or with few changed cells: its cost is not quadratic.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, issparse

from tomoskin.core import FloatArray, ModelError, check_positive, no_such
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior.penalty import Diagonal, Penalty, dense_penalty, sparse_penalty
from tomoskin.model.prior.smooth import GaussianHighPass, Laplace, Matern, graph_laplacian
from tomoskin.model.section import Number, key


class Prior(Protocol):
    """Anything that becomes a penalty on a mesh."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``; ``jacobian`` (n_meas, n_cells) is that of the difference data."""


@dataclass(frozen=True)
class Identity:
    """The identity, Q = I (Tikhonov)."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The matrix Q for the cells of ``mesh``."""
        del jacobian
        return Diagonal(np.ones(len(mesh.cells)))


@dataclass(frozen=True)
class Noser:
    """Q = diag(Σ_rows |J|²)^exponent (Cheney et al. 1990); 0.5 as in EIDORS.

    An exponent of 0 is the identity; 1 raises the inner cells to the sensitivity of the rim.
    """

    exponent: float = key(
        Number(0, 2),
        "The power of a cell's sensitivity by which its change is penalised.",
        default=0.5,
    )

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The matrix Q for the cells of ``mesh``."""
        del mesh
        power = np.einsum("mc,mc->c", jacobian, jacobian.conj()).real
        return Diagonal(np.asarray(power**self.exponent))


@dataclass(frozen=True)
class SharpPrior(ABC):
    """A cost 2 Σ wᵢ (√(tᵢ² + β²) − β) of an image, whose quadratic follows the image.

    Attributes
    ----------
    smoothing
        β, in the image's unit: what is below it costs little, as in a quadratic cost.
    """

    smoothing: float = 0.01

    @abstractmethod
    def terms(self, mesh: Mesh, image: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weights w (n,), and what of ``image`` (n_cells,) they weigh, t (n,)."""

    @abstractmethod
    def of_weights(self, mesh: Mesh, weights: FloatArray) -> Penalty:
        """The penalty Σ wᵢ tᵢ² of an image."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The quadratic at an image of nothing, with which an iteration begins."""
        return self.touching(mesh, np.zeros(jacobian.shape[1]))

    def touching(self, mesh: Mesh, image: FloatArray) -> Penalty:
        """The quadratic that touches the cost at ``image`` (n_cells,)."""
        weights, sizes = self.terms(mesh, image)
        return self.of_weights(mesh, weights / np.sqrt(sizes**2 + self._beta**2))

    def energy(self, mesh: Mesh, image: FloatArray) -> float:
        """The cost of ``image``, in the units of xᵀQx."""
        weights, sizes = self.terms(mesh, image)
        return float(2.0 * weights @ (np.sqrt(sizes**2 + self._beta**2) - self._beta))

    @property
    def _beta(self) -> float:
        check_positive(self.smoothing, "a smoothing")
        return self.smoothing


class TotalVariation(SharpPrior):
    """Twice the jumps between cells times the length of their edges; zero for a constant.

    Total variation of an image that is constant on the cells (Borsic et al. 2010), relative to
    the root of the domain's content, so that alpha does not depend on the unit of length.
    Differences below ``smoothing`` are smoothed, larger ones are edges.
    """

    def terms(self, mesh: Mesh, image: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The edges between neighbours, and the jumps across them."""
        first, second = mesh.neighbours.T
        return _edges(mesh), np.asarray(image[first] - image[second])

    def of_weights(self, mesh: Mesh, weights: FloatArray) -> Penalty:
        """The weighted graph Laplacian."""
        return sparse_penalty(graph_laplacian(mesh, weights))


class Sparse(SharpPrior):
    """L1 of the image: few cells differ from the background.

    The weight is the cell's share of the domain, so that a finer mesh holds the same image.
    """

    def terms(self, mesh: Mesh, image: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The shares of the cells, and their values."""
        return mesh.volumes / mesh.volumes.sum(), image

    def of_weights(self, mesh: Mesh, weights: FloatArray) -> Penalty:
        """The diagonal matrix of the weights."""
        del mesh
        return Diagonal(weights)


def _edges(mesh: Mesh) -> FloatArray:
    """(n_pairs,) size of the facet that two neighbours share, over that of the domain."""
    first, second = (mesh.cells[cells] for cells in mesh.neighbours.T)
    common = (first[:, :, None] == second[:, None, :]).any(axis=2)
    d, shared = mesh.dimension, first[common].reshape(len(first), -1)
    return np.asarray(mesh.facet_sizes(shared) / mesh.volumes.sum() ** ((d - 1) / d))


PriorLike = str | Prior | Any
"""A name, a prior, or a matrix Q of the caller's own: dense, sparse or a diagonal."""

PRIORS: dict[str, Prior] = {
    "identity": Identity(),
    "laplace": Laplace(),
    "gaussian": GaussianHighPass(),
    "noser": Noser(),
    "exponential": Matern(smoothness=0.5),
    "matern": Matern(smoothness=1.5),
}
"""Priors by the name that a skin file uses; its keys, their bounds and the page's form follow."""

_UNEQUAL = 1e-9
"""Part of the largest value by which two values of a symmetric matrix may differ."""


def penalty_of(prior: PriorLike, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
    """Penalty of a prior by name, of a prior, or of a matrix of the caller's own, checked.

    Raises
    ------
    ModelError
        When the name is not known, the shape does not fit the mesh, a value is not finite, or
        Q is not symmetric and positive semi-definite.
    """
    if isinstance(prior, str):
        if prior not in PRIORS:
            raise ModelError(no_such(prior, PRIORS, "a prior"))
        prior = PRIORS[prior]
    if hasattr(prior, "penalty"):
        penalty: Penalty = prior.penalty(mesh, jacobian)
        return penalty
    return _of_matrix(prior, len(mesh.cells))


def _of_matrix(given: Any, n: int) -> Penalty:
    value: Any = given  # which issparse would narrow to a class without members
    if issparse(given):
        table = coo_array(value)
        _check_shape(table.shape, n)
        _check_finite(table.data, table.row)
        _check_symmetric(csr_array(table))
        return sparse_penalty(csr_array(table).astype(np.float64))
    matrix = np.asarray(value, dtype=np.float64)
    _check_shape(matrix.shape, n)
    _check_finite(matrix, np.arange(n))
    if matrix.ndim > 1:
        _check_symmetric(csr_array(matrix))
    return Diagonal(matrix) if matrix.ndim == 1 else dense_penalty(matrix)


def _check_shape(shape: tuple[int, ...], n: int) -> None:
    if shape not in ((n,), (n, n)):
        raise ModelError(f"expected a prior of shape ({n}, {n}), got {shape}")


def _check_symmetric(matrix: csr_array) -> None:
    largest, apart = np.abs(matrix.data).max(initial=0.0), coo_array(matrix - matrix.T)
    bad = np.flatnonzero(np.abs(apart.data) > _UNEQUAL * largest)
    if len(bad):
        raise ModelError(
            f"expected a symmetric prior, got two values that differ by {apart.data[bad[0]]:.3g}",
            where=f"prior, cells {apart.row[bad[0]]} and {apart.col[bad[0]]}",
        )


def _check_finite(values: FloatArray, cells: NDArray[Any]) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        cell = int(cells[np.argwhere(~finite)[0, 0]])
        raise ModelError("expected finite numbers, got others", where=f"prior, cell {cell}")
