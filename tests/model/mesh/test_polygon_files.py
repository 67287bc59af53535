"""Polygons of files as triangles: concave ones, every spelling of .obj, .ply and .stl; overlaps."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from tomoskin.core import GeometryError
from tomoskin.model.mesh import Draped, Mesh, MeshFile
from tomoskin.model.mesh.facets import triangulated
from tomoskin.model.mesh.overlap import check_overlaps
from tomoskin.model.mesh.triangles import simplex_measure

L = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
"""Of area 3; a fan from its first corner happens to be right, from its second it has 4."""
CORNERS = [(0, 0, 0), (0.1, 0, 0), (0.1, 0.2, 0), (0, 0.2, 0)]
CORNERS += [(x, y, 0.05) for x, y, _ in CORNERS]
QUADS = [(1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
TRIANGLES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
V = "".join("v {} {} {}\n".format(*p) for p in CORNERS)


def flat(xy):
    return np.pad(np.asarray(xy, float), ((0, 0), (0, 1)))


def area(points, cells):
    return simplex_measure(points, cells).sum()


def assert_covers(points, cells, expected):
    assert area(points, cells) == pytest.approx(expected)
    if len(cells):
        check_overlaps(points, cells)
        assert simplex_measure(points, cells).min() > 1e-9


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("way", [1, -1])
def test_a_concave_polygon_is_covered_once(first, way):
    polygon = np.roll(np.arange(6)[::way], first)
    assert_covers(flat(L), triangulated(flat(L), [polygon]), 3.0)


@pytest.mark.parametrize("seed", range(8))
def test_any_simple_polygon_is_covered_once(seed):
    """A star-shaped outline of random radii, in a random plane, with corners on its sides."""
    random = np.random.default_rng(seed)
    angle = np.sort(random.uniform(0, 2 * np.pi, 12))
    rim = random.uniform(0.2, 1, 12)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() > 3:
        rim = np.vstack([rim, [[0.0, 0.0]]])
    rim = np.stack([rim, (rim + np.roll(rim, -1, axis=0)) / 2], axis=1).reshape(-1, 2)
    x, y = rim.T
    expected = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    points = flat(rim) @ turn
    cells = triangulated(points, [np.arange(len(rim))])
    assert_covers(points, cells, expected)


def test_polygons_of_different_sizes_keep_their_order_and_turn():
    points = flat([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0.5]])
    cells = triangulated(points, [[1, 4, 2], [0, 1, 2, 3]])
    assert cells[0].tolist() == [1, 4, 2]
    assert_covers(points, cells, 1.5)
    u, v = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2))
    assert (np.cross(u, v)[:, 2] > 0).all()


def test_sides_that_cross_are_refused():
    star = np.array([[np.cos(a), np.sin(a)] for a in 4 * np.pi * np.arange(5) / 5])
    for polygon in (star, [[0, 0], [1, 1], [1, 0], [0, 1.2]]):
        with pytest.raises(GeometryError, match="sides do not cross"):
            triangulated(flat(polygon), [np.arange(len(polygon))])


OBJ = {
    "texture": V + "vt 0 0\nvt 1 1\n" + "".join("f {}/1 {}/2 {}/1\n".format(*t) for t in TRIANGLES),
    "normals": V + "vn 0 0 1\n" + "".join("f {}//1 {}//1 {}//1\n".format(*t) for t in TRIANGLES),
    "quads": V + "".join("f {} {} {} {}\n".format(*q) for q in QUADS),
    "mixed": V + "f 1 4 3 2\n" + "".join("f {} {} {}\n".format(*t) for t in TRIANGLES[2:]),
    "colours": V.replace("\n", " 1 0 0\n") + "".join("f {} {} {}\n".format(*t) for t in TRIANGLES),
    "negative": V + "".join("f {} {} {}\n".format(*(i - 9 for i in t)) for t in TRIANGLES),
    "continued": V + "".join("f {} \\\n {} {}\n".format(*t) for t in TRIANGLES),
    "groups": "mtllib é.mtl\no box\n" + V + "g a\nusemtl x\ns off\r\n"
    + "".join("\tf {} {} {} # side\r\n".format(*t) for t in TRIANGLES) + "l 1 2\n",
}  # fmt: skip


def assert_is_the_box(path):
    file = MeshFile.read(path)
    assert np.ptp(file.places, axis=0) == pytest.approx([0.1, 0.2, 0.05])
    assert area(file.points, file.cells) == pytest.approx(2 * (0.02 + 0.005 + 0.01))


@pytest.mark.parametrize("spelling", OBJ)
def test_every_spelling_of_obj(tmp_path, spelling):
    (tmp_path / "box.obj").write_text(OBJ[spelling], encoding="utf-8")
    assert_is_the_box(tmp_path / "box.obj")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (V + "f 1 2 0\n", 'line 9: "f 1 2 0": corners count from 1'),
        (V + "f 1 2\n", "line 9: expected three or more values"),
        (V + "f 1 2 9\n", r"corners \[0, 1, 8\], and the file has 8 points"),
        (V + "f 1 2 -9\n", "and the file has 8 points"),
        ("v 0 x 0\n", 'line 1: "v 0 x 0"'),
        (V, "got no cells"),
    ],
)
def test_what_is_wrong_with_an_obj_is_said(tmp_path, text, said):
    (tmp_path / "box.obj").write_text(text)
    with pytest.raises(GeometryError, match=said):
        MeshFile.read(tmp_path / "box.obj")


def ply(kind, index, faces, name="vertex_indices"):
    """A .ply with a colour, a flag and an element that says nothing of the shape."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    head = [
        "ply", f"format {kind} 1.0", "comment made for a test", f"element vertex {len(CORNERS)}",
        *(f"property double {axis}" for axis in "xyz"), "property uchar red",
        f"element face {len(faces)}", "property uchar flag", f"property list uchar {index} {name}",
        "element edge 1", "property int vertex1", "property int vertex2", "end_header",
    ]  # fmt: skip
    faces = [[i - 1 for i in face] for face in faces]
    if not order:
        rows = [*(f"{x} {y} {z} 7" for x, y, z in CORNERS)]
        rows += [f"1 {len(f)} {' '.join(map(str, f))}" for f in faces]
        return "\n".join([*head, *rows, "0 1", ""]).encode()
    code = {"ushort": "H", "uint": "I", "int16": "h", "int": "i"}[index]
    body = b"".join(struct.pack(f"{order}3dB", *p, 7) for p in CORNERS)
    body += b"".join(struct.pack(f"{order}BB{len(f)}{code}", 1, len(f), *f) for f in faces)
    return "\n".join([*head, ""]).encode() + body + struct.pack(f"{order}2i", 0, 1)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("index", ["ushort", "uint", "int16"])
