"""The mesh record: what it derives, and what it refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from shapes import box, disc, folded, refined, strip
from tomoskin.core import GeometryError
from tomoskin.model.mesh import Mesh

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
SIDES = (np.array([[0, 1]]), np.array([[2, 3]]))


def square(**changes: Any) -> Mesh:
    return Mesh(**{"points": SQUARE, "cells": HALVES, "electrodes": SIDES, **changes})


def test_a_square() -> None:
    mesh = square()
    assert mesh.dimension == 2
    assert mesh.volumes == pytest.approx([0.5, 0.5])
    assert mesh.centroids == pytest.approx(np.array([[2, 1], [1, 2]]) / 3)
    assert mesh.neighbours.tolist() in ([[0, 1]], [[1, 0]])
    assert sorted(map(tuple, mesh.boundary.tolist())) == [(0, 1), (0, 3), (1, 2), (2, 3)]


def test_a_box() -> None:
    axes = np.linspace(0, 0.3, 4), np.array([0, 0.01, 0.04]), np.array([0, 0.02, 0.03])
    mesh = box(*axes)
    assert mesh.dimension == 3
    assert len(mesh.cells) == 3 * 2 * 2 * 6
    assert mesh.volumes.sum() == pytest.approx(0.3 * 0.04 * 0.03)
    assert (mesh.volumes > 0).all()


def test_a_folded_strip_keeps_its_area() -> None:
    x = np.linspace(0, 0.2, 9)
    flat = strip(x, np.linspace(0, 0.05, 4))
    bent = folded(flat, x[1:-1], 0.5)
    assert (bent.dimension, bent.points.shape[1]) == (2, 3)
    assert bent.volumes == pytest.approx(flat.volumes, rel=1e-12)
    assert np.array_equal(bent.neighbours, flat.neighbours)


def test_refinement_used_by_the_tests_is_sound() -> None:
    coarse = disc()
    fine = refined(coarse, lambda points: points)
    assert len(fine.cells) == 4 * len(coarse.cells)
    assert fine.volumes.sum() == pytest.approx(coarse.volumes.sum(), rel=1e-12)
    assert [len(e) for e in fine.electrodes] == [2 * len(e) for e in coarse.electrodes]


def test_tables_are_copies_that_cannot_be_written() -> None:
    points = SQUARE.copy()
    mesh = square(points=points)
    points[0] = 9.0
    assert mesh.points[0].tolist() == [0, 0]
    for table in (mesh.points, mesh.cells, *mesh.electrodes):
        with pytest.raises(ValueError, match="read-only"):
            table[0] = 0


def test_lists_and_whole_floats_will_do() -> None:
    mesh = Mesh(SQUARE.tolist(), HALVES.astype(float), [[[0, 1]], [[2, 3]]])  # type: ignore[arg-type]
    assert mesh.cells.dtype == np.int64
    assert mesh.identity == square().identity


def test_identity_tells_meshes_apart() -> None:
    moved = SQUARE + np.array([[0, 0], [0, 0], [1e-12, 0], [0, 0]])
    others = [
        square(points=moved),
        square(cells=HALVES[::-1]),
        square(electrodes=SIDES[::-1]),
        square(electrodes=(np.array([[0, 1]]), np.array([[1, 2]]))),
        square(electrodes=(np.array([[0, 1], [2, 3]]),)),
    ]
    names = {mesh.identity for mesh in [square(), *others]}
    assert len(names) == 1 + len(others)
    assert square().identity == square().identity


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": [[0, 0], [1, 0], [np.nan, 1], [0, 1]]}, "point 2: expected finite"),
        ({"points": [[0, 0], [1, 0], [1, np.inf], [0, 1]]}, "point 2: expected finite"),
        ({"points": np.vstack([SQUARE, [5, 5]])}, "point 4: belongs to no cell"),
        ({"points": [0, 1, 2, 3]}, "points: expected a table with two axes"),
        ({"points": [[0, 0], [1]]}, "points: expected rows of equal length"),
        ({"points": SQUARE.astype(str)}, "points: expected real numbers"),
        ({"points": SQUARE + 1j}, "points: expected real numbers"),
        ({"points": SQUARE[:, :1]}, "expected points in 2D"),
        ({"points": np.hstack([SQUARE, SQUARE])}, "expected points in 2D"),
        (
            {"cells": [[0, 1, 2], [0, 2, 4]]},
            r"cell 1: expected points from 0 to 3, got \[0, 2",
        ),
        ({"cells": [[0, 1, 2], [0, 2, -1]]}, "cell 1: expected points from 0 to 3"),
        ({"cells": [[0, 1, 2], [0, 2, 2.5]]}, "cells: expected whole numbers"),
        ({"cells": [[0, 1, 2], [0, 2, np.nan]]}, "cells: expected whole numbers"),
        ({"cells": [[0, 1, 2], [2, 0, 1], [0, 2, 3]]}, "cells 0, 1.*overlap"),
        ({"cells": [[0, 1, 2], [0, 2, 3], [0, 2, 1]]}, "cells 0, 1, 2.*overlap"),
        ({"cells": [[0, 1, 2], [0, 3, 3]]}, "cell 1: is degenerate"),
        ({"cells": [[0, 1]]}, "expected triangles"),
        ({"cells": np.empty((0, 3))}, "expected triangles"),
        ({"cells": [[0, 1, 2, 3]]}, "expected points in 3D"),
        ({"electrodes": ()}, "expected at least one electrode"),
        ({"electrodes": (np.empty((0, 2)),)}, "E1: expected facets"),
        ({"electrodes": ([[0, 1]], [[0, 1, 2]])}, "E2: expected facets"),
        ({"electrodes": ([[0, 1]], [[2, 7]])}, "E2, facet 0: expected points from 0 to 3"),
        ({"electrodes": ([[0, 1]], [[0, 2]])}, r"E2: facet \[0, 2\] is not on the bound"),
        (
            {"electrodes": ([[0, 1]], [[1, 0]])},
            r"E2: shares facet \[0, 1\] with",
        ),
        ({"electrodes": ([[0, 1], [1, 0]],)}, "E1: shares facet"),
    ],
)
def test_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        square(**changes)


@pytest.mark.parametrize("height", [0.0, 1e-14, -1e-15])
def test_flat_cells_are_degenerate_at_any_scale(height: float) -> None:
    points = np.array([[0, 0], [1, 0], [0.5, height], [0.5, 1]])
    for scale in (1e-6, 1.0, 1e6):
        with pytest.raises(GeometryError, match="cell 0: is degenerate"):
            Mesh(scale * points, [[0, 1, 2], [0, 1, 3]], ([[0, 3]],))  # type: ignore[arg-type]


def test_a_degenerate_tetrahedron() -> None:
    points = np.vstack([np.zeros(3), np.eye(3), [1, 1, 0]])
    with pytest.raises(GeometryError, match="cell 1: is degenerate"):
        Mesh(points, [[0, 1, 2, 3], [0, 1, 2, 4]], ([[0, 1, 3]],))  # type: ignore[arg-type]


def test_pieces_are_refused_and_the_smaller_is_named() -> None:
    points = np.vstack([SQUARE, SQUARE[:3] + 5])
    with pytest.raises(GeometryError, match="cell 2: the mesh is in 2 pieces"):
        Mesh(points, np.vstack([HALVES, [[4, 5, 6]]]), SIDES)


def test_cells_that_meet_in_a_point_only_are_pieces() -> None:
    points = np.vstack([SQUARE, [2, 1], [2, 2]])
    with pytest.raises(GeometryError, match="2 pieces"):
        Mesh(points, np.vstack([HALVES, [[2, 4, 5]]]), SIDES)
