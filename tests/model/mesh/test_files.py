"""Mesh files: written here, read back; electrodes by name, facets and function."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from shapes import box, cylinder, disc
from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh import Mesh, MeshFile, simplex_measure as measure

KINDS = {2: ("line", "triangle"), 3: ("triangle", "tetra")}
Save = Callable[[Mesh, str], Path]


def bar() -> Mesh:
    return box(np.linspace(-0.15, 0.15, 5), np.linspace(-0.02, 0.02, 3), np.linspace(0, 0.03, 3))


def in_space(points: FloatArray) -> FloatArray:
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def physical(mesh: Mesh, names: list[str]) -> meshio.Mesh:
    """As gmsh 2.2 stores it: every electrode a named physical group of facets."""
    facet, cell = KINDS[mesh.dimension]
    tags = [np.full(len(e), i + 1) for i, e in enumerate(mesh.electrodes)]
    tags.append(np.full(len(mesh.cells), 99))
    field = {name: np.array([i + 1, mesh.dimension - 1]) for i, name in enumerate(names)}
    return meshio.Mesh(
        in_space(mesh.points),
        [*((facet, e) for e in mesh.electrodes), (cell, mesh.cells)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={**field, "body": np.array([99, mesh.dimension])},
    )


def same(one: Mesh, other: Mesh) -> None:
    assert one.points == pytest.approx(other.points, abs=1e-12)
    assert np.array_equal(one.cells, other.cells)
    assert len(one.electrodes) == len(other.electrodes)
    for a, b in zip(one.electrodes, other.electrodes, strict=True):
        assert np.array_equal(_rows(a), _rows(b))


def _rows(facets: IntArray) -> IntArray:
    return np.unique(np.sort(facets, axis=1), axis=0)


# Round trips.


@pytest.mark.parametrize("make", [bar, disc])
@pytest.mark.parametrize("binary", [True, False])
def test_msh_22_with_named_groups(tmp_path: Path, make: Callable[[], Mesh], binary: bool) -> None:
    mesh, file = make(), tmp_path / "a.msh"
    names = [f"E{i + 1}" for i in range(len(mesh.electrodes))]
    meshio.gmsh.write(file, physical(mesh, names), "2.2", binary=binary)
    same(Mesh.read(file), mesh)
    same(Mesh.read(file, names[::-1]), Mesh(mesh.points, mesh.cells, mesh.electrodes[::-1]))


def test_groups_are_ordered_by_number_not_by_text(tmp_path: Path) -> None:
    mesh = cylinder(0.1, 0.04, count=11, span=(0, 0.04), cells=500, layers=2)
    names = [f"electrode_{i + 1}" for i in range(11)]
    meshio.gmsh.write(tmp_path / "a.msh", physical(mesh, names), "2.2", binary=False)
    same(Mesh.read(tmp_path / "a.msh"), mesh)


def test_msh_22_with_groups_that_have_numbers_only(tmp_path: Path) -> None:
    raw = physical(bar(), ["E1", "E2"])
    raw.field_data = {}
    meshio.gmsh.write(tmp_path / "a.msh", raw, "2.2", binary=False)
    same(Mesh.read(tmp_path / "a.msh", ["1", "2"]), bar())


MSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
1 7 "E1"
1 5 "E2"
2 9 "sheet"
$EndPhysicalNames
$Entities
0 2 1 0
1 0 0 0 1 0 0 1 7 0
2 0 1 0 1 1 0 1 5 0
1 0 0 0 1 1 0 1 9 0
$EndEntities
$Nodes
1 5 10 80
2 1 0 5
10
20
40
80
60
0 0 0
1 0 0
1 1 0
0 1 0
5 5 0
$EndNodes
$Elements
3 4 1 4
1 1 1 1
1 10 20
1 2 1 1
2 40 80
2 1 2 2
3 10 20 40
4 10 40 80
$EndElements
"""


def test_msh_41_with_sparse_numbers_and_a_stray_point(tmp_path: Path) -> None:
    file = tmp_path / "square.MSH"
    file.write_text(MSH_41)
    mesh = Mesh.read(file)
    assert mesh.points.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert [e.tolist() for e in mesh.electrodes] == [[[0, 1]], [[2, 3]]]


