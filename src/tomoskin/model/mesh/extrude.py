"""Sheets with a thickness: layers, and tetrahedra between them; and electrodes on such a body:
on its upright wall, on the bottom, on the top."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.boundary import (
    AT_ELECTRODE,
    MIN_FACETS,
    MIN_GAP,
    ElectrodeArc,
    SizeField,
    among,
    check_width,
    running,
)
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import Outline, check_size
from tomoskin.model.mesh.triangles import boundary_facets
from tomoskin.model.mesh.triangulate import triangulate

_SAME = 1e-7
"""Places nearer than this fraction of the outline's length are one."""


@dataclass(frozen=True, slots=True)
class WallPatch:
    """Electrode on the wall: a stretch of the outline from ``bottom`` to ``top``, m.

    Its edges are resolved exactly; without an arc it goes all the way round.
    """

    bottom: float
    top: float
    arc: ElectrodeArc | None = None

    def width(self, outline: Outline) -> float:
        """The length of the patch along the wall, in m."""
        return outline.length if self.arc is None else self.arc.width(outline)

    def holds(self, outline: Outline, s: FloatArray) -> NDArray[np.bool_]:
        """(n,) True for arclengths ``s`` within the patch."""
        if self.arc is None:
            return np.ones(len(s), dtype=bool)
        return np.asarray((s - self.arc.start) % outline.length < self.arc.width(outline))


@dataclass(frozen=True, slots=True)
class FacePatch:
    """Electrode on the bottom or the top: all of it, or what lies inside ``outline``.

    ``outline`` is moved by ``centre`` (x, y) m. Its edge is not resolved: the electrode is made
    of the triangles whose centroid lies inside, so that its area is right to about one triangle's
    width around its edge. Ask for more cells where that is too coarse.
    """

    face: Literal["bottom", "top"]
    outline: Outline | None = None
    centre: tuple[float, float] = (0.0, 0.0)

    def holds(self, xy: FloatArray) -> NDArray[np.bool_]:
        """(n,) True for points ``xy`` (n, 2) within the patch."""
        if self.outline is None:
            return np.ones(len(xy), dtype=bool)
        return self.outline.contains(xy - np.asarray(self.centre))


Patch = WallPatch | FacePatch
"""An electrode of a body."""


def ring(
    outline: Outline, count: int, width: float, bottom: float, top: float
) -> tuple[WallPatch, ...]:
    """``count`` equal electrodes of arclength ``width`` m, evenly spaced around the wall.

    Numbered as the built-in skins are: the first one towards +y, then clockwise seen from above.
    """
    if count < 1:
        raise GeometryError(f"expected at least 1 electrode, got {count}")
    first = outline.toward(math.pi / 2)
    centres = [first - k * outline.length / count for k in range(count)]
    return tuple(WallPatch(bottom, top, ElectrodeArc.around(s, width)) for s in centres)


def check_patches(outline: Outline, height: float, patches: Sequence[Patch]) -> None:
    """Raise GeometryError that names the electrode that does not fit or overlaps another."""
    if not patches:
        raise GeometryError("expected at least one electrode, got none")
    wall = [(i, p) for i, p in enumerate(patches) if isinstance(p, WallPatch)]
    for number, patch in wall:
        _check_heights(height, patch, f"E{number + 1}")
        if patch.arc is not None:
            check_width(outline, patch.arc, f"E{number + 1}")
    for (low, one), (high, other) in combinations(wall, 2):
        _check_apart(outline, one, other, low, high)


def _check_heights(height: float, patch: WallPatch, where: str) -> None:
    if not 0 <= patch.bottom < patch.top <= height * (1 + 1e-9):
        raise GeometryError(
            f"expected 0 ≤ bottom < top ≤ {height * 1e3:.4g} mm, "
            f"got {patch.bottom * 1e3:.4g} mm to {patch.top * 1e3:.4g} mm",
            where=where,
        )


