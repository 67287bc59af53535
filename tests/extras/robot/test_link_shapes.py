"""What a robot's links look like: sizes, places, files, and what cannot be drawn."""

from __future__ import annotations

import re
import struct

import numpy as np
import pytest

from tomoskin.core import GeometryError, SkinError
from tomoskin.extras.robot import Urdf
from tomoskin.extras.robot.link_shapes import box, capsule, rod, thinned
from tomoskin.model.mesh import Draped, MeshFile

LINKS = """<link name="a">
  <visual><origin xyz="0 0 1"/><geometry><box size="0.2 0.4 0.6"/></geometry></visual>
  <visual><geometry><sphere radius="0.1"/></geometry></visual>
  <collision><geometry><cylinder radius="9" length="9"/></geometry></collision></link>
<link name="b"><collision><origin rpy="0 1.5707963267948966 0"/>
  <geometry><cylinder radius="0.1" length="0.5"/></geometry></collision></link>
<link name="c"><visual><geometry>
  <mesh filename="package://arm/meshes/c.stl" scale="0.001 0.001 -0.002"/>
  </geometry></visual></link>
<link name="d"/>"""
CORNERS = np.array([[[0, 0, 0], [100, 0, 0], [0, 50, 10]]], dtype=np.float64)


def write_stl(path, triangles):
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = (struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + b"".join(rows))


def solids_of(folder, links):
    path = folder / "arm" / "urdf" / "arm.urdf"
    path.parent.mkdir(parents=True, exist_ok=True)
    first, *others = re.findall('<link name="(.)"', links)
    held = (
        f'<joint name="{n}"><parent link="{first}"/><child link="{n}"/></joint>' for n in others
    )
    path.write_text(f'<robot name="arm">{links}{"".join(held)}</robot>')
    return {solid.link: solid for solid in Urdf.read(path).solids()}


def area(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize(
    ("triangles", "whole"),
    [
        (box(np.array([1.0, 2.0, 3.0])), 22.0),
        (rod(0.5, 2.0), 2 * np.pi * 0.25 + 2 * np.pi * 0.5 * 2),
        (capsule(0.5), np.pi),
        (capsule(0.5, 2.0), np.pi + 2 * np.pi * 0.5 * 2),
    ],
)
def test_a_shape_is_closed_and_has_its_size(triangles, whole):
    assert area(triangles) == pytest.approx(whole, rel=0.02)
    edges = np.concatenate([np.roll(triangles, k, axis=1)[:, :2] for k in range(3)]).round(9) + 0.0
    counts = {}
    for edge in edges:
        ends = frozenset(map(tuple, edge))
        counts[ends] = counts.get(ends, 0) + 1
    assert set(counts.values()) == {2}


def test_links_are_drawn_by_what_is_seen_else_by_what_may_collide(tmp_path):
    write_stl(tmp_path / "arm" / "meshes" / "c.stl", CORNERS)
    solids = solids_of(tmp_path, LINKS)
    assert [*solids] == ["a", "b", "c"]
    assert all(not solid.problems for solid in solids.values())
    low, high = (
        getattr(solids["a"].triangles.reshape(-1, 3), end)(axis=0) for end in ("min", "max")
    )
    assert low == pytest.approx([-0.1, -0.2, -0.1], abs=1e-9)
    assert high == pytest.approx([0.1, 0.2, 1.3], abs=1e-9)
    assert np.abs(solids["b"].triangles).reshape(-1, 3).max(axis=0) == pytest.approx(
        [0.25, 0.1, 0.1]
    )
    expected = [[[0, 0, 0], [0.1, 0, 0], [0, 0.05, -0.02]]]
    assert solids["c"].triangles == pytest.approx(np.array(expected))


COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
 <source id="p"><float_array id="f" count="12">0 0 0 1 0 0 1 2 0 0 2 0</float_array>
  <technique_common><accessor source="#f" count="4" stride="3"><param name="X" type="float"/>
  <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
 </source>
 <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
 <polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/>
  <vcount>4</vcount><p>0 1 2 3</p></polylist>
 <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
 <lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2</p></lines>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>0 0 5</translate>
 <node><rotate>0 0 1 90</rotate><instance_geometry url="#g"/></node></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


@pytest.mark.filterwarnings("ignore:the matrix subclass")  # of pycollada's
def test_a_collada_file_is_drawn_where_its_scene_and_its_unit_put_it(tmp_path):
    pytest.importorskip("collada")
    file = tmp_path / "arm" / "meshes" / "c.dae"
    file.parent.mkdir(parents=True)
    file.write_text(COLLADA)
    link = LINKS[LINKS.index('<link name="c"') :].replace(".stl", ".dae").replace("0.001", "1")
    (solid,) = solids_of(tmp_path, link.replace("-0.002", "-2")).values()
    assert not solid.problems
    assert area(solid.triangles) == pytest.approx(2e-4 + 1e-4)
    corners = np.unique(solid.triangles.reshape(-1, 3).round(6) + 0.0, axis=0)
    expected = [[-0.02, 0, -0.1], [-0.02, 0.01, -0.1], [0, 0, -0.1], [0, 0.01, -0.1]]
    assert corners == pytest.approx(np.array(expected))
    file.write_text(COLLADA[:900])
    (solid,) = solids_of(tmp_path, link).values()
    assert solid.problems[0].startswith("package://arm/meshes/c.dae: cannot be read as a .dae file")


def test_what_cannot_be_drawn_is_said_without_a_folder(tmp_path):
    (solid,) = solids_of(tmp_path, LINKS[LINKS.index('<link name="c"') :]).values()
    (problem,) = solid.problems
    assert problem.startswith("package://arm/meshes/c.stl: there is no such file")
    assert str(tmp_path) not in problem
    assert solid.triangles.shape == (0, 3, 3)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0.2 0.4 0.6", "0.2 0.4", "three numbers in <box> size"),
        ('radius="0.1"/>', 'radius="big"/>', "a number in <sphere> radius"),
        (' length="0.5"', "", "a number in <cylinder> length"),
        ("0.001 0.001 -0.002", "0.001", "three numbers in <mesh> scale"),
    ],
)
def test_numbers_that_cannot_be_meant(tmp_path, old, new, said):
    assert old in LINKS
    with pytest.raises(SkinError, match=f'link "[abc]": expected {said}'):
        solids_of(tmp_path, LINKS.replace(old, new))


