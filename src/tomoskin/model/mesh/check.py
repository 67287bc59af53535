"""What points, cells and electrodes must satisfy before anything is solved on them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tomoskin.core import FloatArray, GeometryError, IntArray, refuse_first
from tomoskin.model.mesh.triangles import check_finite, facets, paired_facets, simplex_measure

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
