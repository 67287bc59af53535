"""Smooth-covariance priors: how alike two places are, by their distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import inv
from scipy.spatial.distance import cdist

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.penalty import Carried, Penalty
from tomoskin.mesh import Mesh

DEFAULT_LENGTH = 0.1
"""Correlation length, as a fraction of the mesh's largest extent, where none is given."""

_BLOCK = 256
"""Rows of the covariance that are in memory at a time."""

CORRELATIONS: dict[float, Callable[[FloatArray], FloatArray]] = {
    0.5: lambda s: np.exp(-s),
    1.5: lambda s: (1.0 + s) * np.exp(-s),
    2.5: lambda s: (1.0 + s + s * s / 3.0) * np.exp(-s),
}
"""Matérn correlation by smoothness ν, of s = √(2ν) · distance / length."""


@dataclass(frozen=True)
class Matern:
    """Q⁻¹ = C, the Matérn covariance of the cells' centres (Rasmussen & Williams 2006, 4.16, 4.17).

    An image is held to be a random field of unit deviation that is alike over ``length``. In the
    space of the measurements C is used as it is, never inverted. Distances are taken in space,
    on a curved sheet too.

    Attributes
    ----------
    length
        Correlation length, m; without it a tenth of the mesh's largest extent.
    smoothness
        ν: 0.5, exponential, with sharp changes; 1.5, once, and 2.5, twice differentiable.
    """

    length: float | None = None
    smoothness: float = 1.5

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """Return Q on ``mesh``. Raises ModelError for an impossible length or smoothness."""
        del jacobian
        length = self.length
        if length is None:
            length = DEFAULT_LENGTH * float(np.ptp(mesh.points, axis=0).max())
        if not (np.isfinite(length) and length > 0):
            raise ModelError(f"expected a correlation length above 0 m, got {length}")
        if self.smoothness not in CORRELATIONS:
            known = ", ".join(map(str, CORRELATIONS))
            raise ModelError(f"expected a smoothness among {known}, got {self.smoothness}")
        scale = np.sqrt(2.0 * self.smoothness) / length
        return _Covariance(scale * mesh.centroids, CORRELATIONS[self.smoothness])


@dataclass(frozen=True, eq=False)
class _Covariance:
    """A covariance that is a function of distance between ``places`` (n_cells, d)."""

    places: FloatArray
    correlation: Callable[[FloatArray], FloatArray]

    @property
    def free(self) -> FloatArray:
        """No image is free."""
        return np.empty((len(self.places), 0))

    @property
    def matrix(self) -> FloatArray:
        """Q = C⁻¹, dense."""
        return np.asarray(inv(self.correlation(cdist(self.places, self.places))))

    def carry(self, jacobian: NDArray[Any]) -> Carried:
        """CJᴴ and JCJᴴ, a block of rows at a time: C itself would be the largest array of all."""
        columns = jacobian.conj().T
        spread = np.empty(columns.shape, columns.dtype, order="F")
        for start in range(0, len(self.places), _BLOCK):
            rows = slice(start, start + _BLOCK)
            spread[rows] = self.correlation(cdist(self.places[rows], self.places)) @ columns
        return spread, jacobian @ spread
