"""The mesh: points, simplices, and the boundary facets that are electrodes."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray, GeometryError, IntArray


@dataclass(frozen=True, eq=False)
class Mesh:
    """Simplices with electrodes on their boundary.

    Attributes
    ----------
    points
        (n_points, d) m; one more coordinate than the cells' dimension is a curved sheet.
    cells
        (n_cells, k) point indices: 3 a triangle, 4 a tetrahedron; orientation is free.
    electrodes
        One (n_facets, k − 1) array of point indices per electrode.

    Raises
    ------
    GeometryError
        For indices that do not exist, a degenerate cell, an electrode without a facet, a facet
        that is not on the boundary or belongs to two electrodes, or a mesh in pieces.
    """

    points: FloatArray
    cells: IntArray
    electrodes: tuple[IntArray, ...]

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        object.__setattr__(self, "points", _frozen(self.points, np.float64))
        object.__setattr__(self, "cells", _frozen(self.cells, np.int64))
        facets = tuple(_frozen(e, np.int64) for e in self.electrodes)
        object.__setattr__(self, "electrodes", facets)
        from tomoskin.mesh.check import check_mesh  # noqa: PLC0415 - the check reads a Mesh

        check_mesh(self)

    @property
    def dimension(self) -> int:
        """Dimension of the cells: 2 for triangles, 3 for tetrahedra."""
        return self.cells.shape[1] - 1

    @cached_property
    def volumes(self) -> FloatArray:
        """(n_cells,) area of each triangle, m², or volume of each tetrahedron, m³."""
        return simplex_measure(self.points, self.cells)

    @cached_property
    def centroids(self) -> FloatArray:
        """(n_cells, d) m."""
        return np.asarray(self.points[self.cells].mean(axis=1))

    @cached_property
    def neighbours(self) -> IntArray:
        """(n_pairs, 2) cells that share a facet, each pair once."""
        facet, owner = _facets(self.cells)
        order = np.lexsort(facet.T[::-1])
        facet, owner = facet[order], owner[order]
        same = (facet[1:] == facet[:-1]).all(axis=1)
        return np.column_stack([owner[:-1][same], owner[1:][same]])

    @cached_property
    def boundary(self) -> IntArray:
        """(n_facets, k − 1) facets that belong to one cell only."""
        facet, _ = _facets(self.cells)
        unique, counts = np.unique(facet, axis=0, return_counts=True)
        return np.asarray(unique[counts == 1])

    @cached_property
    def identity(self) -> str:
        """Short hash of points, cells and electrodes: images and operators are matched by it."""
        digest = hashlib.sha256()
        for array in (self.points, self.cells, *self.electrodes):
            digest.update(str(array.shape).encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()[:16]


def simplex_measure(points: FloatArray, simplices: IntArray) -> FloatArray:
    """Length, area or volume of each simplex, (n,), from its Gram determinant."""
    corner = points[simplices]
    edges = corner[:, 1:] - corner[:, :1]
    gram = np.einsum("nid,njd->nij", edges, edges)
    k = edges.shape[1]
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(k))


def _facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    k = cells.shape[1]
    corners = [[c for c in range(k) if c != left_out] for left_out in range(k)]
    facet = np.sort(np.concatenate([cells[:, c] for c in corners]), axis=1)
    return facet, np.tile(np.arange(len(cells)), k)


def _frozen(value: object, dtype: type) -> np.ndarray:  # type: ignore[type-arg]
    array = np.array(value, dtype=dtype)
    if array.ndim != 2:
        raise GeometryError(f"expected a table with two axes, got shape {array.shape}")
    array.flags.writeable = False
    return array
