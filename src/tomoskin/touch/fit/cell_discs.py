"""Cells of an image that lie in a disc."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.mesh import Mesh

_MARGIN = 1 + 1e-9
"""Rounding of a radius."""


@dataclass(frozen=True, eq=False)
class CellDiscs:
    """Cells along the x axis: a disc meets few of them.

    Attributes
    ----------
    cells
        (n,) their numbers.
    x, y
        (n,) m, their middles.
    """

    cells: IntArray
    x: FloatArray
    y: FloatArray

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """Of a mesh."""
        x, y = mesh.centroids.T
        order = np.argsort(x, kind="stable")
        return cls(order, x[order], y[order])

    def within(self, x: float, y: float, square: float) -> IntArray:
        """(m,) in order, those whose middles are no farther from ``x``, ``y`` m than the root of
        ``square`` m², or the nearest one."""
        reach = math.sqrt(square) * _MARGIN
        along = self._along
        first, last = bisect_left(along, x - reach), bisect_left(along, x + reach)
        near = slice(first, last)
        found = self.cells[near][self._squares(x, y, near) <= square]
        if len(found):
            found.sort()
            return found
        squares = self._squares(x, y, slice(None))
        return np.sort(self.cells[squares == squares.min()])

    @cached_property
    def _along(self) -> list[float]:
        return list(map(float, self.x))

    def _squares(self, x: float, y: float, part: slice) -> FloatArray:
        along, across = self.x[part] - x, self.y[part] - y
        return np.asarray(along * along + across * across)
