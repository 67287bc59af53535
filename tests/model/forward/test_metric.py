"""Flat meshes with a metric: sheets that are stretched or laid on surfaces, in their own plane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from convergence import check_order_with_log
from golden import mismatch
from oracles import disc_resistance
from shapes import disc, mapped, patched, rings
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Arm, Cap, Cylinder, Mesh, Saddle, Surface, laid_on
from tomoskin.model.pattern import Pattern

Z = np.geomspace(0.01, 0.04, 8)
STRETCH = np.array([[1.3, 0.2], [0.0, 0.8]])


def model(mesh: Mesh, order: int = 1) -> ForwardModel:
    n = len(mesh.electrodes)
    return ForwardModel(mesh, Pattern.adjacent(n), Z[:n], order=order)


def stretched(mesh: Mesh, stretch: FloatArray) -> Mesh:
    return replace(mesh, metric=np.tile(stretch.T @ stretch, (len(mesh.cells), 1, 1)))


@pytest.mark.parametrize("order", [1, 2])
def test_a_stretch_equals_the_stretched_mesh(order: int) -> None:
    flat = disc()
    sigma = np.random.default_rng(0).uniform(0.5, 2, len(flat.cells))
    got = model(stretched(flat, STRETCH), order).at(sigma)
    expected = model(mapped(flat, lambda p: p @ STRETCH.T), order).at(sigma)
    assert mismatch(got.voltages, expected.voltages) < 1e-10
    assert mismatch(got.jacobian, expected.jacobian) < 1e-10
    assert mismatch(got.contact_jacobian, expected.contact_jacobian) < 1e-10
    assert mismatch(got.power, expected.power) < 1e-10


def test_a_tensor_is_in_the_frame_that_begins_with_x() -> None:
    """A sheet that conducts along its own threads, stretched, against the mesh that was moved."""
    flat = disc()
    threads = np.diag([3.0, 0.5])
    moved = mapped(flat, lambda p: p @ STRETCH.T)
    along = STRETCH[:, 0] / np.linalg.norm(STRETCH[:, 0])
    frame = np.column_stack([along, [-along[1], along[0]]])
    n = len(flat.cells)
    got = model(stretched(flat, STRETCH)).at(np.tile(threads, (n, 1, 1)))
    expected = model(moved).at(np.tile(frame @ threads @ frame.T, (n, 1, 1)))
    assert mismatch(got.voltages, expected.voltages) < 1e-10


def test_a_tensor_of_the_plane_does_what_the_metric_does() -> None:
    """√G G⁻¹σ in the plane, with contacts that shrink as their electrodes grow: the same sheet."""
    flat = disc()
    n = len(flat.cells)
    even = 1.25 * np.eye(2)  # all electrodes grow alike
    metric = even.T @ even
    tensor = np.sqrt(np.linalg.det(metric)) * np.linalg.inv(metric)
    got = model(stretched(flat, even)).at(2.0).voltages
    pattern = Pattern.adjacent(8)
    expected = ForwardModel(flat, pattern, Z / 1.25).at(2.0 * np.tile(tensor, (n, 1, 1)))
    assert mismatch(got, expected.voltages) < 1e-10


@pytest.mark.parametrize("radius", [0.04, 0.07, 0.5])
def test_a_sheet_on_a_cylinder_equals_the_flat_one(radius: float) -> None:
    flat = disc(width=0.015)
    got = model(laid_on(flat, Cylinder(radius))).at(1.0).voltages
    assert mismatch(got, model(flat).at(1.0).voltages) < 1e-10


def test_a_cap_is_the_disc_of_its_rim_to_second_order() -> None:
    """Gauss: a sphere around an axis maps to a disc with the angles kept."""
    quarter, half, radius = np.arange(4) * np.pi / 2, np.pi / 8, 0.09
    exact = disc_resistance(radius * np.sin(0.1 / radius), 2.0, quarter, half, Z[:4])

    def error(n: int) -> float:
        flat = rings(np.linspace(0, 0.1, 4 * n + 1)[1:], 16 * n)
        turn = [_within(angle, half) for angle in quarter]
        laid = laid_on(patched(flat, *turn), Cap(radius))
        return mismatch(model(laid).transfer_resistance(2.0), exact)

    check_order_with_log([error(n) for n in (1, 2, 4)], 2)


def _within(angle: float, half: float) -> Callable[[FloatArray], NDArray[np.bool_]]:
    return lambda p: np.cos(np.arctan2(p[:, 1], p[:, 0]) - angle) > np.cos(half)


@pytest.mark.parametrize("surface", [Cap(0.12), Saddle(0.2, 0.3), Arm(0.06, 0.6, 0.12)], ids=str)
def test_the_metric_and_the_chords_in_space_agree_to_second_order(surface: Surface) -> None:
    def gap(cells: int) -> float:
        flat = disc(cells=cells)
        space = mapped(flat, surface.point)
        one, other = (model(m).at(1.0).voltages for m in (laid_on(flat, surface), space))
        return mismatch(one, other)

    coarse, fine = gap(400), gap(6400)
    assert fine < 0.15 * coarse < 0.01


def test_touches_on_a_stretched_sheet_are_exact() -> None:
    mesh = stretched(disc(), STRETCH)
    state = model(mesh).at(1.0)
    cells = np.arange(5)
    sigma = np.ones(len(mesh.cells))
    sigma[cells] = 0.6
    got = state.local.voltages(cells, np.full(5, 0.6))
    assert mismatch(got, model(mesh).at(sigma).voltages) < 1e-10


def test_movement_needs_the_true_shape() -> None:
    with pytest.raises(ModelError, match="true shape"):
        _ = model(stretched(disc(), STRETCH)).at(1.0).movement_jacobian
