"""Sheets with a thickness: layers, and tetrahedra between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.boundary import AT_ELECTRODE, MIN_FACETS, SizeField, running
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import Outline, check_size
from tomoskin.model.mesh.patch import FacePatch, Patch, WallPatch, check_patches, footprint
from tomoskin.model.mesh.triangles import boundary_facets
from tomoskin.model.mesh.triangulate import triangulate

GROWTH = 0.5
"""Spacing gained per unit of distance from a mark."""

_SAME = 1e-9
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
    near = _SAME * (high - low)
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
