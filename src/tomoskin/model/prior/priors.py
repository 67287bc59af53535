"""Priors: what is held to be likely before there are data.

A prior is a small frozen object. On a mesh, with the Jacobian of the difference data, it becomes
a penalty xᵀQx. Its fields made by ``key`` are parameters that a skin file may set.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, issparse

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior.penalty import Diagonal, Penalty, dense_penalty, sparse_penalty
from tomoskin.model.prior.smooth import GaussianHighPass, Laplace, Matern
from tomoskin.model.section import Number, key


class Prior(Protocol):
    """Anything that becomes a penalty on a mesh."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``; ``jacobian`` (n_meas, n_cells) is that of the difference data."""
        ...


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


def penalty_of(prior: PriorLike, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
    """Penalty of a prior by name, of a prior, or of a matrix of the caller's own, checked.

    Raises
    ------
    ModelError
        When the name is not known, the shape does not fit the mesh, a value is not finite, or
        Q is not positive semi-definite.
    """
    if isinstance(prior, str):
        if prior not in PRIORS:
            raise ModelError(f'expected a prior among {", ".join(PRIORS)}, got "{prior}"')
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
        return sparse_penalty(csr_array(table).astype(np.float64))
    matrix = np.asarray(value, dtype=np.float64)
    _check_shape(matrix.shape, n)
    _check_finite(matrix, np.arange(n))
    return Diagonal(matrix) if matrix.ndim == 1 else dense_penalty(matrix)


def _check_shape(shape: tuple[int, ...], n: int) -> None:
    if shape not in ((n,), (n, n)):
        raise ModelError(f"expected a prior of shape ({n}, {n}), got {shape}")


def _check_finite(values: FloatArray, cells: NDArray[Any]) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        cell = int(cells[np.argwhere(~finite)[0, 0]])
        raise ModelError("expected finite numbers, got others", where=f"prior, cell {cell}")
