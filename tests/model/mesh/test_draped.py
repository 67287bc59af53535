"""Surfaces from scanners and CAD programs: laid flat, found again, and refused where damaged."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from shapes import disc, tube
from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh import Cap, Cylinder, Draped, Saddle, Surface

Table = tuple[FloatArray, IntArray]


def on(surface: Surface, cells: int = 800) -> Table:
    mesh = disc(cells=cells)
    return surface.point(mesh.points), mesh.cells


def stretch(draped: Draped) -> FloatArray:
    """(n_cells, 2) principal stretches, least first."""
    return np.sqrt(np.linalg.eigvalsh(draped.metric(draped.flat[draped.cells].mean(axis=1))))


@pytest.mark.parametrize("radius", [0.04, 0.07, 0.3])
def test_a_cylinder_unrolls_without_stretch(radius: float) -> None:
    """The chords of its triangles are shorter by (edge/radius)²/24 and no more."""
    points, cells = on(Cylinder(radius))
    edge = np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1).max()
    assert np.abs(stretch(Draped.of(points, cells)) - 1).max() < 0.5 * (edge / radius) ** 2


@pytest.mark.parametrize("surface", [Cylinder(0.07), Cap(0.1), Saddle(0.2, 0.3)], ids=str)
def test_it_lies_as_it_did_seen_from_its_front(surface: Surface) -> None:
    mesh = disc(cells=800)
    draped = Draped.of(surface.point(mesh.points), mesh.cells)
    off = draped.flat - (mesh.points - mesh.points.mean(axis=0))
    assert np.abs(off).max() < 0.012
    assert (draped.normal(draped.flat[draped.cells].mean(axis=1))[:, 2] > 0).all()


def test_a_cap_is_stretched_as_little_as_it_can_be() -> None:
    """Less than by the azimuthal map, whose worst stretch is known."""
    worst = 0.1 * np.sin(1) / 0.1
    found = stretch(Draped.of(*on(Cap(0.1))))
    assert worst < found.min()
    assert found.max() < 1 / worst


def test_points_are_found_again() -> None:
    draped = Draped.of(*on(Cap(0.1)))
    uv = np.random.default_rng(0).uniform(-0.05, 0.05, (100, 2))
    assert draped.place(draped.point(uv)) == pytest.approx(uv, abs=1e-12)


def test_a_place_beside_the_rim_or_above_comes_to_the_nearest_point() -> None:
    mesh = disc(cells=800)
    draped = Draped.of(np.pad(mesh.points, ((0, 0), (0, 1))), mesh.cells)
    shift = draped.flat[0] - mesh.points[0]
    found = draped.place(np.array([[0.01, 0.02, 0.001], [0.1005, 0.0, 0.0]]))
    assert found - shift == pytest.approx(np.array([[0.01, 0.02], [0.1, 0.0]]), abs=5e-4)


def test_the_outline_is_the_rim() -> None:
    mesh = disc(cells=800)
    draped = Draped.of(np.pad(mesh.points, ((0, 0), (0, 1))), mesh.cells)
    assert draped.outline.area == pytest.approx(mesh.volumes.sum())


def test_cells_that_turn_both_ways_are_turned_alike() -> None:
    points, cells = on(Cap(0.1))
    mixed = cells.copy()
    some = np.random.default_rng(0).random(len(cells)) < 0.5
    some[0] = False
    mixed[some] = mixed[some][:, ::-1]
    assert Draped.of(points, mixed).flat == pytest.approx(Draped.of(points, cells).flat)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_files(tmp_path: Path, ending: str) -> None:
    points, cells = on(Cap(0.1), 200)
    file = tmp_path / f"cap.{ending}"
    meshio.write(file, meshio.Mesh(1e3 * points, [("triangle", cells)]))
    draped = Draped.read(file, scale=1e-3)
    assert len(draped.cells) == len(cells)
    assert draped.outline.area == pytest.approx(Draped.of(points, cells).outline.area, rel=1e-4)
    with pytest.raises(GeometryError, match=f"cap.{ending}.*millimetres"):
        Draped.read(file)


# What cannot be laid flat.


def moebius() -> Table:
    n, width = 20, 0.3
    turn = 2 * np.pi * np.arange(n) / n
    rows = []
    for side in (-width, width):
        r = 1 + side * np.cos(turn / 2)
        rows.append(np.column_stack([r * np.cos(turn), r * np.sin(turn), side * np.sin(turn / 2)]))
    quads = [(i, i + 1, i + n, i + n + 1) for i in range(n - 1)] + [(n - 1, n, 2 * n - 1, 0)]
    cells = [t for a, b, c, d in quads for t in ((a, b, c), (c, b, d))]
    return np.concatenate(rows), np.array(cells)


def folded_through() -> Table:
    mesh = disc(cells=400)
    x, y = mesh.points.T
    beyond = x > 0.05
    place = np.column_stack([np.where(beyond, 0.1 - x, x), y, np.where(beyond, 0.07 - x, 0) / 20])
    return place, mesh.cells


def tetrahedron() -> Table:
    return np.vstack([np.zeros(3), np.eye(3)]), np.array(
        [[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]
    )


def ring() -> Table:
    mesh = tube(24, 3, 0.05, 0.1)
    return mesh.points, mesh.cells


def holed_torus() -> Table:
    """A torus with one triangle cut out: one rim, and a handle."""
    n = 8
    a, b = (2 * np.pi * k.reshape(-1) / n for k in np.mgrid[:n, :n])
    r = 1 + 0.4 * np.cos(b)
    points = np.column_stack([r * np.cos(a), r * np.sin(a), 0.4 * np.sin(b)])
    i, j = (k.reshape(-1) for k in np.mgrid[:n, :n])
    at = [(((i + di) % n) * n + (j + dj) % n) for di, dj in ((0, 0), (1, 0), (0, 1), (1, 1))]
    cells = np.concatenate(
        [np.column_stack([at[0], at[1], at[3]]), np.column_stack([at[0], at[3], at[2]])]
    )
    return points, cells[1:]


def two_pieces() -> Table:
    points, cells = on(Cap(0.1), 200)
    return np.vstack([points, points + 1]), np.vstack([cells, cells + len(points)])


def three_wings() -> Table:
    points = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]], dtype=float)
    return points, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (moebius, "one side only"),
        (folded_through, "cells .* intersects itself near"),
        (tetrahedron, "closed"),
        (ring, "more than one rim"),
        (holed_torus, "handle"),
        (two_pieces, "2 pieces"),
        (three_wings, "cells 0, 1, 2.*one or two cells"),
    ],
)
def test_what_is_no_sheet_is_refused(broken: object, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        Draped.of(*broken())  # type: ignore[operator]


def test_a_place_off_the_surface_is_named() -> None:
    draped = Draped.of(*on(Cap(0.1)))
    with pytest.raises(GeometryError, match=r"position 1: is 50.* mm away from the surface"):
        draped.place(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05]]))
    with pytest.raises(GeometryError, match="positions"):
        draped.place(np.zeros((2, 2)))
