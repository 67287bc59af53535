"""The mesher: an outline and electrodes in, a graded mesh of the wanted size out. Its inner points
get first positions, and are smoothed into regular triangles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.spatial import Delaunay, cKDTree

from tomoskin.core import FloatArray, GeometryError, IntArray, reach
from tomoskin.model.mesh.boundary import (
    Boundary,
    ElectrodeArc,
    SizeField,
    check_arcs,
    discretise,
    keeps_clear,
    rim_distance,
)
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import Outline
from tomoskin.model.mesh.polygon import inside
from tomoskin.model.mesh.triangles import simplex_measure

_RIM = 0.6
"""Inner points keep this many wanted edge lengths away from the rim."""

_APART = 0.7
"""Points of the row along the rim, and from it, keep this many wanted edge lengths apart."""

_AROUND = np.array([(1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1)])
"""The six nearest lattice points, in steps of the lattice's two vectors."""

ROUNDS = 8
"""Rounds of smoothing."""

MENDS = (2, 4)
"""Rounds before which points with too few or too many neighbours are mended."""


def inner_points(rim: Boundary, field: SizeField, random: np.random.Generator) -> FloatArray:
    """(n, 2) inner points with the field's density, m: a row along the rim, then a lattice."""
    row, lattice = _row(rim, field), _hexagonal(rim, field, random)
    if not len(row):
        return lattice
    gap, _ = cKDTree(row).query(lattice)
    return np.concatenate([row, lattice[gap > _APART * field(lattice)]])


def _row(rim: Boundary, field: SizeField) -> FloatArray:
    """Tips of equilateral triangles that stand on the rim's edges; of a close pair, one."""
    step = np.roll(rim.points, -1, axis=0) - rim.points
    tips = rim.midpoints + np.column_stack([-step[:, 1], step[:, 0]]) * (math.sqrt(3) / 2)
    tips = _clear_of_rim(tips, rim, field)
    if len(tips) < 2:
        return tips
    pairs = cKDTree(tips).query_pairs(_APART * field.coarse, output_type="ndarray")
    one, other = tips[pairs[:, 0]], tips[pairs[:, 1]]
    close = np.linalg.norm(one - other, axis=1) < _APART * field((one + other) / 2)
    keep = np.ones(len(tips), dtype=bool)
    keep[np.maximum(pairs[close, 0], pairs[close, 1])] = False
    return tips[keep]


def _hexagonal(rim: Boundary, field: SizeField, random: np.random.Generator) -> FloatArray:
    """(n, 2) inner points with the field's density, m.

    Level 0 is a lattice of the coarse spacing, turned and shifted at random; each further
    level adds the centres of the triangles (spacing / √3) where cells must be smaller. A
    point of a level is kept with the probability that makes up the density still missing.
    """
    spacing, angle = field.coarse, random.uniform(0, math.pi / 3)
    low, high = rim.points.min(axis=0), rim.points.max(axis=0)
    origin = (low + high) / 2 + spacing * random.uniform(-0.5, 0.5, 2)
    reach = math.ceil(np.linalg.norm(high - low) / spacing / math.sqrt(3)) + 3
    steps = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T
    xy = origin + steps @ _basis(spacing, angle)
    near = ((xy > low - 2 * spacing) & (xy < high + 2 * spacing)).all(axis=1)
    steps, xy = steps[near], xy[near]
    chosen = [_clear_of_rim(xy, rim, field)]
    while len(steps := steps[field(xy) < 1.3 * spacing]):
        steps, new = _finer(steps)
        spacing, angle = spacing / math.sqrt(3), angle + math.pi / 6
        xy = origin + steps @ _basis(spacing, angle)
        candidates = _clear_of_rim(xy[new], rim, field)
        target = (spacing / field(candidates)) ** 2  # of this level's density
        kept = random.uniform(size=len(candidates)) < (3 * target - 1) / 2
        chosen.append(candidates[kept])
        if spacing <= field.sizes.min():
            break
    return np.concatenate(chosen)


def _basis(spacing: float, angle: float) -> FloatArray:
    turns = np.array([angle, angle + math.pi / 3])
    return spacing * np.column_stack([np.cos(turns), np.sin(turns)])


