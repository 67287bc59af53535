"""Meshes of a known shape, built without the mesher: boxes, strips, rings, tubes, bent sheets."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, extrude, ring, triangulate


@cache
def disc(n: int = 8, cells: int = 220, *, width: float = 0.02) -> Mesh:
    """Disc of 0.1 m radius, ``n`` electrodes of arclength ``width``, E1 at the top, clockwise."""
    outline = Disc(0.1)
    centres = (0.25 - np.arange(n) / n) * outline.length
    return triangulate(outline, [ElectrodeArc.around(float(c), width) for c in centres], cells)


def cylinder(
    radius: float, height: float, *, count: int, span: tuple[float, float], cells: int, layers: int
) -> Mesh:
    """Tank with ``count`` electrodes of 20 mm, which reach over the heights ``span``, m."""
    outline = Disc(radius)
    patches = ring(outline, count, 0.02, *span)
    return extrude(outline, height, patches, cells=cells, layers=layers)


def grid(nx: int, ny: int) -> IntArray:
    """((nx − 1)·(ny − 1)·2, 3) triangles of an nx × ny grid of points, x fastest."""
    corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
    lower = np.column_stack([corner, corner + 1, corner + nx + 1])
    upper = np.column_stack([corner, corner + nx + 1, corner + nx])
    return np.concatenate([lower, upper])


def strip(x: FloatArray, y: FloatArray) -> Mesh:
    """Flat strip on the grid x × y; two electrodes on the side y = y[0], two on y = y[-1]."""
    nx, ny = len(x), len(y)
    points = np.column_stack([np.tile(x, ny), np.repeat(y, nx)])
    near = np.column_stack([np.arange(nx - 1), np.arange(1, nx)])
    far = near + (ny - 1) * nx
    quarter = (nx - 1) // 4
    left, right = slice(0, quarter), slice(nx - 1 - quarter, nx - 1)
    return Mesh(points, grid(nx, ny), (near[left], near[right], far[right], far[left]))


def folded(mesh: Mesh, folds: FloatArray, angle: float) -> Mesh:
    """Return a flat strip bent by ``angle`` rad at each x in ``folds``, y kept as the axis.

    Every grid column stays plane, so that lengths on the sheet are exactly those of the strip.
    """
    x = np.unique(mesh.points[:, 0])
    turn = angle * np.searchsorted(folds, (x[1:] + x[:-1]) / 2)
    step = np.diff(x)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    path = np.vstack([[0.0, 0.0], np.cumsum(step, axis=0)])
    place = path[np.searchsorted(x, mesh.points[:, 0])]
    points = np.column_stack([place[:, 0], mesh.points[:, 1], place[:, 1]])
    return Mesh(points, mesh.cells, mesh.electrodes)


def box(x: FloatArray, y: FloatArray, z: FloatArray) -> Mesh:
    """Tetrahedra (six a brick) on the grid x × y × z; electrodes are the whole ends in x."""
    nx, ny, nz = len(x), len(y), len(z)
    index = np.arange(nx * ny * nz).reshape(nz, ny, nx)
    xyz = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    cells = []
    for order in permutations(range(3)):
        corner = np.zeros(3, dtype=int)
        path = [corner.copy()]
        for axis in order:
            corner[axis] = 1
            path.append(corner.copy())
        cells.append(np.column_stack([_brick_corner(index, *c) for c in path]))
    tetrahedra = np.concatenate(cells)
    return Mesh(xyz, tetrahedra, (_end(index, 0), _end(index, -1)))


def _brick_corner(index: IntArray, dx: int, dy: int, dz: int) -> IntArray:
    nz, ny, nx = index.shape
    return index[dz : nz - 1 + dz, dy : ny - 1 + dy, dx : nx - 1 + dx].ravel()


def _end(index: IntArray, x: int) -> IntArray:
    """Triangles of the grid's face at that x, cut along the bricks' own diagonals."""
    face = index[:, :, x]
    a, b, c, d = face[:-1, :-1], face[:-1, 1:], face[1:, 1:], face[1:, :-1]
    halves = [np.column_stack([e.ravel() for e in half]) for half in ((a, b, c), (a, d, c))]
    return np.concatenate(halves)


def refined(mesh: Mesh, place: Callable[[FloatArray], FloatArray]) -> Mesh:
    """Each triangle cut into four; ``place`` moves the new rim points (n, 2) onto the outline."""
    sides = np.sort(mesh.cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    unique, number = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    ab, bc, ca = (number.reshape(-1, 3) + len(mesh.points)).T
    a, b, c = mesh.cells.T
    cells = np.concatenate(
        [np.column_stack(t) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
    )
    middle = mesh.points[unique].mean(axis=1)
    side = {tuple(s): i for i, s in enumerate(unique.tolist())}
    rim = [side[tuple(s)] for s in mesh.boundary.tolist()]
    middle[rim] = place(middle[rim])
    electrodes = tuple(_halved(e, side, len(mesh.points)) for e in mesh.electrodes)
    return Mesh(np.vstack([mesh.points, middle]), cells, electrodes)


def _halved(facets: IntArray, side: dict[tuple[int, ...], int], offset: int) -> IntArray:
    middle = np.array([offset + side[tuple(sorted(f))] for f in facets.tolist()])
    first = np.column_stack([facets[:, 0], middle])
    return np.concatenate([first, np.column_stack([middle, facets[:, 1]])])


def patched(mesh: Mesh, *patches: Callable[[FloatArray], NDArray[np.bool_]]) -> Mesh:
    """Return the mesh with one electrode per patch: boundary facets whose middle lies in it."""
    middle = mesh.points[mesh.boundary].mean(axis=1).round(12)
    return Mesh(mesh.points, mesh.cells, tuple(mesh.boundary[inside(middle)] for inside in patches))


def mapped(mesh: Mesh, place: Callable[[FloatArray], FloatArray]) -> Mesh:
    """Return the mesh with its points (n, d) moved to ``place(points)``."""
    return Mesh(place(mesh.points), mesh.cells, mesh.electrodes)


def rings(radii: FloatArray, n: int) -> Mesh:
    """Disc of rings at ``radii`` with ``n`` points each, one side of the rim as an electrode.

    Every ring is a polygon of the mesh, so that cells lie on one side of it.
    """
    turn = 2 * np.pi * np.arange(n) / n
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.vstack([[0.0, 0.0], *(r * circle for r in radii)])
    following = np.roll(np.arange(n), -1)
    fan = np.column_stack([np.zeros(n, dtype=int), 1 + np.arange(n), 1 + following])
    cells = [fan]
    for inner in range(len(radii) - 1):
        a, b = 1 + inner * n + np.arange(n), 1 + inner * n + following
        cells += [np.column_stack([a, a + n, b + n]), np.column_stack([a, b + n, b])]
    rim = 1 + (len(radii) - 1) * n + np.arange(2)
    return Mesh(points, np.concatenate(cells), (rim[None],))


def tube(n: int, rows: int, radius: float, height: float, *, stagger: float = 0.0) -> Mesh:
    """Closed tube around z, ``n`` points a row; one side of the rim z = 0 as an electrode.

    With ``stagger`` every second row (the rims apart) is turned by that part of a side, so that
    the triangles no longer lie in the faces of a prism.
    """
    row, step = np.divmod(np.arange(n * (rows + 1)), n)
    turned = stagger * ((row % 2 == 1) & (row < rows))
    turn = 2 * np.pi * (step + turned) / n
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height * row / rows])
    a = np.arange(n * rows)
    b = a - step[: n * rows] + (step[: n * rows] + 1) % n
    cells = np.concatenate([np.column_stack([a, b, b + n]), np.column_stack([a, b + n, a + n])])
    return Mesh(points, cells, (np.array([[0, 1]]),))
