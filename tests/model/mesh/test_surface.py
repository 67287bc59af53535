"""Sheets laid on surfaces: where they lie, what becomes of lengths, what does not fit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import ArrayLike

from shapes import disc
from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh import Arm, Cap, Cylinder, Mesh, Plane, Saddle, Surface, laid_on

SURFACES = [
    Plane(),
    Cylinder(0.07),
    Cylinder(0.05, axis=0.3),
    Cap(0.08),
    Saddle(0.2, 0.3),
    Saddle(math.inf, 0.1),
    Arm(0.04, math.radians(45), 0.06),
    Arm(0.04, -0.4, 0.06),
]


@pytest.fixture(params=SURFACES, ids=str)
def surface(request: pytest.FixtureRequest) -> Surface:
    return request.param


def places(n: int = 200) -> FloatArray:
    return np.random.default_rng(1).uniform(-0.045, 0.045, (n, 2))


class Rough(Plane):
    """Stretched and squeezed from one millimetre to the next."""

    def metric(self, uv: ArrayLike) -> FloatArray:
        wave = 1 + 0.95 * np.sin(4e3 * np.asarray(uv)[:, 0])
        return np.asarray(wave[:, None, None] ** 2 * np.eye(2))


def test_a_surface_too_rough_for_the_triangles_is_refused() -> None:
    with pytest.raises(GeometryError, match=r"too rough .* near \(.* mm of the sheet"):
        laid_on(disc(), Rough())


def test_the_jacobian_is_the_derivative_of_the_point(surface: Surface) -> None:
    uv, h = places(), 1e-6
    slope = [(surface.point(uv + d) - surface.point(uv - d)) / (2 * h) for d in h * np.eye(2)]
    assert surface.jacobian(uv) == pytest.approx(np.stack(slope, axis=-1), abs=1e-6)


def test_normals_stand_upright_on_the_sheet_and_look_out(surface: Surface) -> None:
    uv = places()
    normal = surface.normal(uv)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    assert np.einsum("nk,nki->ni", normal, surface.jacobian(uv)) == pytest.approx(0, abs=1e-12)
    assert (surface.normal(np.zeros((1, 2)))[0] == pytest.approx([0, 0, 1])) or not isinstance(
        surface, Plane
    )


def test_the_middle_of_the_sheet_lies_in_the_origin(surface: Surface) -> None:
    assert surface.point(np.zeros((1, 2))) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("radius", [0.04, 0.07])
def test_a_cylinder_is_round_and_bends_one_way(radius: float) -> None:
    lies = Cylinder(radius).point(places())
    assert np.hypot(lies[:, 0], lies[:, 2] + radius) == pytest.approx(radius)
    curved = Cylinder(radius).curvature(places())
    assert curved == pytest.approx(np.tile([[-1 / radius, 0], [0, 0]], (200, 1, 1)), abs=1e-4)


def test_a_cap_is_a_sphere() -> None:
    lies = Cap(0.08).point(places())
    assert np.linalg.norm(lies - np.array([0, 0, -0.08]), axis=1) == pytest.approx(0.08)
    metric, curved = Cap(0.08).metric(places()), Cap(0.08).curvature(places())
    assert curved == pytest.approx(-metric / 0.08, abs=1e-4)


def test_a_cap_shrinks_what_lies_around() -> None:
    r = 0.05
    metric = Cap(0.08).metric(np.array([[r, 0.0]]))
    assert metric[0] == pytest.approx(np.diag([1, (0.08 * math.sin(r / 0.08) / r) ** 2]))


@pytest.mark.parametrize("angle", [0.3, -0.3])
def test_an_arm_is_stretched_outside_its_bend_only(angle: float) -> None:
    arm = Arm(0.04, angle, 0.06)
    metric = arm.metric(np.array([[0.0, 0.0], [0.04 * math.pi, 0.0], [0.0, 0.04]]))
    assert metric[:, 0, 0] == pytest.approx(1.0)
    ratio = 0.04 * angle / 0.06
    assert np.sqrt(metric[:, 1, 1]) == pytest.approx([1 + ratio, 1 - ratio, 1.0])


def test_both_ends_of_an_arm_are_straight_and_turned_by_the_joint() -> None:
    arm = Arm(0.03, math.radians(60), 0.08)
    v = np.array([-0.14, -0.05, 0.05, 0.14])
    lies = arm.point(np.column_stack([np.zeros(4), v]))
    one, other = lies[1] - lies[0], lies[3] - lies[2]
    assert np.linalg.norm([one, other], axis=1) == pytest.approx(0.09)
    cosine = one @ other / 0.09**2
    assert math.degrees(math.acos(cosine)) == pytest.approx(60)


# Meshes.


@pytest.mark.parametrize("axis", [0.0, 0.3, math.pi / 2])
def test_a_bent_sheet_is_the_same_mesh(axis: float) -> None:
    mesh = disc()
    assert laid_on(mesh, Cylinder(0.07, axis)).identity == mesh.identity


@pytest.mark.parametrize("surface", [Cap(0.12), Saddle(0.2, 0.3), Arm(0.06, 0.5, 0.09)], ids=str)
def test_a_stretched_sheet_has_the_area_that_it_has_in_space(surface: Surface) -> None:
    """The chords of the triangles in space give it too, to second order."""
    errors = []
    for cells in (400, 1600):
        mesh = disc(cells=cells)
        laid = laid_on(mesh, surface)
        space = Mesh(surface.point(mesh.points), mesh.cells, mesh.electrodes)
        assert laid.identity != mesh.identity
        errors.append(abs(laid.volumes.sum() / space.volumes.sum() - 1))
        rim = [laid.facet_sizes(e).sum() / space.facet_sizes(e).sum() for e in mesh.electrodes]
        assert rim == pytest.approx(np.ones(8), abs=0.02)
    assert errors[1] < 0.4 * errors[0] < 0.01


@given(st.floats(0.5, 2), st.floats(0.5, 2), st.floats(-0.4, 0.4))
def test_corners_have_the_lengths_of_the_metric(a: float, b: float, shear: float) -> None:
    flat = disc(cells=120)
    stretch = np.array([[a, shear], [0, b]])
    mesh = Mesh(
        flat.points,
        flat.cells,
        flat.electrodes,
        np.tile(stretch.T @ stretch, (len(flat.cells), 1, 1)),
    )
    moved = (flat.points @ stretch.T)[flat.cells]
    sides = np.linalg.norm(moved - np.roll(moved, 1, axis=1), axis=2)
    own = np.linalg.norm(mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2)
    np.testing.assert_allclose(own, sides, rtol=1e-6)
    np.testing.assert_allclose(mesh.volumes, flat.volumes * a * b, rtol=1e-6)
    along = np.array([1.0, 0.0]) @ np.linalg.cholesky(stretch.T @ stretch)
    assert along[1] == pytest.approx(0), "the frame's first axis is the direction of x"


# Refusals.


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        (lambda: Cylinder(-1), "radius above 0"),
        (lambda: Cap(0), "radius above 0"),
        (lambda: Saddle(1, math.nan), "radius_v above 0"),
        (lambda: Arm(0.04, 1.6, 0.06), "folds"),
        (lambda: laid_on(disc(), Cylinder(0.02)), "overlaps itself"),
        (lambda: laid_on(disc(), Arm(0.02, 0.1, 0.1)), "overlaps itself"),
        (lambda: laid_on(disc(), Cap(0.03)), "is covered at"),
        (lambda: laid_on(Mesh(*_in_space()), Cap(0.3)), "flat sheet"),
        (lambda: Plane().point(np.zeros((3, 3))), "points"),
    ],
)
def test_what_does_not_fit_is_refused(surface: object, words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        surface()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        (np.ones((3, 2, 2)), "shape"),
        (np.full((220, 2, 2), np.nan), "positive definite"),
        (-np.eye(2), "positive definite"),
        (np.array([[1, 0.5], [0, 1]]), "symmetric"),
        (np.ones((2, 2)), "positive definite"),
    ],
)
def test_a_metric_that_is_none_is_refused(metric: FloatArray, words: str) -> None:
    mesh = disc()
    table = np.tile(metric, (len(mesh.cells), 1, 1)) if metric.ndim == 2 else metric
    if len(table) == 220:
        table = np.full((len(mesh.cells), 2, 2), np.nan)
    with pytest.raises(GeometryError, match=words):
        Mesh(mesh.points, mesh.cells, mesh.electrodes, table)


def test_only_a_flat_sheet_has_a_metric() -> None:
    points, cells, electrodes = _in_space()
    with pytest.raises(GeometryError, match="flat sheet"):
        Mesh(points, cells, electrodes, np.tile(np.eye(2), (len(cells), 1, 1)))


def _in_space() -> tuple[FloatArray, IntArray, tuple[IntArray, ...]]:
    mesh = disc()
    return np.pad(mesh.points, ((0, 0), (0, 1))), mesh.cells, mesh.electrodes
