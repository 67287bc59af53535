"""What measurement noise alone does to an image: the floor under every touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Measurement noise carried through a linear operator.

    ``spread`` (n_cells, n_meas): the operator times each row's standard deviation, so that
    spread · spreadᵀ is the image's covariance for independent noise; ``sd`` (n_cells,) the
    square root of its diagonal. Single precision is plenty for a deviation, and half to read.
    """

    spread: NDArray[np.float32]
    sd: FloatArray

    @classmethod
    def of(cls, operator: FloatArray, noise: FloatArray) -> Self:
        """Floor of ``operator`` (n_cells, n_meas) under ``noise`` (n_meas,) of its input."""
        spread = operator * noise
        sd = np.sqrt(np.einsum("cm,cm->c", spread, spread))
        return cls(spread.astype(np.float32, order="C"), sd)  # rows are taken one by one

    def sd_of(self, cells: IntArray, lever: FloatArray) -> FloatArray:
        """Standard deviation, (k,), of Σ lever · image over ``cells`` (n,), ``lever`` (n, k)."""
        moved = lever.T.astype(np.float32) @ self.spread.take(cells, axis=0)
        return np.asarray(np.sqrt(np.einsum("km,km->k", moved, moved)), dtype=np.float64)
