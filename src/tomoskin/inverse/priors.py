"""Prior matrices Q of the one-step operator.

A prior is a function of the mesh and the Jacobian that returns Q: a vector is a diagonal
matrix; otherwise a sparse or dense symmetric one, (n_cells, n_cells).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, issparse

from tomoskin.core import FloatArray, ModelError
from tomoskin.mesh import Mesh

Prior = Callable[[Mesh, FloatArray], Any]

NOSER_EXPONENT = 0.5
GAUSSIAN_DIAMETER = 0.1
"""Width of the Gaussian high-pass prior, as a fraction of the mesh's largest extent."""


def identity(mesh: Mesh, jacobian: FloatArray) -> FloatArray:
    """Q = I (Tikhonov)."""
    del jacobian
    return np.ones(len(mesh.cells))


def noser(mesh: Mesh, jacobian: FloatArray) -> FloatArray:
    """Q = diag(Σ_rows J²)^0.5 (Cheney et al. 1990; the exponent as in EIDORS)."""
    del mesh
    return np.asarray(np.einsum("mc,mc->c", jacobian, jacobian) ** NOSER_EXPONENT)


def laplace(mesh: Mesh, jacobian: FloatArray) -> csr_array:
    """Q = twice the graph Laplacian of cells that share a facet, as in EIDORS."""
    del jacobian
    first, second = mesh.neighbours.T
    n = len(mesh.cells)
    degree = np.bincount(np.concatenate([first, second]), minlength=n)
    rows = np.concatenate([first, second, np.arange(n)])
    cols = np.concatenate([second, first, np.arange(n)])
    values = np.concatenate([np.full(2 * len(first), -2.0), 2.0 * degree])
    return csr_array(coo_array((values, (rows, cols)), shape=(n, n)))


def gaussian(mesh: Mesh, jacobian: FloatArray) -> FloatArray:
    """Q = FᵀF with F = I − G, a Gaussian high-pass filter (Adler & Guardo 1996).

    G averages with weights area · exp(−4 ln 2 · (distance / width)²), rows summing to one.
    """
    del jacobian
    extent = float(np.ptp(mesh.points, axis=0).max())
    offset = mesh.centroids[:, None, :] - mesh.centroids[None, :, :]
    square = np.einsum("ijd,ijd->ij", offset, offset) / (GAUSSIAN_DIAMETER * extent) ** 2
    weights = mesh.volumes * np.exp(-4.0 * np.log(2.0) * square)
    high_pass = np.eye(len(weights)) - weights / weights.sum(axis=1, keepdims=True)
    return np.asarray(high_pass.T @ high_pass)


PRIORS: dict[str, Prior] = {
    "identity": identity,
    "laplace": laplace,
    "gaussian": gaussian,
    "noser": noser,
}
"""Priors by the name that a skin file uses."""


def prior_matrix(prior: Any, mesh: Mesh, jacobian: FloatArray) -> NDArray[Any]:
    """Q by name, or a matrix of the caller's own (dense, sparse or a diagonal), checked.

    Returns
    -------
    (n_cells,) for a diagonal Q, else dense (n_cells, n_cells).

    Raises
    ------
    ModelError
        When the name is not known, the shape does not fit the mesh, or a value is not finite.
    """
    n = len(mesh.cells)
    if isinstance(prior, str):
        if prior not in PRIORS:
            raise ModelError(f'expected a prior among {", ".join(PRIORS)}, got "{prior}"')
        prior = PRIORS[prior](mesh, jacobian)
    value: Any = prior
    matrix = np.asarray(value.toarray() if issparse(prior) else value, dtype=np.float64)
    if matrix.shape not in ((n,), (n, n)):
        raise ModelError(f"expected a prior of shape ({n}, {n}), got {matrix.shape}")
    finite = np.isfinite(matrix)
    if not finite.all():
        cell = int(np.argwhere(~finite)[0, 0])
        raise ModelError("expected finite numbers", where=f"prior, cell {cell}")
    return matrix