def _check_apart(outline: Outline, one: WallPatch, other: WallPatch, low: int, high: int) -> None:
    """Two patches must stand apart along the outline or in height."""
    heights = one.top - one.bottom, other.top - other.bottom
    aside = max(one.bottom, other.bottom) - min(one.top, other.top)
    along = _gap(outline, one, other)
    widths = one.width(outline), other.width(outline)
    slack = 1 - 1e-9
    if aside >= slack * MIN_GAP * min(heights) or along >= slack * MIN_GAP * min(widths):
        return
    raise GeometryError(
        f"overlaps or touches E{low + 1}",
        where=f"E{high + 1}",
        hint=f"leave {MIN_GAP:.0%} of the smaller one's width or height between them",
    )


def _gap(outline: Outline, one: WallPatch, other: WallPatch) -> float:
    """Arclength between two patches; below 0 where they overlap."""
    if one.arc is None or other.arc is None:
        return -min(one.width(outline), other.width(outline))
    ahead = (other.arc.start - one.arc.start) % outline.length - one.width(outline)
    behind = (one.arc.start - other.arc.start) % outline.length - other.width(outline)
    return min(ahead, behind)


def footprint(outline: Outline, patches: Sequence[Patch]) -> tuple[list[ElectrodeArc], FloatArray]:
    """Arcs that stand apart, and arclengths that must be nodes beside them, for ``triangulate``.

    Arcs of patches at different heights may coincide or overlap; together they are one arc,
    and their ends inside it are marks. ``triangulate`` wants an arc, and one that is not all
    of the rim: the longest stretch is omitted where patches cover the rim, and a short
    stretch at its start stands in where no patch has an arc.
    """
    length = outline.length
    arcs = [p.arc for p in patches if isinstance(p, WallPatch) and p.arc is not None]
    if not arcs:
        return [ElectrodeArc.around(0.0, length / 64)], np.zeros(0)
    start = np.array([a.start % length for a in arcs])
    width = np.array([a.width(outline) for a in arcs])
    ends = _distinct(np.concatenate([start, start + width]) % length, length)
    span = np.append(ends[1:], ends[0] + length) - ends
    middle = ends + span / 2
    covered = ((middle[:, None] - start) % length < width).any(axis=1)
    covered |= span < MIN_GAP * length  # leave no gap that check_arcs could refuse
    if covered.all():
        covered[np.argmax(span)] = False
    marks = ends[covered & np.roll(covered, 1)]
    return _runs(ends, span, covered), marks[~among(marks, outline.corners, length)]


def _distinct(s: FloatArray, length: float) -> FloatArray:
    """Ascending arclengths without those that rounding alone tells apart."""
    order = np.sort(s)
    gap = np.append(np.diff(order), order[0] + length - order[-1])
    return np.asarray(order[gap > _SAME * length])


def _runs(ends: FloatArray, span: FloatArray, covered: NDArray[np.bool_]) -> list[ElectrodeArc]:
    """Arcs over neighbouring stretches that are covered."""
    first = int(np.argmin(covered)) + 1  # begin behind a stretch that is not
    runs: list[ElectrodeArc] = []
    joined = False
    for i in np.roll(np.arange(len(ends)), -first):
        if covered[i] and joined:
            runs[-1] = ElectrodeArc(runs[-1].start, runs[-1].end + float(span[i]))
        elif covered[i]:
            runs.append(ElectrodeArc(float(ends[i]), float(ends[i] + span[i])))
        joined = bool(covered[i])
    return runs


GROWTH = 0.5
"""Spacing gained per unit of distance from a mark."""

_SAME_MARK = 1e-9
"""Marks nearer than this fraction of the axis are one."""

_SAMPLES = 400
"""Points between two marks at which the wanted spacing is asked for."""