@pytest.mark.parametrize("make", [bar, disc])
def test_vtu_with_numbered_facets(tmp_path: Path, make: Callable[[], Mesh]) -> None:
    mesh, file = make(), tmp_path / "a.vtu"
    facet, cell = KINDS[mesh.dimension]
    numbers = np.repeat(np.arange(len(mesh.electrodes)) + 1, [len(e) for e in mesh.electrodes])
    meshio.vtu.write(
        file,
        meshio.Mesh(
            in_space(mesh.points),
            [(facet, np.concatenate(mesh.electrodes)), (cell, mesh.cells)],
            cell_data={"electrode": [numbers, np.zeros(len(mesh.cells), dtype=int)]},
        ),
    )
    same(Mesh.read(file), mesh)


def test_facets_in_the_files_own_numbers(save: Save) -> None:
    mesh = bar()
    stray = np.vstack([np.full((3, 3), 0.5), mesh.points])  # three points of no cell come first
    file = save(Mesh(mesh.points, mesh.cells, mesh.electrodes), "a.vtu")
    meshio.vtu.write(file, meshio.Mesh(stray, [("tetra", mesh.cells + 3)]))
    same(Mesh.read(file, [e + 3 for e in mesh.electrodes]), mesh)


def test_electrodes_by_a_function_of_centroids(save: Save) -> None:
    def ends(x: FloatArray) -> IntArray:
        return np.where(x[:, 0] < -0.149, 0, np.where(x[:, 0] > 0.149, 1, -1))

    same(Mesh.read(save(bar(), "a.vtu"), ends), bar())


def test_scale(save: Save) -> None:
    mesh = bar()
    large = Mesh(mesh.points * 1000, mesh.cells, mesh.electrodes)
    file = save(large, "mm.vtu")
    with pytest.raises(GeometryError, match=r"extends over 300 m.*scale=1e-3"):
        MeshFile.read(file)
    got = Mesh.read(file, mesh.electrodes, scale=1e-3)
    assert got.points == pytest.approx(mesh.points, abs=1e-15)


@pytest.mark.parametrize("binary", [True, False])
def test_stl_joins_the_corners_of_its_triangles(tmp_path: Path, binary: bool) -> None:
    mesh, file = disc(), tmp_path / "disc.stl"
    meshio.stl.write(
        file, meshio.Mesh(in_space(mesh.points), [("triangle", mesh.cells)]), binary=binary
    )
    middles = np.array([mesh.points[e].mean(axis=(0, 1)) for e in mesh.electrodes])

    def nearest(x: FloatArray) -> IntArray:
        gap = np.linalg.norm(x[:, None, :2] - middles, axis=2)
        return np.where(gap.min(axis=1) <= 0.011, gap.argmin(axis=1), -1)

    got = Mesh.read(file, nearest)
    assert len(got.points) == len(mesh.points)
    assert got.volumes == pytest.approx(mesh.volumes, rel=1e-4)
    for a, b in zip(got.electrodes, mesh.electrodes, strict=True):
        assert measure(got.points, a).sum() == pytest.approx(
            measure(mesh.points, b).sum(), rel=1e-4
        )


def test_obj_of_a_curved_sheet_keeps_three_coordinates(tmp_path: Path) -> None:
    mesh = disc()
    dome = np.column_stack([mesh.points, 0.01 - (mesh.points**2).sum(axis=1)])
    file = tmp_path / "dome.obj"
    meshio.obj.write(file, meshio.Mesh(dome, [("triangle", mesh.cells)]))
    same(Mesh.read(file, mesh.electrodes), Mesh(dome, mesh.cells, mesh.electrodes))


# What is refused.


@pytest.fixture
def save(tmp_path: Path) -> Save:
    """Write a mesh's cells alone."""

    def write(mesh: Mesh, name: str) -> Path:
        file = tmp_path / name
        kind = KINDS[mesh.dimension][1]
        meshio.vtu.write(file, meshio.Mesh(in_space(mesh.points), [(kind, mesh.cells)]))
        return file

    return write


def test_unknown_ending(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match=r"\.msh, \.vtu, \.stl, \.obj"):
        MeshFile.read(tmp_path / "a.step")


@pytest.mark.parametrize("ending", [".msh", ".vtu", ".stl", ".obj"])
def test_missing_file(tmp_path: Path, ending: str) -> None:
    with pytest.raises(GeometryError, match="no such file") as caught:
        MeshFile.read(tmp_path / f"none{ending}")
    assert f"none{ending}" in caught.value.where


@pytest.mark.parametrize("ending", [".msh", ".vtu", ".stl", ".obj"])
@pytest.mark.parametrize("content", [b"", b"\x00\xff" * 60, b"f 1 2\nv x\n", b"$MeshFormat\n2.2 0"])
def test_damaged_file(tmp_path: Path, ending: str, content: bytes) -> None:
    file = tmp_path / f"bad{ending}"
    file.write_bytes(content)
    with pytest.raises(GeometryError) as caught:
        MeshFile.read(file)
    assert "bad" in caught.value.where


