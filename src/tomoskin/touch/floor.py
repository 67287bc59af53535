"""What measurement noise alone does to an image: the floor under every touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Measurement noise as it stands in the images of one mesh.

    ``spread`` (n_cells, k): spread · spreadᵀ is the image's covariance; ``sd`` (n_cells,) the
    square root of its diagonal; ``mesh_id`` names the mesh. Single precision is plenty for a
    deviation, and half to read.
    """

    spread: NDArray[np.float32]
    sd: FloatArray
    mesh_id: str

    @classmethod
    def of(cls, spread: FloatArray, mesh_id: str) -> Self:
        """Floor of that ``spread``: of an operator, its matrix times each row's deviation."""
        sd = np.sqrt(np.einsum("cm,cm->c", spread, spread))
        return cls(spread.astype(np.float32, order="C"), sd, mesh_id)  # rows are taken one by one

    def sd_of(self, cells: IntArray, lever: FloatArray) -> FloatArray:
        """Standard deviation, (k,), of Σ lever · image over ``cells`` (n,), ``lever`` (n, k)."""
        moved = lever.T.astype(np.float32) @ self.spread.take(cells, axis=0)
        return np.asarray(np.sqrt(np.einsum("km,km->k", moved, moved)), dtype=np.float64)
