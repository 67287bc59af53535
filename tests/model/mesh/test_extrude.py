"""Raised meshes: sound cells, exact electrodes, and the physics of sheets and tanks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from shapes import cylinder, disc
from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import (
    Disc,
    ElectrodeArc,
    Ellipse,
    FacePatch,
    Mesh,
    Outline,
    Polygon,
    Rectangle,
    WallPatch,
    extrude,
    ring,
    simplex_measure,
    triangulate,
)
from tomoskin.model.mesh.extrude import Body, Patch
from tomoskin.model.pattern import Pattern

HEIGHT = 0.04
ELL = Polygon(np.array([(0, 0), (0.1, 0), (0.1, 0.05), (0.05, 0.05), (0.05, 0.1), (0, 0.1)]))
OUTLINES: dict[str, Outline] = {
    "disc": Disc(0.05),
    "ellipse": Ellipse(0.06, 0.03),
    "square": Rectangle(0.1, 0.1),
    "ell": ELL,
}


def sound(mesh: Mesh) -> None:
    """No inverted cell, and each facet inside belongs to two cells."""
    corner = mesh.points[mesh.cells]
    assert (np.linalg.det(corner[:, 1:] - corner[:, :1]) > 0).all()
    assert len(mesh.boundary) + 2 * len(mesh.neighbours) == mesh.cells.size


def areas(mesh: Mesh) -> FloatArray:
    return np.array([simplex_measure(mesh.points, e).sum() for e in mesh.electrodes])


def section(mesh: Mesh) -> tuple[float, float]:
    """Area and circumference of the bottom."""
    bottom = mesh.boundary[(mesh.points[mesh.boundary][:, :, 2] == 0).all(axis=1)]
    edges = np.sort(bottom[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    rim, times = np.unique(edges, axis=0, return_counts=True)
    around = simplex_measure(mesh.points, rim[times == 1]).sum()
    return float(simplex_measure(mesh.points, bottom).sum()), float(around)


@pytest.mark.parametrize("name", OUTLINES)
def test_volume_and_surface(name: str) -> None:
    mesh = extrude(
        OUTLINES[name],
        HEIGHT,
        [FacePatch("bottom"), WallPatch(0.0, HEIGHT), FacePatch("top")],
        cells=300,
        layers=4,
    )
    sound(mesh)
    area, around = section(mesh)
    assert mesh.volumes.sum() == pytest.approx(area * HEIGHT, rel=1e-12)
    assert areas(mesh) == pytest.approx([area, around * HEIGHT, area], rel=1e-12)
    assert sum(map(len, mesh.electrodes)) == len(mesh.boundary)
    assert area == pytest.approx(OUTLINES[name].area, rel=0.01)
    if name in ("square", "ell"):
        assert area == pytest.approx(OUTLINES[name].area, rel=1e-12)


@pytest.mark.parametrize("name", ["square", "ell"])
def test_patches_on_a_flat_wall_are_exact(name: str) -> None:
    outline = OUTLINES[name]
    patches = ring(outline, 6, 0.012, 0.011, 0.023)
    mesh = extrude(outline, HEIGHT, patches, cells=600, layers=6)
    sound(mesh)
    for patch, facets in zip(patches, mesh.electrodes, strict=True):
        assert patch.arc is not None
        points = mesh.points[np.unique(facets)]
        assert (points[:, 2].min(), points[:, 2].max()) == (0.011, 0.023)
        ends = outline.point([patch.arc.start, patch.arc.end])
        for end in ends:
            assert np.linalg.norm(points[:, :2] - end, axis=1).min() < 1e-12
    assert areas(mesh) == pytest.approx(np.full(6, 0.012 * 0.012), rel=1e-9)


def test_patches_on_a_curved_wall_end_exactly() -> None:
    mesh = cylinder(0.15, 0.2, count=16, span=(0.09, 0.11), cells=800, layers=8)
    sound(mesh)
    assert len(mesh.electrodes) == 16
    for k, facets in enumerate(mesh.electrodes):
        points = mesh.points[np.unique(facets)]
        turn = np.arctan2(points[:, 1], points[:, 0]) - (math.pi / 2 - 2 * math.pi * k / 16)
        turn = (turn + math.pi) % (2 * math.pi) - math.pi
        assert [turn.min(), turn.max()] == pytest.approx([-0.02 / 0.3, 0.02 / 0.3], abs=1e-12)
        assert (points[:, 2].min(), points[:, 2].max()) == (0.09, 0.11)
    chord = 2 * 0.15 * math.sin(0.02 / 0.3)
    assert (areas(mesh) <= 0.02 * 0.02).all()
    assert (areas(mesh) >= chord * 0.02 * (1 - 1e-12)).all()


def test_first_electrode_at_the_top_then_clockwise() -> None:
    mesh = cylinder(0.1, 0.04, count=4, span=(0.01, 0.03), cells=300, layers=4)
    middles = np.array([mesh.points[e].mean(axis=(0, 1))[:2] for e in mesh.electrodes])
    directions = middles / np.linalg.norm(middles, axis=1, keepdims=True)
    assert directions == pytest.approx(np.array([(0, 1), (1, 0), (0, -1), (-1, 0)]), abs=1e-9)


def test_the_flat_mesh_of_one_ring_is_that_of_its_arcs() -> None:
    outline = Disc(0.1)
    patches = ring(outline, 8, 0.02, 0.01, 0.03)
    mesh = extrude(outline, HEIGHT, patches, cells=400, layers=4)
    flat = triangulate(outline, [p.arc for p in patches if p.arc is not None], 400)
    bottom = mesh.points[mesh.points[:, 2] == 0]
    assert len(bottom) == len(flat.points)
    assert bottom[:, :2] == pytest.approx(flat.points, abs=1e-9)


def raised(flat: Mesh, planes: Sequence[float]) -> Mesh:
    """The flat mesh through these heights, its electrodes from the bottom to the top."""
    body = Body(flat.points, flat.cells, np.array(planes))
    return body.mesh([body.wall(edges, planes[0], planes[-1]) for edges in flat.electrodes])


def test_order_of_points_and_cells() -> None:
    flat = disc(4, 100)
    planes = [0.0, 0.01, 0.03]
    mesh = raised(flat, planes)
    n = len(flat.points)
    for k, z in enumerate(planes):
        assert np.array_equal(mesh.points[k * n : (k + 1) * n, :2], flat.points)
        assert (mesh.points[k * n : (k + 1) * n, 2] == z).all()
    prism = mesh.volumes.reshape(2, len(flat.cells), 3)
    assert prism.sum(axis=2) == pytest.approx(np.outer(np.diff(planes), flat.volumes), rel=1e-9)
    assert prism.max(axis=2) == pytest.approx(prism.min(axis=2), rel=1e-6)


def test_orientation_of_the_flat_mesh_does_not_matter() -> None:
    flat = disc(4, 100)
    turned = Mesh(flat.points, flat.cells[:, [1, 0, 2]], flat.electrodes)
    sound(raised(turned, [0.0, 0.01]))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=6, deadline=None)
def test_neighbours_fit_whatever_the_numbering(seed: int) -> None:
    flat = disc(4, 100)
    order = np.random.default_rng(seed).permutation(len(flat.points))
    place = np.argsort(order)
    mixed = Mesh(flat.points[order], place[flat.cells], tuple(place[e] for e in flat.electrodes))
    mesh = raised(mixed, [0.0, 0.01, 0.02])
    sound(mesh)
    assert areas(mesh) == pytest.approx(
        0.02 * np.array([simplex_measure(flat.points, e).sum() for e in flat.electrodes])
    )


def test_planes_that_cells_must_not_cross() -> None:
    outline = Rectangle(0.1, 0.1)
    mesh = extrude(
        outline, 0.02, ring(outline, 4, 0.02, 0.0, 0.02), cells=200, layers=3, planes=[0.0123]
    )
    z = mesh.points[mesh.cells][:, :, 2]
    assert ((z >= 0.0123).all(axis=1) | (z <= 0.0123).all(axis=1)).all()


# Patches at different heights, on the bottom and on the top.


def staggered(outline: Outline, count: int, width: float) -> list[Patch]:
    """Two rings, the upper one turned so that arcs overlap partly."""
    turned = [
        WallPatch(0.025, 0.035, ElectrodeArc(p.arc.start + width / 3, p.arc.end + width / 3))
        for p in ring(outline, count, width, 0.0, 0.01)
        if p.arc is not None
    ]
    return [*ring(outline, count, width, 0.005, 0.015), *turned]


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("part", [0.3, 0.7, 0.8])
def test_rings_whose_arcs_overlap(name: str, part: float) -> None:
    outline = OUTLINES[name]
    width = part * outline.length / 8
    patches = staggered(outline, 8, width)
    mesh = extrude(outline, HEIGHT, patches, cells=900, layers=8)
    sound(mesh)
    for patch, facets in zip(patches, mesh.electrodes, strict=True):
        assert isinstance(patch, WallPatch)
        assert patch.arc is not None
        points = mesh.points[np.unique(facets)]
        for end in outline.point([patch.arc.start, patch.arc.end]):
            assert np.linalg.norm(points[:, :2] - end, axis=1).min() < 1e-9
    exact = 1e-9 if name in ("square", "ell") else 5e-3
    assert areas(mesh) == pytest.approx(np.full(16, width * 0.01), rel=exact)


def test_patches_over_the_whole_rim_together() -> None:
    outline = Disc(0.05)
    half = outline.length / 2
    patches = [
        WallPatch(0.0, 0.01, ElectrodeArc(0.0, half)),
        WallPatch(0.0201, 0.03, ElectrodeArc(half, 0.0)),
        WallPatch(0.035, 0.04),
    ]
    mesh = extrude(outline, HEIGHT, patches, cells=400, layers=8)
    sound(mesh)
    around = areas(mesh) / [0.01, 0.0099, 0.005]
    assert around == pytest.approx([half, half, 2 * half], rel=5e-3)
    assert around[2] == pytest.approx(around[0] + around[1], rel=1e-9)


def test_a_disc_on_the_top_is_what_its_docstring_says() -> None:
    spot = Disc(0.02)
    patches = [FacePatch("top", spot, (0.01, -0.01)), FacePatch("bottom", spot)]
    mesh = extrude(Disc(0.05), 0.01, patches, cells=4000, layers=2)
    top, bottom = mesh.electrodes
    assert (mesh.points[top][:, :, 2] == 0.01).all()
    assert (mesh.points[bottom][:, :, 2] == 0.0).all()
    centroid = mesh.points[top].mean(axis=1)[:, :2]
    assert (np.linalg.norm(centroid - [0.01, -0.01], axis=1) < 0.02).all()
    assert areas(mesh) == pytest.approx(np.full(2, spot.area), rel=0.05)


# What is refused.

ARC = ElectrodeArc(0.0, 0.02)


@pytest.mark.parametrize(
    ("patch", "message"),
    [
        (WallPatch(-0.001, 0.01, ElectrodeArc(0.1, 0.12)), "0 ≤ bottom < top ≤ 40 mm"),
        (WallPatch(0.01, 0.041, ElectrodeArc(0.1, 0.12)), "bottom < top"),
        (WallPatch(0.01, 0.01, ElectrodeArc(0.1, 0.12)), "bottom < top"),
        (WallPatch(0.01, math.nan, ElectrodeArc(0.1, 0.12)), "bottom < top"),
        (WallPatch(0.01, 0.02, ElectrodeArc(0.1, 0.1)), "width above 0"),
        (WallPatch(0.01, 0.02, ElectrodeArc(0.1, 0.9)), "longer than the outline"),
        (WallPatch(0.01, 0.02, ElectrodeArc(math.nan, 0.1)), "finite arclengths"),
        (WallPatch(0.015, 0.03, ElectrodeArc(0.01, 0.03)), "overlaps or touches E1"),
        (WallPatch(0.02, 0.03, ElectrodeArc(0.01, 0.03)), "overlaps or touches E1"),
        (WallPatch(0.01, 0.02, ElectrodeArc(0.02, 0.04)), "overlaps or touches E1"),
        (WallPatch(0.0, 0.04), "overlaps or touches E1"),
        (WallPatch(0.01, 0.02, ElectrodeArc(-0.01, 0.001)), "overlaps or touches E1"),
        (FacePatch("top", Disc(1e-5), (0.0123, 0.002)), "no facet lies inside"),
        (FacePatch("top", Disc(0.01), (1.0, 0.0)), "no facet lies inside"),
    ],
)
def test_patches_that_do_not_fit_are_named(patch: Patch, message: str) -> None:
    with pytest.raises(GeometryError, match=message) as caught:
        extrude(Disc(0.1), HEIGHT, [WallPatch(0.01, 0.02, ARC), patch], cells=300, layers=4)
    assert caught.value.where == "E2"


def test_faces_that_overlap() -> None:
    with pytest.raises(GeometryError, match="E1") as caught:
        extrude(Disc(0.1), HEIGHT, 2 * [FacePatch("top")], cells=300, layers=4)
    assert caught.value.where == "E2"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"height": 0.0}, "height above 0"),
        ({"height": math.inf}, "height above 0"),
        ({"patches": []}, "at least one electrode"),
        ({"layers": 0}, "at least 1 layer"),
        ({"cells": 0}, "cell"),
        ({"planes": [0.05]}, "plane 0: expected a height from 0 to 40 mm"),
    ],
)
def test_bodies_that_cannot_be(changes: dict[str, Any], message: str) -> None:
    given = {"height": HEIGHT, "patches": [WallPatch(0.01, 0.02, ARC)], "cells": 300, "layers": 4}
    with pytest.raises(GeometryError, match=message):
        extrude(Disc(0.1), **{**given, **changes})


def test_ring_without_electrodes() -> None:
    with pytest.raises(GeometryError, match="at least 1 electrode"):
        ring(Disc(0.1), 0, 0.01, 0.0, 0.01)


# Physics.


def resistance(mesh: Mesh, impedance: float, conductivity: float) -> FloatArray:
    model = ForwardModel(mesh, Pattern.adjacent(len(mesh.electrodes)), impedance)
    return np.asarray(model.transfer_resistance(conductivity))


def test_column_between_bottom_and_top() -> None:
    """A linear potential is exact: R = h/(σ A) + 2 z/A."""
    mesh = extrude(Disc(0.05), HEIGHT, [FacePatch("bottom"), FacePatch("top")], cells=200, layers=5)
    pattern = Pattern.from_tables([[1, 0]], [[1, 0]])
    got = ForwardModel(mesh, pattern, 1e-3).solve(2.0).voltages
    area = section(mesh)[0]
    assert got == pytest.approx([(HEIGHT / 2.0 + 2e-3) / area], rel=1e-9)


def test_electrodes_of_full_height_tend_to_the_sheet() -> None:
    """The sheet of conductance σ·h with contact z/h has the same exact solution.

    Potentials of the flat mesh, held constant along z, are among those of the raised mesh (not
    its solution: a prism is cut unevenly). So for every current pattern the raised mesh shows
    a resistance that is never lower, and the difference fades with thinner layers.
    """
    flat, z, sigma = disc(8, 250, width=0.03), 1e-3, 2.0
    sheet = resistance(flat, z / HEIGHT, sigma * HEIGHT)
    misses = []
    for layers in (2, 4, 8):
        body = resistance(raised(flat, np.linspace(0, HEIGHT, layers + 1).tolist()), z, sigma)
        excess = np.linalg.eigvalsh((body - sheet + (body - sheet).T) / 2)
        assert excess.min() > -1e-9 * np.abs(sheet).max()
        misses.append(np.abs(body - sheet).max() / np.abs(sheet).max())
    assert misses[0] < 0.01
    assert misses[1] < 0.6 * misses[0]
    assert misses[2] < 0.5 * misses[1]


def test_tank_of_sixteen_electrodes() -> None:
    """Homogeneous: reciprocal, positive, and the same seen from every electrode and its mirror."""
    tank = cylinder(0.15, 0.2, count=16, span=(0.09, 0.11), cells=1200, layers=10)
    pattern = Pattern.adjacent(16)
    model = ForwardModel(tank, pattern, 1e-3)
    r = model.transfer_resistance(0.1)
    assert r == pytest.approx(r.T, abs=1e-9 * np.abs(r).max())
    steps = (pattern.measure[:, 0] - pattern.drive[:, 0]) % 16  # from the driven pair onwards
    rows = np.lexsort((steps, pattern.drive_index))
    voltages = model.voltages(r)[rows].reshape(16, 13)
    assert (voltages > 0).all()
    typical = voltages.mean(axis=0)
    assert voltages / typical == pytest.approx(np.ones((16, 13)), abs=0.03)
    assert typical == pytest.approx(typical[::-1], rel=0.01)
    assert (np.diff(typical[:6]) < 0).all()
