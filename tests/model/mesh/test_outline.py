"""Outlines: arclength, inside, nearest, directions, and the shapes that are refused."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import quad

from tomoskin.core import GeometryError
from tomoskin.model.mesh import Disc, Ellipse, Outline, Polygon, Rectangle

L_SHAPE = [(0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0, 0.1)]
OUTLINES = [
    Disc(0.1),
    Ellipse(0.1, 0.04),
    Ellipse(0.01, 0.2),
    Rectangle(0.2, 0.1),
    Polygon(np.array(L_SHAPE)),
]
axis = st.floats(1e-3, 1.0)


@pytest.mark.parametrize("outline", OUTLINES)
def test_speed_along_the_curve_is_one(outline: Outline) -> None:
    s = (np.arange(500) + 0.37) / 500 * outline.length
    step = 1e-7 * outline.length
    ahead, behind = outline.point(s + step), outline.point(s - step)
    speed = np.linalg.norm(ahead - behind, axis=1) / (2 * step)
    assert speed == pytest.approx(np.ones(500), abs=1e-6)


@pytest.mark.parametrize("outline", OUTLINES)
def test_nearest_finds_the_arclength_again(outline: Outline) -> None:
    s = (np.arange(200) + 0.37) / 200 * outline.length
    assert outline.nearest(outline.point(s)) == pytest.approx(s, abs=1e-9)


@pytest.mark.parametrize("outline", OUTLINES)
def test_curve_is_closed_and_counter_clockwise(outline: Outline) -> None:
    rim = outline.polyline(outline.length / 5000)
    after = np.roll(rim, -1, axis=0)
    area = (rim[:, 0] * after[:, 1] - rim[:, 1] * after[:, 0]).sum() / 2
    assert area == pytest.approx(outline.area, rel=1e-5)
    assert np.linalg.norm(after - rim, axis=1).max() <= outline.length / 5000 * (1 + 1e-9)
    assert outline.point(-0.01) == pytest.approx(outline.point(outline.length - 0.01))


@pytest.mark.parametrize("outline", OUTLINES)
def test_points_just_inside_and_outside(outline: Outline) -> None:
    s = (np.arange(100) + 0.37) / 100 * outline.length
    along = outline.point(s + 1e-6) - outline.point(s - 1e-6)
    inward = np.column_stack([-along[:, 1], along[:, 0]]) / 2e-6 * 1e-5
    assert outline.contains(outline.point(s) + inward).all()
    assert not outline.contains(outline.point(s) - inward).any()


@pytest.mark.parametrize("outline", OUTLINES[:4])
@pytest.mark.parametrize("degrees", [-400, -90, 0, 17, 90, 135, 180, 333])
def test_toward_a_direction(outline: Outline, degrees: float) -> None:
    angle = math.radians(degrees)
    x, y = outline.point(outline.toward(angle))[0] - outline.centre
    assert math.cos(math.atan2(y, x) - angle) == pytest.approx(1, abs=1e-12)


def test_toward_leaves_a_concave_sheet_for_good() -> None:
    outline = Polygon(np.array(L_SHAPE))
    s = outline.toward(math.radians(135))
    x, y = outline.point(s)[0]
    assert x == pytest.approx(0.0)
    assert y > outline.centre[1]


def test_direction_into_an_exact_corner() -> None:
    square = Rectangle(0.1, 0.1)
    s = square.toward(math.radians(45))
    assert square.point(s)[0] == pytest.approx([0.05, 0.05], abs=1e-12)


@given(a=axis, b=axis, part=st.just(0.0) | st.floats(1e-6, 1))
def test_ellipse_arclength_against_quadrature(a: float, b: float, part: float) -> None:
    ellipse = Ellipse(a, b)
    x, y = ellipse.point(part * ellipse.length)[0]
    t = math.atan2(y / b, x / a) % (2 * math.pi)

    def speed(u: float) -> float:
        return math.hypot(a * math.sin(u), b * math.cos(u))

    breaks = [k * math.pi / 2 for k in range(5) if k * math.pi / 2 < t] + [t]
    found = sum(
        quad(speed, *pair, epsabs=1e-13, epsrel=1e-12, limit=400)[0] for pair in pairwise(breaks)
    )
    error = abs(found - part * ellipse.length)
    assert min(error, ellipse.length - error) < 1e-10 * max(ellipse.length, 1e-2)


def test_round_ellipse_is_a_disc() -> None:
    disc, ellipse = Disc(0.1), Ellipse(0.1, 0.1)
    s = np.linspace(-1, 1, 50)
    assert ellipse.length == pytest.approx(disc.length, rel=1e-14)
    assert ellipse.point(s) == pytest.approx(disc.point(s), abs=1e-13)
    assert ellipse.toward(2.0) == pytest.approx(disc.toward(2.0), rel=1e-13)


def test_rectangle_is_centred_and_begins_lower_left() -> None:
    sheet = Rectangle(0.2, 0.1)
    assert np.ptp(sheet.vertices, axis=0).tolist() == pytest.approx([0.2, 0.1])
    assert sheet.point(0.0)[0] == pytest.approx([-0.1, -0.05])
    assert sheet.point(0.2)[0] == pytest.approx([0.1, -0.05])
    assert sheet.centre == pytest.approx([0, 0], abs=1e-15)
    assert sheet.corners == pytest.approx([0, 0.2, 0.3, 0.5])


def test_clockwise_polygon_is_turned_round() -> None:
    given_way = Polygon(np.array(L_SHAPE))
    turned = Polygon(np.array([L_SHAPE[0], *L_SHAPE[:0:-1]]))
    assert turned.vertices == pytest.approx(given_way.vertices)
    assert turned.area == pytest.approx(0.1 * 0.03 + 0.07 * 0.03)


def test_polygon_centroid() -> None:
    triangle = Polygon(np.array([(10, 20), (10.3, 20), (10, 20.6)]))
    assert triangle.centre == pytest.approx([10.1, 20.2])


def test_vertices_cannot_be_changed() -> None:
    outline = Polygon(np.array(L_SHAPE))
    with pytest.raises(ValueError, match="read-only"):
        outline.vertices[0, 0] = 1.0


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=50),
    st.integers(3, 40),
)
@settings(max_examples=50)
def test_polygon_inside_agrees_with_a_convex_test(
    xy: list[tuple[float, float]], corners: int
) -> None:
    angle = np.linspace(0, 2 * math.pi, corners, endpoint=False) + 0.1
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.array(xy)
    step = np.roll(ring, -1, axis=0) - ring
    offset = points[:, None] - ring
    left = step[:, 0] * offset[..., 1] - step[:, 1] * offset[..., 0]
    clear = np.abs(left).min(axis=1) > 1e-9
    expected = (left > 0).all(axis=1)
    assert (Polygon(ring).contains(points)[clear] == expected[clear]).all()


@pytest.mark.parametrize("size", [0.0, -1.0, math.nan, math.inf])
def test_sizes_that_are_no_lengths(size: float) -> None:
    for make in (
        lambda: Disc(size),
        lambda: Ellipse(0.1, size),
        lambda: Ellipse(size, 0.1),
        lambda: Rectangle(size, 0.1),
        lambda: Rectangle(0.1, size),
    ):
        with pytest.raises(GeometryError, match="above 0 m"):
            make()
    with pytest.raises(GeometryError, match="step above 0"):
        Disc(0.1).polyline(0.0)


@pytest.mark.parametrize(
    ("vertices", "where", "message"),
    [
        ([(0, 0), (1, 0)], "", "at least 3 vertices"),
        ([(0, 0, 0)] * 3, "", "2 coordinates"),
        ([(0, 0), (1, math.nan), (1, 1)], "vertex 1", "finite"),
        ([(0, 0), (1, 0), (1, 1), (1, 0)], "vertex 3", "repeats vertex 1"),
        ([(0, 0), (1, 0), (1, 1), (0, 0)], "vertex 3", "repeats vertex 0"),
        ([(0, 0), (1, 1), (2, 2)], "", "no area"),
        ([(0, 0), (2, 2), (2, 0), (0, 1)], "vertex 0", "meets the side from vertex 2 to 3"),
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], "vertex 0", "meets the side"),
        ([(0, 0), (4, 0), (2, 0), (2, 3)], "vertex 0", "meets"),
        ([(0, 0), (4, 0), (4, 3), (4, 1), (0, 1)], "vertex 1", "meets the side"),
    ],
)
def test_vertices_that_bound_no_sheet(
    vertices: list[tuple[float, ...]], where: str, message: str
) -> None:
    with pytest.raises(GeometryError, match=message) as caught:
        Polygon(np.array(vertices, dtype=float))
    assert caught.value.where == where


def test_a_side_that_turns_back_on_itself() -> None:
    with pytest.raises(GeometryError, match="turns back") as caught:
        Polygon(np.array([(0, 0), (4, 0), (1, 0), (-1, 2.0)])[[1, 2, 3, 0]])
    assert caught.value.where.startswith("vertex")


def test_collinear_vertices_are_welcome() -> None:
    assert Polygon(np.array([(0, 0), (1, 0), (2, 0), (2, 1.0)])).area == pytest.approx(1.0)