def _finer(steps: IntArray) -> tuple[IntArray, NDArray[np.bool_]]:
    """The √3 times finer lattice around points, and which of its points are new."""
    old = np.column_stack([2 * steps[:, 0] + steps[:, 1], steps[:, 1] - steps[:, 0]])
    around = (old[:, None] + _AROUND).reshape(-1, 2)
    finer = np.unique(np.concatenate([old, around]), axis=0)
    return finer, (finer[:, 0] - finer[:, 1]) % 3 != 0


def _clear_of_rim(xy: FloatArray, rim: Boundary, field: SizeField) -> FloatArray:
    """Those of ``xy`` that lie inside, ``_RIM`` wanted edge lengths from every rim edge."""
    xy = xy[keeps_clear(rim, xy)]
    return xy[rim_distance(rim, xy) > _RIM * field(xy)]


def triangles(rim: Boundary, inner: FloatArray) -> IntArray:
    """(n, 3) Delaunay triangles, counter-clockwise, of the rim's nodes and then ``inner``."""
    points = np.concatenate([rim.points, inner])
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    scaled = (points - middle) / np.ptp(points, axis=0).max()
    cells = Delaunay(scaled).simplices.astype(np.int64)
    a, b, c = (scaled[cells[:, i]] for i in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    cells[twice < 0] = cells[twice < 0][:, [0, 2, 1]]
    count = len(rim.points)
    keep = np.abs(twice) > 1e-13
    doubtful = np.flatnonzero(keep & (cells < count).all(axis=1))
    keep[doubtful] = inside(rim.points, points[cells[doubtful]].mean(axis=1))
    return np.asarray(cells[keep])


def smoothed(rim: Boundary, inner: FloatArray, field: SizeField) -> FloatArray:
    """Move ``inner`` (n, 2) to the weighted mean of the circumcentres around each point.

    The weights are area/size², after L. Chen and M. Holst, "Efficient mesh optimization
    schemes based on optimal Delaunay triangulations", CMAME 200 (2011) 967-984.
    """
    for number in range(ROUNDS):
        reach()
        cells = triangles(rim, inner)
        if number in MENDS:
            inner = _mended(rim, inner, cells, field)
            cells = triangles(rim, inner)
        moved = _means(np.concatenate([rim.points, inner]), cells, field)[len(rim.points) :]
        inner = np.where(keeps_clear(rim, moved)[:, None], moved, inner)
    return inner


def _mended(rim: Boundary, inner: FloatArray, cells: IntArray, field: SizeField) -> FloatArray:
    """Without points of four neighbours or fewer; with one more beside those of eight or more."""
    points, first = np.concatenate([rim.points, inner]), len(rim.points)
    degree = np.bincount(cells.ravel(), minlength=len(points))
    few, many = degree <= 4, degree >= 8
    few[:first] = many[:first] = False
    sides = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    both = few[sides].all(axis=1)
    few[sides[both].max(axis=1)] = False  # of two neighbours only one goes
    middle = points[cells].mean(axis=1)
    size = simplex_measure(points, cells) / field(middle) ** 2
    corner, owner = cells.ravel(), np.repeat(np.arange(len(cells)), 3)
    order = np.lexsort((size[owner], corner))
    last = np.flatnonzero(np.append(np.diff(corner[order]) != 0, True))
    largest = owner[order[last]]  # for each point, the triangle that is largest for its position
    added = middle[np.unique(largest[many])]
    return np.concatenate([inner[~few[first:]], added[keeps_clear(rim, added)]])


def _means(points: FloatArray, cells: IntArray, field: SizeField) -> FloatArray:
    """(n_points, 2) weighted mean of the circumcentres of the triangles around each point."""
    a, b, c = (points[cells[:, i]] for i in range(3))
    u, v = b - a, c - a
    twice = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    uu, vv = (u**2).sum(axis=1), (v**2).sum(axis=1)
    offset = np.column_stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu])
    centroid = (a + b + c) / 3
    centre = (a + offset / (2 * twice[:, None]) + centroid) / 2
    weight = twice / field(centroid) ** 2
    moment = np.column_stack([weight[:, None] * centre, weight])
    around = coo_array(
        (np.ones(cells.size), (cells.ravel(), np.repeat(np.arange(len(cells)), 3))),
        shape=(len(points), len(cells)),
    ).tocsr()
    total = np.asarray(around @ moment)
    return np.asarray(total[:, :2] / total[:, 2:])


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
