"""The mesher: exact electrodes, recovered rim, wanted size, quality, determinism."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tomoskin.core import GeometryError
from tomoskin.model.mesh import (
    Disc,
    ElectrodeArc,
    Ellipse,
    Mesh,
    Outline,
    Polygon,
    Rectangle,
    quality,
    triangulate,
)

L_SHAPE = Polygon(np.array([(0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0, 0.1)]))


def even(outline: Outline, n: int, width: float, first: float = 0.0) -> list[ElectrodeArc]:
    """Return ``n`` evenly spaced electrodes."""
    return [ElectrodeArc.around(first + k * outline.length / n, width) for k in range(n)]


CASES = {
    "disc": (Disc(0.1), even(Disc(0.1), 8, 0.01), 660),
    "many electrodes": (Disc(0.1), even(Disc(0.1), 32, 0.005), 2000),
    "narrow electrodes": (Disc(0.1), even(Disc(0.1), 8, 0.001), 1500),
    "wide electrodes": (Disc(0.1), even(Disc(0.1), 8, 0.075), 800),
    "ellipse": (Ellipse(0.1, 0.04), even(Ellipse(0.1, 0.04), 16, 0.006), 1500),
    "flat ellipse": (Ellipse(0.005, 0.1), even(Ellipse(0.005, 0.1), 8, 0.004, 0.003), 1000),
    "square": (Rectangle(0.1, 0.1), even(Rectangle(0.1, 0.1), 16, 0.006, 0.0125), 1500),
    "over corners": (Rectangle(0.1, 0.1), even(Rectangle(0.1, 0.1), 4, 0.02), 800),
    "strip": (Rectangle(0.2, 0.01), even(Rectangle(0.2, 0.01), 8, 0.005, 0.01), 600),
    "not convex": (L_SHAPE, even(L_SHAPE, 8, 0.008, 0.012), 800),
    "far away": (
        Polygon(np.array([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]) + 100.0),
        even(Rectangle(0.1, 0.1), 8, 0.005, 0.02),
        800,
    ),
    "few cells": (Disc(0.1), even(Disc(0.1), 8, 0.01), 200),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> tuple[Outline, list[ElectrodeArc], int, Mesh]:
    outline, arcs, cells = CASES[request.param]
    return outline, arcs, cells, triangulate(outline, arcs, cells)


Case = tuple[Outline, list[ElectrodeArc], int, Mesh]


def test_wanted_number_of_cells_is_met(case: Case) -> None:
    _, _, cells, mesh = case
    assert len(mesh.cells) == pytest.approx(cells, rel=0.1)


def test_electrode_ends_are_nodes_at_the_exact_places(case: Case) -> None:
    outline, arcs, _, mesh = case
    assert len(mesh.electrodes) == len(arcs)
    for arc, facets in zip(arcs, mesh.electrodes, strict=True):
        ends = mesh.points[[facets[0, 0], facets[-1, 1]]]
        assert ends == pytest.approx(outline.point([arc.start, arc.end]), abs=1e-12)
        assert (facets[1:, 0] == facets[:-1, 1]).all()  # one chain, counter-clockwise
        assert len(facets) >= 2


def test_electrode_nodes_lie_on_the_arc(case: Case) -> None:
    outline, arcs, _, mesh = case
    for arc, facets in zip(arcs, mesh.electrodes, strict=True):
        inner = outline.nearest(mesh.points[facets[1:, 0]])
        reached = (inner - arc.start) % outline.length
        assert (np.diff(reached) > 0).all()
        assert ((reached > 0) & (reached < arc.width(outline))).all()


def test_every_rim_node_lies_on_the_outline(case: Case) -> None:
    outline, _, _, mesh = case
    nodes = mesh.points[np.unique(mesh.boundary)]
    gap = np.linalg.norm(outline.point(outline.nearest(nodes)) - nodes, axis=1)
    assert gap.max() < 1e-12 * max(1.0, np.abs(nodes).max() * 1e3)


def test_corners_are_nodes(case: Case) -> None:
    outline, _, _, mesh = case
    for corner in outline.point(outline.corners) if len(outline.corners) else []:
        assert np.linalg.norm(mesh.points - corner, axis=1).min() < 1e-12


def test_rim_is_one_closed_chain_of_the_first_nodes(case: Case) -> None:
    _, _, _, mesh = case
    count = len(mesh.boundary)
    following = np.column_stack([np.arange(count), (np.arange(count) + 1) % count])
    assert {tuple(f) for f in mesh.boundary.tolist()} == {
        tuple(sorted(f)) for f in following.tolist()
    }


def test_cells_fill_the_rim_polygon_without_overlap(case: Case) -> None:
    _, _, _, mesh = case
    count = len(mesh.boundary)
    ring = mesh.points[:count] - mesh.points[:count].mean(axis=0)
    after = np.roll(ring, -1, axis=0)
    area = (ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum() / 2
    assert mesh.volumes.sum() == pytest.approx(area, rel=1e-9)
    assert len(mesh.cells) == 2 * len(mesh.points) - count - 2  # Euler


def test_cells_turn_counter_clockwise(case: Case) -> None:
    _, _, _, mesh = case
    a, b, c = (mesh.points[mesh.cells[:, i]] for i in range(3))
    u, v = b - a, c - a
    assert (u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0]).all()


def test_quality_is_good_where_cells_are_many() -> None:
    for name in ("disc", "ellipse", "square", "not convex"):
        outline, arcs, cells = CASES[name]
        found = quality(triangulate(outline, arcs, cells))
        assert found.minimum > 0.5
        assert found.mean > 0.95


def test_cells_are_smaller_at_electrodes() -> None:
    outline, arcs, _ = CASES["disc"]
    mesh = triangulate(outline, arcs, 3000)
    radius = np.linalg.norm(mesh.centroids, axis=1)
    at = np.isin(mesh.cells, np.unique(np.concatenate(mesh.electrodes))).any(axis=1)
    assert mesh.volumes[at].mean() < 0.4 * mesh.volumes[radius < 0.05].mean()


def test_straight_electrodes_have_the_exact_length() -> None:
    outline, arcs, cells = CASES["square"]
    mesh = triangulate(outline, arcs, cells)
    for facets in mesh.electrodes:
        step = mesh.points[facets[:, 1]] - mesh.points[facets[:, 0]]
        assert np.linalg.norm(step, axis=1).sum() == pytest.approx(0.006, rel=1e-12)


def test_area_and_electrode_length_converge_quadratically() -> None:
    disc = Disc(0.1)
    arcs = even(disc, 4, 0.08)
    misses = []
    for cells in (1000, 4000):
        mesh = triangulate(disc, arcs, cells)
        lengths = [
            np.linalg.norm(mesh.points[f[:, 1]] - mesh.points[f[:, 0]], axis=1).sum()
            for f in mesh.electrodes
        ]
        misses.append((disc.area - mesh.volumes.sum(), 0.32 - sum(lengths)))
    (area, length), (finer_area, finer_length) = misses
    assert 0 < finer_area < area / 3
    assert 0 < finer_length < length / 3


def test_an_electrode_may_lie_across_the_start_of_the_outline() -> None:
    disc = Disc(0.1)
    one = triangulate(disc, [ElectrodeArc(-0.01, 0.01), ElectrodeArc(0.2, 0.22)], 400)
    other = triangulate(
        disc, [ElectrodeArc(disc.length - 0.01, 0.01), ElectrodeArc(0.2, 0.22)], 400
    )
    assert one.points == pytest.approx(other.points, abs=1e-12)
    assert len(one.electrodes[0]) == len(other.electrodes[0])


def test_an_electrode_may_end_at_a_corner() -> None:
    square = Rectangle(0.1, 0.1)
    arcs = [ElectrodeArc(0.0, 0.01), ElectrodeArc(0.09, 0.1), ElectrodeArc(0.2, 0.21)]
    mesh = triangulate(square, arcs, 800)
    assert mesh.volumes.sum() == pytest.approx(0.01, rel=1e-12)
    assert quality(mesh).minimum > 0.3


def test_a_narrow_slot_stays_open() -> None:
    slot = Polygon(
        np.array(
            [(0, 0), (0.1, 0), (0.1, 0.1), (0.0505, 0.1), (0.05, 0.02), (0.0495, 0.1), (0, 0.1)]
        )
    )
    mesh = triangulate(slot, even(slot, 8, 0.005, 0.01), 5000)
    assert mesh.volumes.sum() == pytest.approx(slot.area, rel=1e-12)


@pytest.mark.slow
def test_fifty_thousand_cells() -> None:
    mesh = triangulate(Disc(0.1), even(Disc(0.1), 16, 0.008), 50_000)
    found = quality(mesh)
    assert found.n_cells == pytest.approx(50_000, rel=0.1)
    assert found.mean > 0.98


def test_same_arguments_give_the_same_mesh() -> None:
    outline, arcs, cells = CASES["disc"]
    one, other = triangulate(outline, arcs, cells), triangulate(outline, arcs, cells)
    assert one.identity == other.identity


def test_another_seed_places_the_inner_points_elsewhere() -> None:
    outline, arcs, cells = CASES["disc"]
    one, other = (triangulate(outline, arcs, cells, seed=seed) for seed in (0, 1))
    assert one.identity != other.identity
    inner = one.points[len(one.boundary) :]
    moved = other.points[len(other.boundary) :]
    gap = np.linalg.norm(inner[:, None] - moved[None], axis=2).min(axis=1)
    assert np.median(gap) > 0.1 * math.sqrt(one.volumes.mean())


@pytest.mark.parametrize("cells", [0, -5, 20])
def test_too_few_cells(cells: int) -> None:
    with pytest.raises(GeometryError, match="cell"):
        triangulate(Disc(0.1), even(Disc(0.1), 8, 0.01), cells)


def test_hint_names_a_number_that_would_do() -> None:
    with pytest.raises(GeometryError) as caught:
        triangulate(Disc(0.1), even(Disc(0.1), 16, 0.008), 60)
    enough = int(caught.value.hint.split()[2])
    assert triangulate(Disc(0.1), even(Disc(0.1), 16, 0.008), enough)


def test_overlapping_electrodes_are_refused() -> None:
    with pytest.raises(GeometryError, match="overlaps E1") as caught:
        triangulate(Disc(0.1), [ElectrodeArc(0, 0.02), ElectrodeArc(0.01, 0.03)], 400)
    assert caught.value.where == "E2"


def test_a_sliver_is_refused_before_its_rim_has_nodes_without_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each turn of the splitting would double them, up to 2⁶⁰."""
    monkeypatch.setattr("tomoskin.model.mesh.boundary._MOST_NODES", 2000)
    sliver = Polygon(np.array([(0.0, 0.0), (0.3, 0.0), (0.3, 1e-6)]))
    with pytest.raises(GeometryError, match="too close to each other"):
        triangulate(sliver, [ElectrodeArc(0.05, 0.06), ElectrodeArc(0.1, 0.11)], 660)


