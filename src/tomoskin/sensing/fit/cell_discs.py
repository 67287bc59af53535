"""Cells of an image that lie in a disc."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray
from tomoskin.model.mesh import Mesh

_MARGIN = 1 + 1e-9
"""Rounding of a radius."""


@dataclass(frozen=True, eq=False)
class CellDiscs:
    """Cells along the x axis: a disc meets few of them.

    Attributes
    ----------
    cells
        (n,) their numbers.
    middles
        (n,) m, x + iy.
    """

    cells: IntArray
    middles: NDArray[np.complex128]

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """Of a mesh."""
        x, y = mesh.centroids.T
        order = np.argsort(x, kind="stable")
        return cls(order, (x + 1j * y)[order])

    def within(self, x: float, y: float, radius: float) -> IntArray:
        """(m,) those whose middles are no farther than ``radius`` m from ``x``, ``y`` m, or the
        nearest one."""
        along, reach = self._along, radius * _MARGIN
        near = slice(bisect_left(along, x - reach), bisect_left(along, x + reach))
        found = np.abs(self.middles[near] - complex(x, y)) <= radius
        if found.any():
            return np.asarray(self.cells[near].compress(found))
        away = np.abs(self.middles - complex(x, y))
        return np.asarray(self.cells[away == away.min()])

    @cached_property
    def _along(self) -> list[float]:
        return list(map(float, self.middles.real))
