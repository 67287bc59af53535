"""How good a mesh's triangles are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray, GeometryError
from tomoskin.mesh.mesh import Mesh


@dataclass(frozen=True, slots=True)
class Quality:
    """Shape of a mesh's triangles: 2·inradius/circumradius, 1 for equilateral ones."""

    minimum: float
    mean: float
    n_cells: int
    n_points: int


def quality(mesh: Mesh) -> Quality:
    """Smallest and mean triangle quality of ``mesh``; raises GeometryError for tetrahedra."""
    if mesh.dimension != 2:
        raise GeometryError(f"expected triangles, got cells of dimension {mesh.dimension}")
    each = triangle_quality(mesh.points[mesh.cells])
    return Quality(float(each.min()), float(each.mean()), len(mesh.cells), len(mesh.points))


def triangle_quality(corners: FloatArray) -> FloatArray:
    """(n,) 2·inradius/circumradius = (b+c−a)(c+a−b)(a+b−c)/(abc) of triangles (n, 3, d)."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    a, b, c = sides.T
    return np.asarray((b + c - a) * (c + a - b) * (a + b - c) / (a * b * c))