def test_quality_of_known_triangles() -> None:
    points = np.array([(0, 0), (1, 0), (0.5, math.sqrt(3) / 2), (0.5, -0.5)])
    mesh = Mesh(points, np.array([(0, 1, 2), (0, 1, 3)]), (np.array([(0, 2)]),))
    right = 2 * math.sqrt(2) - 2  # an isosceles right angle
    found = quality(mesh)
    assert found.minimum == pytest.approx(right)
    assert found.mean == pytest.approx((1 + right) / 2)
    assert (found.n_cells, found.n_points) == (2, 4)


def test_quality_is_for_triangles() -> None:
    points = np.vstack([np.zeros(3), np.eye(3)])
    solid = Mesh(points, np.array([(0, 1, 2, 3)]), (np.array([(0, 1, 2)]),))
    with pytest.raises(GeometryError, match="triangles"):
        quality(solid)


@st.composite
def star_polygons(draw: st.DrawFn) -> Polygon:
    """Random polygons that are star-shaped about the origin, mostly not convex."""
    corners = draw(st.integers(3, 10))
    radii = draw(st.lists(st.floats(0.03, 0.1), min_size=corners, max_size=corners))
    turns = draw(st.lists(st.floats(-0.3, 0.3), min_size=corners, max_size=corners))
    angle = (np.arange(corners) + turns) * 2 * math.pi / corners
    return Polygon(np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


@given(outline=star_polygons(), seed=st.integers(0, 99), part=st.floats(0.01, 0.99))
@settings(max_examples=15, deadline=None)
def test_any_polygon(outline: Polygon, seed: int, part: float) -> None:
    arcs = even(outline, 4, 0.01, part * outline.length)
    mesh = triangulate(outline, arcs, 700, seed=seed)
    assert len(mesh.cells) == pytest.approx(700, rel=0.1)
    assert mesh.volumes.sum() == pytest.approx(outline.area, rel=1e-9)
    nodes = mesh.points[np.unique(mesh.boundary)]
    gap = np.linalg.norm(outline.point(outline.nearest(nodes)) - nodes, axis=1)
    assert gap.max() < 1e-12
    for arc, facets in zip(arcs, mesh.electrodes, strict=True):
        ends = mesh.points[[facets[0, 0], facets[-1, 1]]]
        assert ends == pytest.approx(outline.point([arc.start, arc.end]), abs=1e-12)