def grid_lines(low: float, high: float, marks: Sequence[float], count: int) -> FloatArray:
    """(n + 1,) lines from ``low`` to ``high`` through every mark, n about ``count``, m.

    Without marks between the ends there are exactly ``count`` equal steps. A mark is the edge
    of an electrode: the steps beside it are 0.4 of those far from it, and at least two fit
    between two marks. There are more steps than asked for where marks need them.

    Raises
    ------
    GeometryError
        When ``count`` is below 1.
    """
    if count < 1:
        raise GeometryError(f"expected at least 1 layer, got {count}")
    stops = _stops(low, high, marks)
    span = high - low

    def excess(coarse: float) -> float:
        return sum(_steps(stops, coarse)) - count

    coarse = span if excess(span) > 0 else float(brentq(excess, span / count * 0.999, span))
    pieces = []
    for i, steps in enumerate(_steps(stops, coarse)):
        least = MIN_FACETS if 0 < i < len(stops) - 2 else 1
        pieces.append(_piece(stops, i, coarse, max(least, round(steps))))
    return np.concatenate([*pieces, [high]])


def _stops(low: float, high: float, marks: Sequence[float]) -> FloatArray:
    """The ends and the marks, ascending, each height once."""
    near = _SAME_MARK * (high - low)
    inner = sorted(m for m in marks if low + near < m < high - near)
    kept = [m for i, m in enumerate(inner) if i == 0 or m - inner[i - 1] > near]
    return np.array([low, *kept, high])


def _field(stops: FloatArray, coarse: float) -> SizeField | None:
    """Spacing wanted around the inner stops; None where there is none."""
    if len(stops) == 2:
        return None
    gaps = np.diff(stops)
    narrow = np.minimum(gaps[1:], gaps[:-1]) / MIN_FACETS
    return SizeField(coarse, stops[1:-1, None], np.minimum(narrow, AT_ELECTRODE * coarse), GROWTH)


def _running(stops: FloatArray, i: int, coarse: float) -> tuple[FloatArray, FloatArray]:
    """Samples of interval ``i`` and the number of steps wanted up to each."""
    z = np.linspace(stops[i], stops[i + 1], _SAMPLES)
    field = _field(stops, coarse)
    density = np.full(len(z), 1 / coarse) if field is None else 1 / field(z[:, None])
    return z, running(density, z)


def _steps(stops: FloatArray, coarse: float) -> list[float]:
    """Number of steps wanted in each interval, not rounded."""
    return [float(_running(stops, i, coarse)[1][-1]) for i in range(len(stops) - 1)]


def _piece(stops: FloatArray, i: int, coarse: float, parts: int) -> FloatArray:
    """Lines of interval ``i`` without its end."""
    z, running = _running(stops, i, coarse)
    lines = np.interp(np.arange(parts) * (running[-1] / parts), running, z)
    lines[0] = stops[i]
    return np.asarray(lines)


def extrude(
    outline: Outline,
    height: float,
    patches: Sequence[Patch],
    *,
    cells: int,
    layers: int,
    planes: Sequence[float] = (),
    seed: int = 0,
) -> Mesh:
    """Body over ``outline`` from z = 0 to ``height`` m; one electrode per patch.

    The flat mesh has about ``cells`` triangles, finer towards the wall patches, and there are
    about ``layers`` layers, finer beside the patches' bottoms and tops; every triangle and
    layer is cut into three tetrahedra. ``planes`` are further heights, m, that cells must not
    cross. Wall patches are resolved exactly on the mesh's own wall, which is a polygon where
    the outline is curved.

    Raises
    ------
    GeometryError
        When an electrode does not fit, overlaps another one or has no facet, or when the
        outline cannot be met with so few cells.
    """
    check_size("height", height)
    check_patches(outline, height, patches)
    _check_planes(planes, height)
    arcs, marks = footprint(outline, patches)
    flat = triangulate(outline, arcs, cells, seed=seed, marks=marks)
    walls = [p for p in patches if isinstance(p, WallPatch)]
    heights = [*planes, *(z for p in walls for z in (p.bottom, p.top))]
    body = Body(flat.points, flat.cells, grid_lines(0.0, height, heights, layers))
    return body.mesh(_facets(body, outline, patches))


