"""Priors that punish the difference of neighbours: Laplace, and Laplace cut along regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.penalty import Penalty, sparse_penalty
from tomoskin.mesh import Mesh

LEAST_COUPLING = 1e-6
"""A coupling below this costs digits; zero, which cuts, does not."""


@dataclass(frozen=True)
class Laplace:
    """Q = twice the graph Laplacian of cells that share a facet, as in EIDORS."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``."""
        del jacobian
        return sparse_penalty(_laplacian(mesh, np.full(len(mesh.neighbours), 2.0)))


@dataclass(frozen=True, eq=False)
class Structural:
    """Laplace with weaker couplings between regions: an image may jump along their edges.

    As EIDORS and others take anatomy or a design into account (Kaipio et al. 1999): smooth
    within a region, nearly free between two. Where a region is, not what it holds, is said.

    Attributes
    ----------
    labels
        (n_cells,) whole numbers: cells with the same number are one region.
    coupling
        Weight of a difference across an edge, from 0, which cuts, to 1, which is Laplace;
        not between 0 and 1e-6.
    """

    labels: ArrayLike
    coupling: float = 0.01

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``. Raises ModelError for labels or a coupling that do not fit."""
        del jacobian
        labels = np.asarray(self.labels)
        if labels.shape != (len(mesh.cells),) or labels.dtype.kind not in "biu":
            raise ModelError(
                f"expected one whole number for each of {len(mesh.cells)} cells, "
                f"got {labels.dtype} of shape {labels.shape}",
                where="labels of the structural prior",
            )
        if not (self.coupling == 0 or LEAST_COUPLING <= self.coupling <= 1):
            raise ModelError(
                f"expected 0, or from {LEAST_COUPLING:g} to 1, got {self.coupling}",
                where="coupling of the structural prior",
            )
        first, second = labels[mesh.neighbours].T
        return sparse_penalty(_laplacian(mesh, np.where(first == second, 2.0, 2.0 * self.coupling)))


def _laplacian(mesh: Mesh, coupling: FloatArray) -> csr_array:
    """(n_cells, n_cells) with −``coupling`` (n_pairs,) for neighbours; rows sum to zero."""
    first, second = mesh.neighbours.T
    n = len(mesh.cells)
    ends = np.concatenate([first, second])
    degree = np.bincount(ends, np.tile(coupling, 2), n)
    rows = np.concatenate([ends, np.arange(n)])
    cols = np.concatenate([second, first, np.arange(n)])
    values = np.concatenate([np.tile(-coupling, 2), degree])
    matrix = csr_array(coo_array((values, (rows, cols)), shape=(n, n)))
    matrix.eliminate_zeros()  # a coupling of zero is no connection
    return matrix
