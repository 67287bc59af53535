"""Structured boxes: exact volumes, areas and resistances; rectangles on every side."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shapes import box as brick_box
from tomoskin.core import GeometryError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import BoxPatch, Mesh, box, simplex_measure
from tomoskin.model.mesh.extrude import grid_lines
from tomoskin.model.pattern import Pattern

SIZE = (0.3, 0.04, 0.03)
SIDES = ["-x", "+x", "-y", "+y", "-z", "+z"]
ENDS = Pattern.from_tables([[1, 0]], [[1, 0]])


def sound(mesh: Mesh) -> None:
    """No inverted cell, and each facet inside belongs to two cells."""
    corner = mesh.points[mesh.cells]
    assert (np.linalg.det(corner[:, 1:] - corner[:, :1]) > 0).all()
    assert len(mesh.boundary) + 2 * len(mesh.neighbours) == mesh.cells.size


@given(st.tuples(*3 * [st.floats(0.01, 1)]), st.tuples(*3 * [st.integers(1, 4)]))
def test_volume_and_surface(size: Any, cells: Any) -> None:
    mesh = box(size, cells, [BoxPatch(side) for side in SIDES])  # type: ignore[arg-type]
    sound(mesh)
    a, b, c = size
    assert len(mesh.cells) == 6 * np.prod(cells)
    assert mesh.volumes.sum() == pytest.approx(a * b * c, rel=1e-12)
    areas = [simplex_measure(mesh.points, e).sum() for e in mesh.electrodes]
    assert areas == pytest.approx([b * c, b * c, a * c, a * c, a * b, a * b], rel=1e-12)
    assert sum(map(len, mesh.electrodes)) == len(mesh.boundary)
    for side, facets in zip(SIDES, mesh.electrodes, strict=True):
        place = mesh.points[facets][:, :, "xyz".index(side[1])]
        ends = {"x": (-a / 2, a / 2), "y": (-b / 2, b / 2), "z": (0.0, c)}[side[1]]
        assert (place == ends["-+".index(side[0])]).all()


def test_the_same_bricks_as_a_box_built_otherwise() -> None:
    mesh = box(SIZE, (4, 2, 3), [BoxPatch("-x")])
    other = brick_box(*(np.unique(mesh.points[:, i]) for i in range(3)))
    assert np.sort(mesh.volumes) == pytest.approx(np.sort(other.volumes), rel=1e-12)
    assert corners(mesh) == corners(other)


def corners(mesh: Mesh) -> set[tuple[tuple[float, ...], ...]]:
    """The corners of every cell, in any order."""
    return {tuple(sorted(map(tuple, c))) for c in np.round(mesh.points[mesh.cells], 9).tolist()}


@given(st.sampled_from([0, 1, 2]), st.tuples(*3 * [st.integers(1, 3)]))
def test_bar_between_full_sides(axis: int, cells: Any) -> None:
    """A linear potential is exact: R = L/(σ A) + z₁/A + z₂/A."""
    sides = [BoxPatch("-x"), BoxPatch("-y"), BoxPatch("-z")]
    ends = [sides[axis], BoxPatch(("+x", "+y", "+z")[axis])]  # type: ignore[arg-type]
    z = np.array([1e-3, 4e-3])
    mesh = box(SIZE, cells, ends)
    got = ForwardModel(mesh, ENDS, z).solve(2.0).voltages
    area = np.prod(SIZE) / SIZE[axis]
    assert got == pytest.approx([SIZE[axis] / (2.0 * area) + z.sum() / area], rel=1e-9)


RECTANGLES = [
    BoxPatch("-x", (-0.012, 0.004), (0.007, 0.02)),
    BoxPatch("+x", (-0.02, 0.0), (0.0, 0.03)),
    BoxPatch("-y", (-0.1, 0.01), (-0.08, 0.02)),
    BoxPatch("-y", (0.02, 0.011), (0.04, 0.021)),
    BoxPatch("+y", (-0.15, 0.0), (-0.1, 0.01)),
    BoxPatch("-z", (-0.1, -0.01), (0.1, 0.01)),
    BoxPatch("+z", (0.11, -0.02), (0.15, 0.02)),
]


def test_rectangles_are_exact() -> None:
    mesh = box(SIZE, (6, 3, 3), RECTANGLES)
    sound(mesh)
    for patch, facets in zip(RECTANGLES, mesh.electrodes, strict=True):
        axes = [i for i in range(3) if i != patch.axis]
        corners = mesh.points[facets][:, :, axes].reshape(-1, 2)
        assert patch.low is not None
        assert patch.high is not None
        assert corners.min(axis=0) == pytest.approx(patch.low, abs=1e-15)
        assert corners.max(axis=0) == pytest.approx(patch.high, abs=1e-15)
        area = np.prod(np.subtract(patch.high, patch.low))
        assert simplex_measure(mesh.points, facets).sum() == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize(
    ("patch", "message"),
    [
        (BoxPatch("-x", (-0.03, 0.0), (0.0, 0.01)), "interval of y within -20 to 20 mm"),
        (BoxPatch("+y", (0.0, 0.0), (0.1, 0.031)), "interval of z within 0 to 30 mm on side"),
        (BoxPatch("+z", (0.0, 0.0), (0.0, 0.01)), "interval of x"),
        (BoxPatch("+z", (0.0, 0.0), (np.nan, 0.01)), "interval of x"),
        (BoxPatch("left"), "side among -x"),  # type: ignore[arg-type]
        (BoxPatch("-x"), "shares facet"),
    ],
)
def test_electrodes_that_do_not_fit_are_named(patch: BoxPatch, message: str) -> None:
    with pytest.raises(GeometryError, match=message) as caught:
        box(SIZE, (4, 2, 2), [BoxPatch("-x"), patch])
    assert caught.value.where == "E2"


@pytest.mark.parametrize("size", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.inf)])
def test_impossible_sizes(size: Any) -> None:
    with pytest.raises(GeometryError, match="length along"):
        box(size, (1, 1, 1), [BoxPatch("-x")])


def test_impossible_number_of_cells() -> None:
    with pytest.raises(GeometryError, match="at least 1"):
        box(SIZE, (4, 0, 2), [BoxPatch("-x")])


def test_without_electrodes() -> None:
    with pytest.raises(GeometryError, match="at least one electrode"):
        box(SIZE, (1, 1, 1), [])


# Grid lines.


@given(st.floats(-1, 1), st.floats(0.01, 10), st.integers(1, 50))
def test_equal_steps_without_marks(low: float, length: float, count: int) -> None:
    lines = grid_lines(low, low + length, [low, low + length], count)
    assert lines == pytest.approx(np.linspace(low, low + length, count + 1), abs=1e-9)


@given(st.lists(st.floats(0, 1), max_size=8), st.integers(1, 60))
def test_marks_are_lines(marks: list[float], count: int) -> None:
    lines = grid_lines(0.0, 1.0, marks, count)
    assert (np.diff(lines) > 0).all()
    assert (lines[0], lines[-1]) == (0.0, 1.0)
    for mark in marks:
        assert np.abs(lines - mark).min() <= 1e-9


def test_steps_are_finer_beside_marks_and_about_as_many_as_asked() -> None:
    lines = grid_lines(0.0, 0.2, [0.09, 0.11], 20)
    steps = np.diff(lines)
    at = int(np.argmin(np.abs(lines - 0.11)))
    assert len(steps) == pytest.approx(20, abs=2)
    assert steps[at] < 0.7 * steps.max()
    assert (steps[1:] / steps[:-1]).max() < 1.8
    assert lines + lines[::-1] == pytest.approx(np.full(len(lines), 0.2))