@dataclass(frozen=True, eq=False)
class Body:
    """Prisms over flat triangles, cut into tetrahedra.

    Attributes
    ----------
    flat
        (n, 2) points, m.
    triangles
        (n_triangles, 3).
    planes
        (n_layers + 1,) ascending heights, m.
    """

    flat: FloatArray
    triangles: IntArray
    planes: FloatArray

    def mesh(self, electrodes: Sequence[IntArray]) -> Mesh:
        """Return the tetrahedra with those facets as electrodes."""
        for number, facets in enumerate(electrodes):
            if not len(facets):
                raise GeometryError(
                    "no facet lies inside this electrode",
                    where=f"E{number + 1}",
                    hint="make the electrode larger, or use more cells",
                )
        n = len(self.flat)
        points = np.column_stack(
            [np.tile(self.flat, (len(self.planes), 1)), np.repeat(self.planes, n)]
        )
        return Mesh(points, self._tetrahedra(), tuple(electrodes))

    def wall(self, edges: IntArray, bottom: float, top: float) -> IntArray:
        """(n, 3) facets over the rim ``edges`` (k, 2) between two planes.

        Two for each edge and layer, along the diagonal that the prisms behind them have.
        """
        a, b = np.sort(edges, axis=1).T
        up = len(self.flat)
        quads = [np.column_stack([a, b, b + up]), np.column_stack([a, a + up, b + up])]
        one_layer = np.concatenate(quads)
        middle = (self.planes[1:] + self.planes[:-1]) / 2
        levels = np.flatnonzero((middle > bottom) & (middle < top))
        return np.asarray((one_layer + up * levels[:, None, None]).reshape(-1, 3))

    def face(self, chosen: NDArray[np.bool_], plane: int) -> IntArray:
        """(n, 3) facets: the chosen triangles (n_triangles,) in the plane of that number."""
        level = plane % len(self.planes)
        return np.asarray(self.triangles[chosen] + level * len(self.flat))

    def _tetrahedra(self) -> IntArray:
        """Three to a prism: with corners a < b < c, the paths a → b → c that go up once.

        A side between two prisms is cut from the lower number's bottom to the higher one's top
        whichever prism is asked, so that neighbours fit.
        """
        a, b, c = np.sort(self.triangles, axis=1).T
        up = len(self.flat)
        cut = [(a, b, c, c + up), (a, b, c + up, b + up), (a, a + up, b + up, c + up)]
        prism = np.stack([np.column_stack(t) for t in cut], axis=1)
        u, v = self.flat[b] - self.flat[a], self.flat[c] - self.flat[a]
        clockwise = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
        prism[clockwise] = prism[clockwise][:, :, [0, 1, 3, 2]]  # all turn the same way
        levels = np.arange(len(self.planes) - 1)
        return np.asarray((prism + up * levels[:, None, None, None]).reshape(-1, 4))


def _facets(body: Body, outline: Outline, patches: Sequence[Patch]) -> list[IntArray]:
    """The facets of the body that each patch covers."""
    edges = boundary_facets(body.triangles)
    s = outline.nearest(body.flat[edges].mean(axis=1))
    centroids = body.flat[body.triangles].mean(axis=1)
    facets = []
    for patch in patches:
        if isinstance(patch, FacePatch):
            plane = -1 if patch.face == "top" else 0
            facets.append(body.face(patch.holds(centroids), plane))
        else:
            own = edges[patch.holds(outline, s)]
            facets.append(body.wall(own, patch.bottom, patch.top))
    return facets


def _check_planes(planes: Sequence[float], height: float) -> None:
    for number, z in enumerate(planes):
        if not 0 <= z <= height:
            raise GeometryError(
                f"expected a height from 0 to {height * 1e3:.4g} mm, got {z * 1e3:.4g} mm",
                where=f"plane {number}",
            )
