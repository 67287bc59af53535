"""The mesher: an outline and electrodes in, a graded mesh of the wanted size out; its quality."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError, IntArray, reach
from tomoskin.model.mesh.boundary import Boundary, ElectrodeArc, SizeField, check_arcs, discretise
from tomoskin.model.mesh.inner import inner_points, smoothed, triangles
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import Outline

TOLERANCE = 0.10
"""Accepted relative miss of the wanted number of cells."""

GROWTHS = (0.3, 0.5, 0.8, 1.2)
"""Growths of cell size with distance, tried in turn until so few cells will do."""

_SEARCH = 12
"""Sizes tried for one growth."""

_STUCK = 0.01
"""A size that changes the number of cells by less than this, far off it, ends the search."""

_RETRIES = 3
"""Corrections of the wanted number by what smoothing made of it."""

_ADDED = 0.02
"""Part of the cells that smoothing adds, on average, where it mends points."""


def triangulate(
    outline: Outline,
    arcs: Sequence[ElectrodeArc],
    cells: int,
    *,
    seed: int = 0,
    marks: ArrayLike = (),
) -> Mesh:
    """Triangles inside ``outline``, about ``cells`` of them, finer towards the electrodes.

    Electrode ends and corners are nodes, every rim node lies on the outline, and the rim
    nodes come first, in counter-clockwise order. Another ``seed`` puts the inner points
    elsewhere; the same arguments give the same mesh. ``marks`` are further arclengths, m, at
    which the rim has a node.

    Raises
    ------
    GeometryError
        When electrodes overlap, nearly touch or do not fit (the message names the electrode),
        or the outline and its electrodes cannot be met with so few cells.
    """
    if cells < 1:
        raise GeometryError(f"expected at least 1 cell, got {cells}")
    check_arcs(outline, arcs)
    breaks = np.append(outline.corners, np.asarray(marks, dtype=np.float64) % outline.length)
    corners = np.unique(breaks)
    fewest = math.inf
    for growth in GROWTHS:
        target = float(cells)
        for _ in range(_RETRIES):
            plan = _sized(outline, arcs, corners, target, growth=growth, seed=seed)
            inner = smoothed(plan.rim, plan.inner, plan.field)
            table = triangles(plan.rim, inner)
            if abs(len(table) / cells - 1) <= TOLERANCE:
                points = np.concatenate([plan.rim.points, inner])
                return Mesh(points, table, _facets(plan.rim, len(arcs)))
            fewest = min(fewest, len(table))
            if plan.miss > TOLERANCE:
                break  # the wanted number is out of reach: let cells grow faster
            target *= cells / len(table)
    raise GeometryError(
        f"{cells} cells are too few for this outline and its electrodes",
        hint=f"ask for {1.5 * max(fewest, cells):.0f} cells or more",
    )


@dataclass(frozen=True, eq=False)
class _Plan:
    """Rim and inner points before smoothing, and how far they miss the wanted number."""

    rim: Boundary
    inner: FloatArray
    field: SizeField
    miss: float


def _sized(
    outline: Outline,
    arcs: Sequence[ElectrodeArc],
    corners: FloatArray,
    cells: float,
    *,
    growth: float,
    seed: int,
) -> _Plan:
    """Points whose triangulation has about the wanted number of cells.

    A triangulation of b rim and n inner points has 2n + b − 2 triangles (Euler), so that the
    size is found before anything is triangulated.
    """
    coarse = math.sqrt(outline.area / cells * 4 / math.sqrt(3))
    plans: list[_Plan] = []
    last = math.inf
    for turn in range(_SEARCH):
        reach()
        rim = discretise(outline, arcs, corners, coarse, growth)
        field = SizeField(coarse, rim.midpoints, np.minimum(rim.lengths, coarse), growth)
        inner = inner_points(rim, field, np.random.default_rng(seed))
        count = (2 * len(inner) + len(rim.points) - 2) * (1 + _ADDED)
        plans.append(_Plan(rim, inner, field, abs(count / cells - 1)))
        stuck = abs(count / last - 1) < _STUCK and plans[-1].miss > TOLERANCE
        if plans[-1].miss < TOLERANCE / 5 or stuck:
            break
        last = count
        step = min(max(math.sqrt(count / cells), 0.5), 2.0)
        coarse *= step if turn < _SEARCH / 2 else math.sqrt(step)  # damped, lest it swings
    return min(plans, key=lambda plan: plan.miss)


def _facets(rim: Boundary, n_electrodes: int) -> tuple[IntArray, ...]:
    """Rim edges of each electrode, counter-clockwise from its start."""
    nodes = np.arange(len(rim.points))
    edges = np.column_stack([nodes, np.roll(nodes, -1)])
    result = []
    for number in range(n_electrodes):
        own = np.flatnonzero(rim.owner == number)
        gap = np.flatnonzero(np.diff(own) > 1)  # where the arc runs through the first node
        result.append(edges[np.roll(own, -1 - gap[0]) if len(gap) else own])
    return tuple(result)


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
