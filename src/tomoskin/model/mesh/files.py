"""What mesh files hold, some by meshio or pycollada (extra ``mesh``): cells, points, groups of
facets; which of these are electrodes: by name, facets or a function."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError, IntArray, check_is_file, install_hint
from tomoskin.model.mesh.facets import triangulated
from tomoskin.model.mesh.polygon_files import joined, read_obj, read_ply, read_stl
from tomoskin.model.mesh.triangles import boundary_facets

OWN = {".stl": read_stl, ".obj": read_obj, ".ply": read_ply}
READERS = {".msh": "meshio.gmsh", ".vtu": "meshio.vtu", ".dae": "collada"}
"""The module that reads each other ending."""

TOO_LARGE = 10.0
"""A body that extends further than this, m, is taken for one in millimetres."""

MARKER = "electrode"
"""Cell data of this name number facets: n > 0 belongs to the group En."""

_LARGEST = 50_000_000
"""Bytes that a mesh file may have; a million triangles of a .stl take so many."""

_CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "tetra": 4}


def parsed(file: Path) -> Any:
    """The file as meshio would give it."""
    ending = file.suffix.lower()
    if ending in OWN:
        return _read(OWN[ending], file)
    name = READERS.get(ending)
    if name is None:
        known = ", ".join((".msh", ".vtu", *OWN, ".dae"))
        raise GeometryError(
            f'expected a file ending in {known}, got "{file.suffix}"', where=str(file)
        )
    try:
        # the reader itself: meshio.read ends the process where a file is damaged
        reader = import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise GeometryError(
            f"{file.suffix} files need {package}", where=str(file), hint=install_hint("mesh")
        ) from error
    return _read(partial(_scene, reader) if name == "collada" else reader.read, file)


def _read(read: Callable[[Path], Any], file: Path) -> Any:
    _check_readable(file)
    try:
        return read(file)
    except GeometryError as error:
        raise GeometryError(error.message, where=str(file), hint=error.hint) from error
    except OSError as error:
        raise GeometryError(f"cannot be read: {error.strerror}", where=str(file)) from error
    except Exception as error:  # a parser meets damage in any way
        detail = f": {error}" if str(error) else ""
        raise GeometryError(
            f"cannot be read as a {file.suffix} file{detail}", where=str(file)
        ) from error


def _scene(collada: Any, file: Path) -> Any:
    """All triangles of a scene, in m; its upward axis is not applied, as RViz has it."""
    if b"<ph>" in file.read_bytes():
        raise GeometryError(
            "expected polygons without holes, got <ph>", hint="cut it into triangles"
        )
    ignored = [collada.common.DaeUnsupportedError, collada.common.DaeBrokenRefError]  # textures
    document = collada.Collada(str(file), ignore=ignored)
    parts = [part for shape in document.scene.objects("geometry") for part in shape.primitives()]
    corners = [part.vertex[cells] for part in parts if (cells := _triangles(part)) is not None]
    whole = np.concatenate([np.zeros((0, 3, 3)), *corners])
    return joined(whole * (document.assetInfo.unitmeter or 1.0))


def _triangles(part: Any) -> IntArray | None:
    """(n, 3) of what a scene draws; None of lines. Its own triangles would cover more than a
    polygon that is not convex."""
    if hasattr(part, "polyindex"):
        ends = part.polyindex.tolist()
        polygons = (part.vertex_index[start:end].tolist() for start, end in ends)
        return triangulated(part.vertex, polygons)
    table = part.vertex_index
    return np.asarray(table, np.int64) if table is not None and table.shape[1] == 3 else None


def _check_readable(file: Path) -> None:
    check_is_file(file, GeometryError)
    if file.stat().st_size > _LARGEST:
        raise GeometryError(
            f"is too large for a mesh ({file.stat().st_size / 1e6:.0f} MB, at most "
            f"{_LARGEST / 1e6:.0f} MB, some million triangles)",
            where=str(file),
            hint="simplify it first; cells of a millimetre are fine enough",
        )


def renumbered(number: IntArray, facets: IntArray, where: str) -> IntArray:
    """Facets by each point's new ``number``; −1, which the mesh refuses, for points of no cell."""
    if facets.dtype.kind not in "iu" or facets.ndim != 2:
        raise GeometryError(
            f"expected facets as rows of point numbers, got {facets.dtype} of shape {facets.shape}",
            where=where,
        )
    outside = (facets < 0) | (facets >= len(number))
    return np.where(outside, -1, number[np.where(outside, 0, facets)])


def cells_of(raw: Any) -> IntArray:
    """(n, k) cells of the highest dimension, which must be all triangles or all tetrahedra."""
    kinds = {block.type for block in raw.cells if len(block.data)}
    strange = sorted(kinds - set(_CORNERS))
    if strange:
        raise GeometryError(
            f"expected triangles or tetrahedra of straight edges, got {', '.join(strange)}",
            hint="cut them into triangles or tetrahedra of first order before saving",
        )
    most = max((_CORNERS[kind] for kind in kinds), default=0)
    if most < 3:
        raise GeometryError("expected triangles or tetrahedra, got no cells")
    tables = [block.data for block in raw.cells if _CORNERS.get(block.type) == most]
    return np.concatenate(tables).astype(np.int64)


