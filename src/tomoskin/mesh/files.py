"""Meshes from files: .msh, .vtu, .stl, .obj, .ply, by meshio (extra ``mesh``)."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Self

import numpy as np

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.mesh.choose import Electrodes, choose
from tomoskin.mesh.content import cells_of, groups_of, points_of
from tomoskin.mesh.mesh import Mesh

READERS = {".msh": "gmsh", ".vtu": "vtu", ".stl": "stl", ".obj": "obj", ".ply": "ply"}
"""meshio's reader for each ending."""


def read_mesh(path: str | Path, electrodes: Electrodes = None, *, scale: float = 1.0) -> Mesh:
    """Read a mesh; see :class:`MeshFile` for what is read and :data:`Electrodes` for the choice.

    Raises
    ------
    GeometryError
        When meshio is not installed, the file cannot be read or holds no usable cells, it seems
        to be in millimetres, a cell repeats another one, or an electrode has no facet.
    """
    return MeshFile.read(path, scale=scale).mesh(electrodes)


@dataclass(frozen=True, eq=False)
class MeshFile:
    """What a mesh file holds.

    Triangles all in one plane z = const lose that coordinate. Points that belong to no cell are
    dropped when the mesh is made.

    Attributes
    ----------
    points
        (n, d) m.
    cells
        (n_cells, k) triangles or tetrahedra.
    groups
        Name → (n, k − 1) facets: gmsh's physical groups, cell sets, and numbers in cell data
        named "electrode".
    source
        The path, for messages.
    """

    points: FloatArray
    cells: IntArray
    groups: dict[str, IntArray]
    source: str

    @classmethod
    def read(cls, path: str | Path, *, scale: float = 1.0) -> Self:
        """Read ``path``; its coordinates times ``scale`` are m. Raises GeometryError."""
        file = Path(path)
        raw = _parsed(file)
        try:
            cells = cells_of(raw)
            points = points_of(raw, cells, scale)
            groups = groups_of(raw, cells.shape[1] - 1)
        except GeometryError as error:
            raise _at(error, str(file)) from error
        return cls(points, cells, groups, str(file))

    def mesh(self, electrodes: Electrodes = None) -> Mesh:
        """Return the mesh with those electrodes. Raises GeometryError."""
        try:
            _check_repeats(self.cells)
            facets = choose(self.points, self.cells, self.groups, electrodes)
            used, compact = np.unique(self.cells, return_inverse=True)
            place = np.full(len(self.points), -1)
            place[used] = np.arange(len(used))
            moved = [_renumbered(place, f, f"electrode {i}") for i, f in enumerate(facets)]
            return Mesh(self.points[used], compact.reshape(self.cells.shape), tuple(moved))
        except GeometryError as error:
            raise _at(error, self.source) from error


def _at(error: GeometryError, source: str) -> GeometryError:
    where = f"{source}, {error.where}" if error.where else source
    return GeometryError(error.message, where=where, hint=error.hint)


def _parsed(file: Path) -> Any:
    """What meshio makes of the file."""
    name = READERS.get(file.suffix.lower())
    if name is None:
        raise GeometryError(
            f'expected a file ending in {", ".join(READERS)}, got "{file.suffix}"', where=str(file)
        )
    try:
        # the reader itself: meshio.read ends the process where a file is damaged
        reader = import_module(f"meshio.{name}")
    except ImportError as error:
        raise GeometryError(
            "mesh files need meshio", where=str(file), hint="pip install 'tomoskin[mesh]'"
        ) from error
    try:
        with np.errstate(over="ignore"):  # its test for binary STL multiplies text
            return reader.read(file)
    except OSError as error:
        raise GeometryError(f"cannot be read: {error.strerror}", where=str(file)) from error
    except Exception as error:  # a parser meets damage in any way
        detail = f": {error}" if str(error) else ""
        raise GeometryError(
            f"is no {file.suffix} file that can be read{detail}", where=str(file)
        ) from error


def _check_repeats(cells: IntArray) -> None:
    """Raise GeometryError that names a cell with the corners of an earlier one."""
    ordered = np.sort(cells, axis=1)
    _, first, place = np.unique(ordered, axis=0, return_index=True, return_inverse=True)
    earlier = first[place.reshape(-1)]
    again = earlier < np.arange(len(cells))
    if again.any():
        cell = int(np.argmax(again))
        raise GeometryError(f"repeats cell {earlier[cell]}", where=f"cell {cell}")


def _renumbered(place: IntArray, facets: IntArray, where: str) -> IntArray:
    """Facets in the mesh's numbers; −1, which the mesh refuses, for points of no cell."""
    if facets.dtype.kind not in "iu" or facets.ndim != 2:
        raise GeometryError(
            f"expected facets as rows of point numbers, got {facets.dtype} of shape {facets.shape}",
            where=where,
        )
    outside = (facets < 0) | (facets >= len(place))
    return np.where(outside, -1, place[np.where(outside, 0, facets)])
