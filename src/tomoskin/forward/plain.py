"""The engine of scipy and numpy: runs everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray
from tomoskin.forward.factor import Compressed, Factorise, factorise
from tomoskin.forward.patches import BaseState, Patches
from tomoskin.forward.plain_patches import PlainPatches
from tomoskin.pattern import Pattern


@dataclass(frozen=True)
class Scipy:
    """SuperLU, sparse products and einsum."""

    reason: str
    name: str = "scipy"

    def analyse(
        self,
        indptr: NDArray[np.int32],
        indices: NDArray[np.int32],
    ) -> Factorise:
        """See :class:`Engine`; SuperLU keeps no analysis."""
        return lambda values: factorise(Compressed(values, indices, indptr).matrix)

    def residual(
        self, matrix: Compressed, rhs: NDArray[Any], solution: NDArray[Any]
    ) -> tuple[NDArray[Any], float]:
        """See :class:`Engine`."""
        left = rhs - matrix.matrix @ solution
        return solution.T @ left, float(np.abs(left).max())

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """See :class:`Engine`."""
        out[...] = (operator @ vectors).T

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """See :class:`Engine`."""
        out = np.empty((pattern.n_meas, gradient.shape[-1]), dtype=gradient.dtype)
        for drive, (source, sink) in enumerate(pattern.drives):
            rows = np.flatnonzero(pattern.drive_index == drive)
            driven = current[drive] * (gradient[sink] - gradient[source])
            plus, minus = pattern.measure[rows].T
            projected = np.einsum("edc,dc->ec", gradient, driven)
            out[rows] = projected[plus] - projected[minus]
        return out

    def patches(self, base: BaseState) -> Patches:
        """See :class:`Engine`."""
        return PlainPatches(base)