@pytest.mark.parametrize("faces", [TRIANGLES, QUADS, [QUADS[0], *TRIANGLES[2:]]])
def test_every_spelling_of_ply(tmp_path, kind, index, faces):
    name = "vertex_index" if index == "uint" else "vertex_indices"
    data = ply(kind, index, faces, name)
    (tmp_path / "box.ply").write_bytes(data)
    assert_is_the_box(tmp_path / "box.ply")
    (tmp_path / "box.ply").write_bytes(data[:-40])
    with pytest.raises(GeometryError, match=r"box\.ply: cannot be read as a \.ply file"):
        MeshFile.read(tmp_path / "box.ply")


def test_a_concave_face_of_any_file_has_its_area(tmp_path):
    faces = "2 3 4 5 6 1"
    (tmp_path / "l.obj").write_text("".join(f"v {x} {y} 0\n" for x, y in 0.1 * L) + f"f {faces}\n")
    (tmp_path / "l.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(f"{x} {y} 0\n" for x, y in 0.1 * L)
        + "6 1 2 3 4 5 0\n"
    )
    for name in ("l.obj", "l.ply"):
        file = MeshFile.read(tmp_path / name)
        assert_covers(file.points, file.cells, 0.03)
        assert Draped.read(tmp_path / name).outline.area == pytest.approx(0.03)


STL = "solid a\n" + "".join(
    "facet normal 0 0 0\nouter loop\n"
    + "".join("vertex {} {} {}\n".format(*CORNERS[i - 1]) for i in t)
    + "endloop\nendfacet\n"
    for t in TRIANGLES
)


def test_stl_as_text_in_capitals_and_in_two_solids(tmp_path):
    half = 1 + STL.index("\nfacet", len(STL) // 2)
    for text in (STL, STL.upper(), f"{STL[:half]}endsolid a\nSolid b\n{STL[half:]}endsolid b\n"):
        (tmp_path / "box.stl").write_text(text)
        assert_is_the_box(tmp_path / "box.stl")
        assert len(MeshFile.read(tmp_path / "box.stl").points) == 8


def test_a_binary_stl_may_begin_like_text(tmp_path):
    rows = b"".join(
        struct.pack("<12fH", 0, 0, 0, *np.ravel([CORNERS[i - 1] for i in t]), 0) for t in TRIANGLES
    )
    data = b"solid".ljust(80) + struct.pack("<I", 12) + rows
    (tmp_path / "box.stl").write_bytes(data)
    assert_is_the_box(tmp_path / "box.stl")
    for damaged, said in ((data[5:-50], "expected"), (STL[:-20].encode(), "3 corners for each")):
        (tmp_path / "box.stl").write_bytes(damaged)
        with pytest.raises(GeometryError, match=said):
            MeshFile.read(tmp_path / "box.stl")


FAN = [[1, 2, 3], [1, 3, 4], [1, 4, 5], [1, 5, 0]]


def test_triangles_that_overlap_are_refused(tmp_path):
    """The fan of a concave polygon, flat and on a slope; a strip that winds over itself."""
    for height in (0 * L[:, :1], 0.5 * L[:, :1]):
        points = 0.1 * np.hstack([L, height])
        text = "".join("v {} {} {}\n".format(*p) for p in points)
        text += "".join("f {} {} {}\n".format(*(i + 1 for i in t)) for t in FAN)
        (tmp_path / "l.obj").write_text(text)
        with pytest.raises(GeometryError, match="pairs of cells overlap, the first near"):
            Draped.read(tmp_path / "l.obj")
        with pytest.raises(GeometryError, match="cells overlap"):
            Mesh.read(tmp_path / "l.obj", [[[1, 2]]])


def test_a_strip_that_lies_over_itself_is_refused():
    angle = np.linspace(0, 2.2 * np.pi, 40)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([0.5 * ring, ring])
    cells = [t for k in range(39) for t in ([k, k + 1, 40 + k], [k + 1, 41 + k, 40 + k])]
    with pytest.raises(GeometryError, match="cells overlap"):
        check_overlaps(points, np.array(cells))
    check_overlaps(points, np.array(cells[:70]))


def test_tetrahedra_on_one_side_of_a_face_are_refused():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, -1], [0.2, 0.2, 2.0]])
    check_overlaps(points, np.array([[0, 1, 2, 3], [2, 0, 4, 1]]))
    with pytest.raises(GeometryError, match="cells 0 and 1"):
        check_overlaps(points, np.array([[0, 1, 2, 3], [2, 0, 5, 1]]))
