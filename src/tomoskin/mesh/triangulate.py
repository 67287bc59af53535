"""The mesher: an outline and electrodes in, a graded mesh of the wanted size out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.mesh.arcs import ElectrodeArc, check_arcs
from tomoskin.mesh.boundary import Boundary, discretise
from tomoskin.mesh.mesh import Mesh
from tomoskin.mesh.outline import Outline
from tomoskin.mesh.seed import inner_points
from tomoskin.mesh.sizing import SizeField
from tomoskin.mesh.smooth import smoothed, triangles

_TOLERANCE = 0.10
"""Accepted relative miss of the wanted number of cells."""

_ADDED = 0.02
"""Part of the cells that smoothing adds, on average, where it mends points."""


def triangulate(
    outline: Outline, arcs: Sequence[ElectrodeArc], cells: int, *, seed: int = 0
) -> Mesh:
    """Triangles inside ``outline``, about ``cells`` of them, finer towards the electrodes.

    Electrode ends and corners are nodes, every rim node lies on the outline, and the rim
    nodes come first, in counter-clockwise order. Another ``seed`` places the inner points
    elsewhere; the same arguments give the same mesh.

    Raises
    ------
    GeometryError
        When electrodes overlap, nearly touch or do not fit (the message names the electrode),
        or the outline and its electrodes cannot be met with so few cells.
    """
    if cells < 1:
        raise GeometryError(f"expected at least 1 cell, got {cells}")
    check_arcs(outline, arcs)
    rim, inner, field = _sized(outline, arcs, cells, seed)
    inner = smoothed(rim, inner, field)
    table = triangles(rim, inner)
    points = np.concatenate([rim.points, inner])
    return Mesh(points, table, _facets(rim, len(arcs)))


def _sized(
    outline: Outline, arcs: Sequence[ElectrodeArc], cells: int, seed: int
) -> tuple[Boundary, FloatArray, SizeField]:
    """Rim and inner points whose triangulation has the wanted number of cells.

    A triangulation of b rim and n inner points has 2n + b − 2 triangles (Euler), so that the
    size is found before anything is triangulated.
    """
    coarse = math.sqrt(outline.area / cells * 4 / math.sqrt(3))
    best: tuple[float, Boundary, FloatArray, SizeField] | None = None
    for _ in range(12):
        rim = discretise(outline, arcs, coarse)
        field = SizeField(coarse, rim.midpoints, np.minimum(rim.lengths, coarse))
        inner = inner_points(rim, field, np.random.default_rng(seed))
        count = (2 * len(inner) + len(rim.points) - 2) * (1 + _ADDED)
        miss = abs(count / cells - 1)
        if best is None or miss < best[0]:
            best = miss, rim, inner, field
        if miss < _TOLERANCE / 5:
            break
        coarse *= min(max(math.sqrt(count / cells), 0.5), 2.0)
    assert best is not None
    if best[0] > _TOLERANCE:
        least = 2 * len(best[2]) + len(best[1].points) - 2
        raise GeometryError(
            f"{cells} cells cannot resolve this outline and its electrodes",
            hint=f"ask for about {least} cells or more",
        )
    return best[1:]


def _facets(rim: Boundary, n_electrodes: int) -> tuple[IntArray, ...]:
    nodes = np.arange(len(rim.points))
    edges = np.column_stack([nodes, np.roll(nodes, -1)])
    return tuple(edges[rim.owner == number] for number in range(n_electrodes))
