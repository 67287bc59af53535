"""What a mesh must satisfy before anything is solved on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tomoskin.core import GeometryError

if TYPE_CHECKING:
    from tomoskin.mesh.mesh import Mesh

_FLAT = 1e-12
"""A cell is degenerate below this fraction of the volume of a regular one of its size."""


def check_mesh(mesh: Mesh) -> None:
    """Raise GeometryError that names the first cell, point or electrode that is wrong."""
    _check_indices(mesh)
    _check_volumes(mesh)
    _check_connected(mesh)
    _check_electrodes(mesh)


def _check_indices(mesh: Mesh) -> None:
    n = len(mesh.points)
    corners = mesh.cells.shape[1]
    if corners not in (3, 4) or not len(mesh.cells):
        raise GeometryError(
            f"expected triangles (n, 3) or tetrahedra (n, 4), got cells {mesh.cells.shape}"
        )
    if mesh.points.shape[1] not in (corners - 1, corners) or mesh.points.shape[1] > 3:
        raise GeometryError(
            f"expected points in {corners - 1}D (or triangles in space), "
            f"got {mesh.points.shape[1]} coordinates for cells with {corners} corners"
        )
    if not np.isfinite(mesh.points).all():
        bad = int(np.argmax(~np.isfinite(mesh.points).all(axis=1)))
        raise GeometryError("expected finite coordinates", where=f"point {bad}")
    for name, table in [("cell", mesh.cells), *_electrode_tables(mesh)]:
        if table.size and (table.min() < 0 or table.max() >= n):
            row = int(np.argmax(((table < 0) | (table >= n)).any(axis=1)))
            raise GeometryError(
                f"expected points from 0 to {n - 1}, got {table[row].tolist()}",
                where=f"{name} {row}" if name == "cell" else name,
            )
    used = np.zeros(n, dtype=bool)
    used[mesh.cells] = True
    if not used.all():
        raise GeometryError(
            "belongs to no cell", where=f"point {int(np.argmin(used))}", hint="remove it"
        )


def _electrode_tables(mesh: Mesh) -> list[tuple[str, np.ndarray]]:  # type: ignore[type-arg]
    return [(f"electrode {i}", facets) for i, facets in enumerate(mesh.electrodes)]


def _check_volumes(mesh: Mesh) -> None:
    corner = mesh.points[mesh.cells]
    size = np.linalg.norm(corner[:, 1:] - corner[:, :1], axis=2).max(axis=1)
    flat = mesh.volumes <= _FLAT * size**mesh.dimension
    if flat.any():
        cell = int(np.argmax(flat))
        raise GeometryError(
            f"is degenerate: its corners {mesh.cells[cell].tolist()} lie on a line or plane",
            where=f"cell {cell}",
        )


def _check_connected(mesh: Mesh) -> None:
    n, pairs = len(mesh.cells), mesh.neighbours
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    pieces, label = connected_components(graph, directed=False)
    if pieces > 1:
        stray = int(np.argmax(label != np.bincount(label).argmax()))
        raise GeometryError(
            f"the mesh is in {pieces} pieces", where=f"cell {stray}", hint="join or remove them"
        )


def _check_electrodes(mesh: Mesh) -> None:
    if not mesh.electrodes:
        raise GeometryError("expected at least one electrode, got none")
    width = mesh.cells.shape[1] - 1
    boundary = {tuple(f) for f in mesh.boundary.tolist()}
    owner: dict[tuple[int, ...], int] = {}
    for number, facets in enumerate(mesh.electrodes):
        where = f"electrode {number}"
        if not len(facets) or facets.shape[1] != width:
            raise GeometryError(
                f"expected facets (n, {width}) with n > 0, got {facets.shape}", where=where
            )
        for facet in np.sort(facets, axis=1).tolist():
            key = tuple(facet)
            if key not in boundary:
                raise GeometryError(f"facet {facet} is not on the boundary", where=where)
            if key in owner:
                raise GeometryError(
                    f"shares facet {facet} with electrode {owner[key]}", where=where
                )
            owner[key] = number