def test_a_fine_mesh_is_drawn_coarsely():
    fine = np.concatenate([capsule(radius) for radius in np.linspace(0.96, 1.0, 5)])
    coarse = thinned(fine, 1000)
    assert 250 < len(coarse) <= 1000 < len(fine)
    assert np.abs(coarse).max() == pytest.approx(1.0, abs=0.1)
    assert np.array_equal(thinned(fine, len(fine)), fine)


CONCAVE = (
    COLLADA.replace('count="12">0 0 0 1 0 0 1 2 0 0 2 0<', 'count="18">%s<')
    .replace('count="4" stride', 'count="6" stride')
    .replace("<vcount>4</vcount><p>0 1 2 3</p>", "<vcount>6</vcount><p>1 2 3 4 5 0</p>")
    .replace('<triangles count="1">', '<triangles count="0">')
    .replace("<p>0 1 2</p>", "<p></p>")
    % "0 0 0 2 0 0 2 1 0 1 1 0 1 2 0 0 2 0"
)
POLYLIST = CONCAVE[CONCAVE.index("<polylist") : CONCAVE.index("</polylist>")] + "</polylist>"
POLYGONS = POLYLIST.replace("polylist", "polygons").replace("<vcount>6</vcount>", "")


@pytest.mark.filterwarnings("ignore:the matrix subclass", "ignore:string or file")  # pycollada's
@pytest.mark.parametrize("element", [POLYLIST, POLYGONS], ids=["polylist", "polygons"])
def test_a_polygon_of_a_collada_file_that_is_not_convex_has_its_area(tmp_path, element):
    """An L of area 3 cm²; pycollada's own triangles have 4."""
    pytest.importorskip("collada")
    file = tmp_path / "l.dae"
    file.write_text(CONCAVE.replace(POLYLIST, element))
    read = MeshFile.read(file)
    assert area(read.places[read.cells]) == pytest.approx(3e-4)
    assert Draped.read(file).outline.area == pytest.approx(3e-4)


@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_a_polygon_with_a_hole_is_refused(tmp_path):
    pytest.importorskip("collada")
    hole = POLYGONS.replace("<p>1 2 3 4 5 0</p>", "<ph><p>0 1 2</p><h>3 4 5</h></ph>")
    (tmp_path / "l.dae").write_text(CONCAVE.replace(POLYLIST, hole))
    with pytest.raises(GeometryError, match=r"l\.dae: expected polygons without holes"):
        MeshFile.read(tmp_path / "l.dae")
