"""Facets, neighbours and sizes against brute force and known shapes."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial import Delaunay
from scipy.stats import ortho_group, special_ortho_group

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.mesh import simplex_measure
from tomoskin.model.mesh.triangles import boundary_facets, facets, paired_facets

dimensions = st.sampled_from([2, 3])
seeds = st.integers(0, 10_000)


def cloud(dimension: int, seed: int, n: int = 25) -> tuple[FloatArray, IntArray]:
    points = np.random.default_rng(seed).random((n, dimension))
    cells = Delaunay(points).simplices.astype(np.int64)
    used, compact = np.unique(cells, return_inverse=True)
    return points[used], compact.reshape(cells.shape)


def owners(cells: IntArray) -> dict[tuple[int, ...], list[int]]:
    """Cells of each facet, the slow way."""
    table = defaultdict(list)
    for number, cell in enumerate(cells.tolist()):
        for facet in combinations(sorted(cell), len(cell) - 1):
            table[facet].append(number)
    return table


def test_known_sizes() -> None:
    corner = np.vstack([np.zeros(3), np.diag([2.0, 3.0, 4.0])])
    assert simplex_measure(corner, np.array([[0, 3]])) == pytest.approx([4.0])
    assert simplex_measure(corner, np.array([[0, 1, 2], [2, 0, 1]])) == pytest.approx([3.0, 3.0])
    assert simplex_measure(corner, np.array([[0, 1, 2, 3], [1, 0, 2, 3]])) == pytest.approx([4, 4])


def test_area_of_a_triangle_in_space() -> None:
    """An equilateral triangle between the axes: √3/2."""
    assert simplex_measure(np.eye(3), np.array([[0, 1, 2]])) == pytest.approx([np.sqrt(0.75)])


def test_a_flat_simplex_has_no_size() -> None:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])
    assert simplex_measure(points, np.array([[0, 1, 2]])) == pytest.approx([0.0], abs=1e-15)


@given(dimensions, seeds, st.floats(1e-4, 1e4))
def test_size_under_motion_mirror_and_scale(dimension: int, seed: int, scale: float) -> None:
    points, cells = cloud(dimension, seed)
    turn = ortho_group.rvs(dimension, random_state=seed)
    moved = scale * points @ turn + 3.0 * scale
    shuffled = np.random.default_rng(seed).permuted(cells, axis=1)
    got = simplex_measure(moved, shuffled)
    expected = scale**dimension * simplex_measure(points, cells)
    assert got == pytest.approx(expected, rel=1e-6, abs=1e-9 * expected.max())


@given(seeds)
def test_area_of_a_sheet_turned_into_space(seed: int) -> None:
    points, cells = cloud(2, seed)
    turn = special_ortho_group.rvs(3, random_state=seed)
    expected = simplex_measure(points, cells)
    got = simplex_measure(points @ turn[:2], cells)
    assert got == pytest.approx(expected, rel=1e-6, abs=1e-9)


@given(dimensions, seeds)
def test_every_facet_with_its_owner(dimension: int, seed: int) -> None:
    _, cells = cloud(dimension, seed)
    facet, owner = facets(cells)
    got = defaultdict(list)
    for corners, cell in zip(facet.tolist(), owner.tolist(), strict=True):
        got[tuple(corners)].append(cell)
    expected = owners(cells)
    assert {k: sorted(v) for k, v in got.items()} == expected


@given(dimensions, seeds)
def test_neighbours_and_boundary(dimension: int, seed: int) -> None:
    _, cells = cloud(dimension, seed)
    table = owners(cells)
    pairs = {tuple(sorted(p)) for p in paired_facets(cells)[0].tolist()}
    assert pairs == {tuple(v) for v in table.values() if len(v) == 2}
    assert len(paired_facets(cells)[0]) == len(pairs)
    boundary = [tuple(f) for f in boundary_facets(cells).tolist()]
    assert sorted(boundary) == sorted(k for k, v in table.items() if len(v) == 1)


def test_one_cell_has_no_neighbour() -> None:
    assert paired_facets(np.array([[0, 1, 2]]))[0].shape == (0, 2)
    assert len(boundary_facets(np.array([[0, 1, 2, 3]]))) == 4
