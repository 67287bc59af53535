"""Triangles: their measures, neighbours and shapes; and what points, cells and electrodes must
satisfy before anything is solved on them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, GeometryError, IntArray, refuse_first


def check_finite(points: FloatArray, what: str) -> None:
    """Raise GeometryError that names the first of ``points`` (n, d) that is not finite."""
    bad = ~np.isfinite(points).all(axis=1)
    refuse_first(bad, points, "finite coordinates", what, GeometryError)


def simplex_measure(points: FloatArray, simplices: IntArray) -> FloatArray:
    """Length (m), area (m²) or volume (m³) of each simplex, (n,), in the plane or in space."""
    corner = points[simplices]
    edges = (corner[:, 1:] - corner[:, :1]).transpose(1, 2, 0)
    return np.abs(_content(edges)) / math.factorial(len(edges))


def _content(edges: FloatArray) -> FloatArray:
    """(n,) of what ``edges`` (k, d, n) span: a Gram determinant would lose half the digits."""
    if len(edges) == 1:
        return np.asarray(np.linalg.norm(edges[0], axis=0))
    u, v = edges[:2]
    if edges.shape[1] == 2:
        return np.asarray(u[0] * v[1] - u[1] * v[0])
    normal = np.cross(u, v, axis=0)
    if len(edges) == 2:
        return np.asarray(np.linalg.norm(normal, axis=0))
    return np.asarray((normal * edges[2]).sum(axis=0))


def facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    """All facets with sorted corners, (n_cells·k, k − 1), and the cell that owns each."""
    k = cells.shape[1]
    corners = [[c for c in range(k) if c != opposite] for opposite in range(k)]
    facet = np.sort(np.concatenate([cells[:, c] for c in corners]), axis=1)
    return facet, np.tile(np.arange(len(cells)), k)


def owners(cells: IntArray, chosen: IntArray) -> IntArray:
    """(n,) a cell that each facet of ``chosen`` (n, k − 1) belongs to, by its corners."""
    facet, owner = facets(cells)
    size = (int(cells.max()) + 1,) * facet.shape[1]
    number, wanted = (np.ravel_multi_index(f.T, size) for f in (facet, np.sort(chosen, axis=1)))
    order = np.argsort(number)
    return np.asarray(owner[order[np.searchsorted(number, wanted, sorter=order)]])


def boundary_facets(cells: IntArray) -> IntArray:
    """(n_facets, k − 1) facets that belong to one cell only, corners sorted."""
    return paired_facets(cells)[1]


def paired_facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    """(n_pairs, 2) cells that share a facet, each pair once; and :func:`boundary_facets`."""
    facet, owner = facets(cells)
    order = np.lexsort(facet.T[::-1])
    facet, owner = facet[order], owner[order]
    same = (facet[1:] == facet[:-1]).all(axis=1)
    single = ~(np.append(same, False) | np.append(False, same))
    return np.column_stack([owner[:-1][same], owner[1:][same]]), np.asarray(facet[single])


SIDES = ((0, 1), (1, 2), (2, 0))
"""Corners at the ends of each side of a triangle."""

_CLEAR = 1e-9
"""An edge that ends this near to a triangle, as a part of its length, only touches it."""

_BLOCK = 200_000


def barycentric(corner: FloatArray, position: FloatArray) -> FloatArray:
    """(…, 3) shares of the corners (…, 3, 2) at ``position`` (…, 2)."""
    u, v = corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :]
    w = position - corner[..., 0, :]
    area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    p = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / area
    q = (u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]) / area
    return np.stack([1.0 - p - q, p, q], axis=-1)


def closest(corner: FloatArray, position: FloatArray) -> FloatArray:
    """(…, 3) shares of the point of each triangle (…, 3, 3) that is nearest to ``position`` (…, 3).

    The foot on the plane where it lies inside, else the best foot on the three sides.
    """
    position = np.broadcast_to(position, (*corner.shape[:-2], 3))
    u, v = corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :]
    w = position - corner[..., 0, :]
    gram = np.stack(
        [
            np.stack([(u * u).sum(-1), (u * v).sum(-1)], -1),
            np.stack([(u * v).sum(-1), (v * v).sum(-1)], -1),
        ],
        -1,
    )
    right = np.stack([(w * u).sum(-1), (w * v).sum(-1)], -1)
    pq = np.linalg.solve(gram, right[..., None])[..., 0]
    foot = np.concatenate([1.0 - pq.sum(-1, keepdims=True), pq], axis=-1)
    shares = [foot]
    for a, b in SIDES:
        side = corner[..., b, :] - corner[..., a, :]
        t = ((position - corner[..., a, :]) * side).sum(-1) / (side * side).sum(-1)
        t = np.clip(t, 0.0, 1.0)
        share = np.zeros(corner.shape[:-1])
        share[..., a], share[..., b] = 1.0 - t, t
        shares.append(share)
    table = np.stack(shares)
    gap = np.linalg.norm(np.einsum("...k,...kd->...d", table, corner) - position, axis=-1)
    gap[0][foot.min(axis=-1) < 0] = np.inf
    best = gap.argmin(axis=0)
    return np.asarray(np.take_along_axis(table, best[None, ..., None], axis=0)[0])


def check_crossings(points: FloatArray, cells: IntArray) -> None:
    """Raise GeometryError naming two triangles that cut through each other.

    Neighbours may meet at what they share; two triangles in one plane are not distinguished.
    """
    for pairs in near_cells(points, cells):
        for one, other in ((0, 1), (1, 0)):
            cut = _cuts(points, cells[pairs[:, one]], cells[pairs[:, other]])
            if cut.any():
                a, b = pairs[int(np.argmax(cut))]
                middle = ", ".join(f"{1e3 * x:.4g}" for x in points[cells[a]].mean(axis=0))
                raise GeometryError(
                    f"the surface intersects itself near ({middle}) mm",
                    where=f"cells {min(a, b)} and {max(a, b)}",
                    hint="repair it in a mesh program: remove self-intersections",
                )


def near_cells(points: FloatArray, cells: IntArray) -> list[IntArray]:
    """Pairs (n, 2) of cells whose boxes overlap, in blocks."""
    corner = points[cells]
    middle = corner.mean(axis=1)
    reach = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
    tree = cKDTree(middle)
    low, high = corner.min(axis=1), corner.max(axis=1)
    blocks = []
    # small ones look for large ones nowhere: each looks as far as itself and its equals reach
    order = np.argsort(reach)
    for part in np.array_split(order, max(1, len(order) // 4096)):
        near = tree.query_ball_point(middle[part], 2 * reach[part])
        first = np.repeat(part, [len(cells) for cells in near])
        second = np.concatenate([np.asarray(cells, dtype=np.int64) for cells in near])
        smaller = (reach[second] < reach[first]) | (
            (reach[second] == reach[first]) & (second < first)
        )
        first, second = first[smaller], second[smaller]
        boxed = ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
        pairs = np.column_stack([first[boxed], second[boxed]])
        blocks += [pairs[k : k + _BLOCK] for k in range(0, len(pairs), _BLOCK)]
    return blocks


def _cuts(points: FloatArray, one: IntArray, other: IntArray) -> NDArray[np.bool_]:
    """(n,) whether an edge of triangle ``one`` passes through the inside of ``other``."""
    cut = np.zeros(len(one), dtype=bool)
    for a, b in SIDES:
        ends = one[:, [a, b]]
        apart = (ends[:, :, None] != other[:, None, :]).all(axis=(1, 2))
        cut[apart] |= _pierces(points[ends[apart]], points[other[apart]])
    return cut


def _pierces(edge: FloatArray, triangle: FloatArray) -> NDArray[np.bool_]:
    """Möller & Trumbore, Journal of Graphics Tools 2 (1997) 21-28."""
    start, along = edge[:, 0], edge[:, 1] - edge[:, 0]
    u, v = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    across = np.cross(along, v)
    scale = (u * across).sum(axis=1)
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(np.cross(u, v), axis=1)
    steep = np.abs(scale) > _CLEAR * size
    inverse = 1.0 / np.where(steep, scale, 1.0)
    away = start - triangle[:, 0]
    p = (away * across).sum(axis=1) * inverse
    turned = np.cross(away, u)
    q = (along * turned).sum(axis=1) * inverse
    t = (v * turned).sum(axis=1) * inverse
    inside = np.minimum.reduce([p, q, 1.0 - p - q, t, 1.0 - t]) > _CLEAR
    return np.asarray(steep & inside)


_FLAT = 1e-12
"""A cell is degenerate below this fraction of (its longest edge)^dimension."""


def check_mesh(points: FloatArray, cells: IntArray, electrodes: tuple[IntArray, ...]) -> None:
    """Raise GeometryError that names the first point, cell or electrode that is wrong."""
    boundary = check_cells(points, cells, electrodes)
    _check_electrodes(cells.shape[1] - 1, boundary, electrodes)


def check_cells(
    points: FloatArray, cells: IntArray, electrodes: tuple[IntArray, ...] = ()
) -> IntArray:
    """The boundary's facets. Raises GeometryError that names the first point or cell that is wrong,
    or the first electrode that has points which do not exist."""
    _check_shapes(points, cells)
    _check_indices(points, cells, electrodes)
    _check_volumes(points, cells)
    pairs, boundary = paired_facets(cells)
    _check_facets(cells, pairs, boundary)
    _check_connected(len(cells), pairs)
    return boundary


def _check_shapes(points: FloatArray, cells: IntArray) -> None:
    corners = cells.shape[1]
    if corners not in (3, 4) or not len(cells):
        raise GeometryError(
            f"expected triangles (n, 3) or tetrahedra (n, 4), got cells {cells.shape}"
        )
    if not corners - 1 <= points.shape[1] <= 3:
        raise GeometryError(
            f"expected points in {corners - 1}D (or triangles in space), "
            f"got {points.shape[1]} coordinates for cells with {corners} corners"
        )
    check_finite(points, "point")


def _check_indices(points: FloatArray, cells: IntArray, electrodes: tuple[IntArray, ...]) -> None:
    n = len(points)
    tables = [("cell", cells), *((f"E{i}, facet", e) for i, e in enumerate(electrodes, 1))]
    for name, table in tables:
        outside = ((table < 0) | (table >= n)).any(axis=1)
        refuse_first(outside, table, f"points from 0 to {n - 1}", name, GeometryError)
    used = np.zeros(n, dtype=bool)
    used[cells] = True
    if not used.all():
        raise GeometryError(
            "belongs to no cell", where=f"point {int(np.argmin(used))}", hint="remove this point"
        )


def _check_volumes(points: FloatArray, cells: IntArray) -> None:
    corner = points[cells]
    size = np.linalg.norm(corner[:, 1:] - corner[:, :1], axis=2).max(axis=1)
    flat = simplex_measure(points, cells) <= _FLAT * size ** (cells.shape[1] - 1)
    if flat.any():
        cell = int(np.argmax(flat))
        raise GeometryError(
            f"is degenerate: its corners {cells[cell].tolist()} span no area or volume",
            where=f"cell {cell}",
        )


def _check_facets(cells: IntArray, pairs: IntArray, boundary: IntArray) -> None:
    if len(boundary) + 2 * len(pairs) == cells.size:
        return
    facet, owner = facets(cells)
    unique, which, counts = np.unique(facet, axis=0, return_inverse=True, return_counts=True)
    worst = int(np.argmax(counts))
    shared = owner[which.reshape(-1) == worst].tolist()
    raise GeometryError(
        f"expected a facet in one or two cells, got {unique[worst].tolist()} in {len(shared)}",
        where=f"cells {', '.join(map(str, shared))}",
        hint="cells overlap, or one is listed twice",
    )


def _check_connected(n: int, pairs: IntArray) -> None:
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    pieces, label = connected_components(graph, directed=False)
    if pieces > 1:
        stray = int(np.argmax(label != np.bincount(label).argmax()))
        raise GeometryError(
            f"the mesh is in {pieces} pieces",
            where=f"cell {stray}",
            hint="join the pieces, or remove all but one",
        )


def _check_electrodes(
    width: int, boundary_table: IntArray, electrodes: tuple[IntArray, ...]
) -> None:
    if not electrodes:
        raise GeometryError("expected at least one electrode, got none")
    boundary = {tuple(f) for f in boundary_table.tolist()}
    owner: dict[tuple[int, ...], int] = {}
    for number, table in enumerate(electrodes):
        where = f"E{number + 1}"
        if not len(table) or table.shape[1] != width:
            raise GeometryError(
                f"expected facets (n, {width}) with n > 0, got {table.shape}", where=where
            )
        for facet in map(tuple, np.sort(table, axis=1).tolist()):
            if facet not in boundary:
                raise GeometryError(f"facet {list(facet)} is not on the boundary", where=where)
            if facet in owner:
                raise GeometryError(
                    f"shares facet {list(facet)} with E{owner[facet] + 1}", where=where
                )
            owner[facet] = number


def checked_metric(metric: FloatArray, points: FloatArray, cells: IntArray) -> FloatArray:
    """(n_cells, 2, 2) symmetric and positive definite, frozen; GeometryError names the first cell
    where it is not."""
    if points.shape[1] != 2 or cells.shape[1] != 3:
        raise GeometryError("only a flat sheet of triangles has a metric", where="metric")
    checked = np.array(metric, dtype=np.float64)
    if checked.shape != (len(cells), 2, 2):
        raise GeometryError(
            f"expected shape ({len(cells)}, 2, 2), got {checked.shape}", where="metric"
        )
    with np.errstate(invalid="ignore", over="ignore"):
        skew = np.abs(checked[:, 0, 1] - checked[:, 1, 0])
        size = checked[:, 0, 0] + checked[:, 1, 1]
        definite = np.linalg.det(checked) > _FLAT * size**2
    good = np.isfinite(checked).all(axis=(1, 2)) & definite & (size > 0) & (skew <= _FLAT * size)
    refuse_first(~good, checked, "a symmetric positive definite metric", "cell", GeometryError)
    checked.flags.writeable = False
    return checked
