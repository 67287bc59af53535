"""Cells that cover the same place twice, which a mesh in a file may hold without being damaged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.triangles import near_cells, paired_facets

_DEEP = 1e-6
"""Cells that are farther into each other, as a part of the smaller one's size, overlap."""


def check_overlaps(points: FloatArray, cells: IntArray) -> None:
    """Raise GeometryError that names two cells that overlap.

    Tetrahedra are compared with those that they share a facet with; triangles with all others that
    lie in their plane.
    """
    if cells.shape[1] == 4:
        pairs = paired_facets(cells)[0]
        _refuse(points, cells, pairs, _same_side(points, cells, pairs))
        return
    corner = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))[cells]
    sides = _Sides.of(corner)
    for pairs in near_cells(points, cells):
        _refuse(points, cells, pairs, sides.overlap(pairs))


def _refuse(points: FloatArray, cells: IntArray, pairs: IntArray, bad: NDArray[np.bool_]) -> None:
    if bad.any():
        a, b = sorted(pairs[int(np.argmax(bad))].tolist())
        middle = ", ".join(f"{1e3 * x:.4g}" for x in points[cells[a]].mean(axis=0))
        raise GeometryError(
            f"{np.count_nonzero(bad)} pairs of cells overlap, the first near ({middle}) mm",
            where=f"cells {a} and {b}",
            hint="repair it in a mesh program: each place belongs to one cell",
        )


def _same_side(points: FloatArray, cells: IntArray, pairs: IntArray) -> NDArray[np.bool_]:
    """(n,) whether two tetrahedra lie on the same side of the facet that they share."""
    one, other = cells[pairs[:, 0]], cells[pairs[:, 1]]
    shared = (one[:, :, None] == other[:, None, :]).any(axis=2)
    tip = one[~shared]
    far = other[~(other[:, :, None] == one[:, None, :]).any(axis=2)]
    a, b, c = np.moveaxis(points[one[shared].reshape(-1, 3)], 1, 0)
    normal = np.cross(b - a, c - a)
    heights = [((points[p] - a) * normal).sum(axis=1) for p in (tip, far)]
    return np.asarray(heights[0] * heights[1] > 0)


@dataclass(frozen=True, eq=False)
class _Sides:
    """Triangles ``corner`` (n, 3, 3) with a unit ``normal`` (n, 3), what of each side points
    ``outward`` (n, 3, 3) in its plane, and their ``size`` (n,): the longest side."""

    corner: FloatArray
    normal: FloatArray
    outward: FloatArray
    size: FloatArray

    @classmethod
    def of(cls, corner: FloatArray) -> Self:
        along = np.roll(corner, -1, axis=1) - corner
        normal = np.cross(along[:, 0], along[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        outward = np.cross(along, normal[:, None])
        outward /= np.linalg.norm(outward, axis=2, keepdims=True)
        return cls(corner, normal, outward, np.linalg.norm(along, axis=2).max(axis=1))

    def overlap(self, pairs: IntArray) -> NDArray[np.bool_]:
        """(n,) whether two triangles of one plane share more than their rims: all corners of one
        lie beyond no side of the other (separating axes, Gottschalk et al., SIGGRAPH 1996)."""
        one, other = pairs.T
        deep = _DEEP * np.minimum(self.size[one], self.size[other])
        rise = np.einsum("ncd,nd->nc", self.corner[other] - self.corner[one, :1], self.normal[one])
        level = np.flatnonzero(np.abs(rise).max(axis=1) <= deep)
        parted = np.ones(len(pairs), dtype=bool)
        parted[level] = self._beyond(one[level], other[level], deep[level])
        parted[level] |= self._beyond(other[level], one[level], deep[level])
        return np.asarray(~parted)

    def _beyond(self, one: IntArray, other: IntArray, deep: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether all of ``other`` is beyond a side of ``one``."""
        reach = self.outward[one] @ self.corner[other].swapaxes(1, 2)
        own = (self.outward[one] * self.corner[one]).sum(axis=2)
        return np.asarray((reach.min(axis=2) - own >= -deep[:, None]).any(axis=1))