def points_of(raw: Any, cells: IntArray, scale: float) -> tuple[FloatArray, float]:
    """(n, d) points in m; those of a flat mesh with two coordinates, and the third of all."""
    if not (math.isfinite(scale) and scale > 0):
        raise GeometryError(f"expected a scale above 0, got {scale:g}")
    points = np.asarray(raw.points, dtype=np.float64) * scale
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise GeometryError(f"expected points of 2 or 3 coordinates, got shape {points.shape}")
    if cells.min() < 0 or cells.max() >= len(points):
        raise GeometryError(
            f"cells refer to points {cells.min()} to {cells.max()}, but the file has "
            f"{len(points)} points"
        )
    extent = np.ptp(points[np.unique(cells)], axis=0)
    if extent.max() > TOO_LARGE:
        raise GeometryError(
            f"extends over {extent.max():.4g} m",
            hint='if the file is in millimetres, say so: unit "mm", or scale=1e-3',
        )
    flat = cells.shape[1] == 3 and points.shape[1] == 3 and extent[2] == 0
    return (points[:, :2], float(points[cells[0, 0], 2])) if flat else (points, 0.0)


def groups_of(raw: Any, corners: int) -> dict[str, IntArray]:
    """Name → (n, corners) facets, for all groups that hold any: cell sets, where gmsh 4.1 has its
    named physical groups; those of gmsh by name, or number where they have none; and marks."""
    physical = {
        int(number): name
        for name, (number, dimension) in raw.field_data.items()
        if dimension == corners - 1
    }
    parts: dict[str, list[IntArray]] = {}
    for source in (
        _sets(raw, corners),
        _by_number(raw, "gmsh:physical", corners, lambda n: physical.get(n, str(n))),
        _by_number(raw, MARKER, corners, "E{}".format),
    ):
        groups: dict[str, list[IntArray]] = {}
        for name, facets in source:
            groups.setdefault(name, []).append(facets)
        parts = {**groups, **parts}  # what is a set already is not read twice
    joined = {name: np.concatenate(tables).astype(np.int64) for name, tables in parts.items()}
    return {name: facets for name, facets in joined.items() if len(facets)}


def _sets(raw: Any, corners: int) -> Iterator[tuple[str, IntArray]]:
    for name, members in raw.cell_sets.items():
        for block, chosen in zip(raw.cells, members, strict=True):
            if not name.startswith("gmsh:") and chosen is not None and _fits(block, corners):
                yield name, block.data[np.asarray(chosen, dtype=np.int64)]


def _by_number(
    raw: Any, key: str, corners: int, name: Callable[[int], str]
) -> Iterator[tuple[str, IntArray]]:
    for block, values in zip(raw.cells, raw.cell_data.get(key, ()), strict=False):
        if _fits(block, corners):
            numbers = np.asarray(values).reshape(-1)
            for number in np.unique(numbers[numbers > 0]).tolist():
                yield name(int(number)), block.data[numbers == number]


def _fits(block: Any, corners: int) -> bool:
    return len(block.data) > 0 and block.data.shape[1] == corners


_NUMBERED = re.compile(r"(?:e|el|elec|electrode)[\s_-]*(\d+)", re.IGNORECASE)

Chooser = Callable[[FloatArray], ArrayLike]
"""(n, d) centroids of boundary facets → (n,) electrode of each, −1 for none."""


Electrodes = Sequence[str] | Sequence[ArrayLike] | Chooser | None
"""How electrodes are given: names of groups in the file, in their order; facet arrays in the
file's own point numbers; a function of centroids; None for the groups named E1, E2, …"""


def choose(
    points: FloatArray, cells: IntArray, groups: Mapping[str, IntArray], electrodes: Electrodes
) -> tuple[IntArray, ...]:
    """Facets (n, k − 1) of each electrode.

    Raises
    ------
    GeometryError
        When a group does not exist, or an electrode has no facet.
    """
    match electrodes:
        case None:
            chosen = _named(groups, _numbered(groups))
        case _ if callable(electrodes):
            chosen = _numbers(points, cells, electrodes)
        case _ if any(isinstance(e, str) for e in electrodes):
            chosen = _named(groups, [str(e) for e in electrodes])
        case _:
            chosen = [np.asarray(e) for e in electrodes]
    for number, facets in enumerate(chosen):
        if not facets.size:
            raise GeometryError("has no facet on the boundary", where=f"E{number + 1}")
    return tuple(chosen)


def _numbered(groups: Mapping[str, IntArray]) -> list[str]:
    """Names of the groups that are called after an electrode, by its number."""
    numbered = {name: m for name in groups if (m := _NUMBERED.fullmatch(name.strip()))}
    if not numbered:
        raise GeometryError(
            f"no group is named as an electrode (E1, E2, …); {_listing(groups)}",
            hint="say which facets are electrodes: electrodes=…",
        )
    return sorted(numbered, key=lambda name: int(numbered[name][1]))


def _named(groups: Mapping[str, IntArray], names: Sequence[str]) -> list[IntArray]:
    for name in names:
        if name not in groups:
            raise GeometryError(f'no group of facets is named "{name}"; {_listing(groups)}')
    return [groups[name] for name in names]


def _listing(groups: Mapping[str, IntArray]) -> str:
    return f"groups: {', '.join(groups)}" if groups else "the file has no groups of facets"


def _numbers(points: FloatArray, cells: IntArray, chooser: Chooser) -> list[IntArray]:
    facets = boundary_facets(cells)
    if not len(facets):
        raise GeometryError("the surface is closed: it has no rim for electrodes")
    number = np.asarray(chooser(points[facets].mean(axis=1)))
    if number.shape != (len(facets),) or number.dtype.kind not in "iu":
        raise GeometryError(
            f"expected one whole number for each of {len(facets)} facets, "
            f"got {number.dtype} of shape {number.shape}"
        )
    return [facets[number == n] for n in range(1 + int(number.max()))]