def test_without_meshio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "meshio.vtu", None)
    with pytest.raises(GeometryError, match="need meshio") as caught:
        MeshFile.read(tmp_path / "a.vtu")
    assert '-m pip install "meshio' in caught.value.hint


def write_cells(path: Path, points: FloatArray, cells: list[tuple[str, Any]]) -> Path:
    meshio.vtu.write(path, meshio.Mesh(points, cells))
    return path


POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]
)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([("line", [[0, 1]])], "got no cells"),
        ([("vertex", [[0]])], "got no cells"),
        ([("quad", [[0, 1, 2, 3]])], "got quad"),
        ([("tetra", [[0, 1, 2, 4]]), ("hexahedron", [range(8)])], "got hexahedron"),
        ([("triangle", [[0, 1, 2]]), ("quad", [[4, 5, 6, 7]])], "got quad"),
        ([("triangle6", [[0, 1, 2, 3, 4, 5]])], "first order"),
    ],
)
def test_cells_that_will_not_do(tmp_path: Path, cells: Any, message: str) -> None:
    file = write_cells(tmp_path / "a.vtu", POINTS, [(k, np.array(c)) for k, c in cells])
    with pytest.raises(GeometryError, match=message):
        MeshFile.read(file)


def test_cells_of_points_that_do_not_exist(tmp_path: Path) -> None:
    file = tmp_path / "a.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    with pytest.raises(GeometryError, match="the file has 3"):
        MeshFile.read(file)


def test_a_cell_that_stands_twice_is_named(tmp_path: Path) -> None:
    cells = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0]])
    file = write_cells(tmp_path / "a.vtu", POINTS[:4], [("triangle", cells)])
    with pytest.raises(GeometryError, match="in one or two cells") as caught:
        Mesh.read(file, [[[0, 1]]])
    assert caught.value.where.endswith("a.vtu, cells 0, 2, 1")
    assert "one is listed twice" in caught.value.hint


def test_a_degenerate_cell_is_named(tmp_path: Path) -> None:
    cells = np.array([[0, 1, 2], [0, 2, 2]])
    file = write_cells(tmp_path / "a.vtu", POINTS[:4], [("triangle", cells)])
    with pytest.raises(GeometryError, match="degenerate") as caught:
        Mesh.read(file, [[[0, 1]]])
    assert caught.value.where.endswith("a.vtu, cell 1")


@pytest.mark.parametrize(
    ("electrodes", "message"),
    [
        (None, "no group is named as an electrode"),
        (["E1"], 'no group of facets is named "E1"; the file has no groups'),
        ([], "at least one electrode"),
        ([[[0, 1, 500]]], "expected points"),
        ([[[0, 1, -1]]], "expected points"),
        ([[[0.5, 1, 2]]], "rows of point numbers"),
        ([[]], "has no facet"),
        (lambda x: np.full(len(x), -1), "at least one electrode"),
        (lambda x: np.arange(len(x)) * 2, r"has no facet"),
        (lambda _: np.zeros(3, dtype=int), "one whole number for each"),
        (lambda x: np.zeros(len(x)), "one whole number for each"),
    ],
)
def test_electrodes_that_cannot_be(save: Save, electrodes: Any, message: str) -> None:
    with pytest.raises(GeometryError, match=message) as caught:
        Mesh.read(save(bar(), "a.vtu"), electrodes)
    assert "a.vtu" in caught.value.where


def test_a_closed_surface_has_no_rim(tmp_path: Path) -> None:
    shell = bar().boundary
    file = write_cells(tmp_path / "a.vtu", bar().points, [("triangle", shell)])
    with pytest.raises(GeometryError, match="closed"):
        Mesh.read(file, lambda x: np.zeros(len(x), dtype=int))
    assert len(MeshFile.read(file).cells) == len(shell)  # what it holds can be had


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_impossible_scale(save: Save, scale: float) -> None:
    with pytest.raises(GeometryError, match="scale"):
        MeshFile.read(save(bar(), "a.vtu"), scale=scale)


def test_known_groups_are_listed(tmp_path: Path) -> None:
    meshio.gmsh.write(tmp_path / "a.msh", physical(bar(), ["left", "right"]), "2.2", binary=False)
    with pytest.raises(GeometryError, match="groups: left, right"):
        Mesh.read(tmp_path / "a.msh")
