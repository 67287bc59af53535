"""Tetrahedra against solutions in three dimensions."""

from __future__ import annotations

import numpy as np
import pytest

from convergence import check_order, check_order_from_below, check_order_with_log
from golden import mismatch
from oracles import Corner, box_resistance
from shapes import box, mapped, patched
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

PAIR = Pattern.from_tables([[0, 1]], [[0, 1]])
SIGMA = 2.0


# Electrodes on whole faces: the plane's solution, whatever the depth.


def corner_error(n: int, order: int) -> float:
    exact = Corner(0.3, 0.2, SIGMA, left=0.3, lower=0.2)
    axes = (
        np.linspace(0, 0.3, 3 * n + 1),
        np.linspace(0, 0.2, 2 * n + 1),
        np.linspace(0, 0.1, n + 1),
    )
    mesh = patched(box(*axes), lambda p: p[:, 0] == 0, lambda p: p[:, 1] == 0)
    model = ForwardModel(mesh, PAIR, [exact.left, exact.lower], order=order)
    return 1 - float(model.solve(SIGMA).voltages[0]) * 0.1 / exact.resistance


def test_electrodes_on_whole_faces() -> None:
    check_order([corner_error(n, 1) for n in (1, 2, 4)], 2)
    check_order_with_log([corner_error(n, 2) for n in (1, 2, 4)], 4)


# Patches on the top of a box.

CENTRES = np.array([[0.04, 0.04], [0.12, 0.06]])
SIZE = np.array([0.16, 0.08, 0.04])
IMPEDANCE = np.array([0.02, 0.04])


def patch_resistance(n: int, order: int) -> FloatArray:
    axes = [np.linspace(0, s, round(50 * n * s) + 1) for s in SIZE]
    patches = [
        lambda p, c=c: (p[:, 2] == SIZE[2]) & (np.abs(p[:, :2] - c) < 0.02).all(axis=1)
        for c in CENTRES
    ]
    model = ForwardModel(patched(box(*axes), *patches), PAIR, IMPEDANCE, order=order)
    return np.asarray(model.transfer_resistance(SIGMA))


def test_patches_on_a_box() -> None:
    """The potential is r log r around a patch, as at the ends of an electrode in the plane."""
    exact = box_resistance(SIZE, SIGMA, CENTRES, 0.02, IMPEDANCE, degree=4)
    linear = [mismatch(patch_resistance(n, 1), exact) for n in (1, 2, 4)]
    quadratic = [mismatch(patch_resistance(n, 2), exact) for n in (1, 2)]
    check_order_with_log(linear, 2)
    check_order(quadratic, 2, within=0.15)
    assert quadratic[-1] < linear[-1] / 3


def test_the_series_of_a_box_tends_to_a_half_space() -> None:
    """Four small electrodes in a row, deep under them a half-space: V = I/(2πσ) Σ ±1/r.

    The mean of 1/r over two squares of half width w is (1 + w²/(3r²))/r, to fourth order.
    """
    apart, half, middle = 0.02, 0.004, 0.25
    place = np.column_stack([middle + apart * np.arange(-1.5, 2), np.full(4, middle)])
    r = box_resistance(np.full(3, 0.5), SIGMA, place, half, np.full(4, 0.1), degree=0, waves=400)

    def potential(distance: float) -> float:
        return (1 + half**2 / (3 * distance**2)) / (2 * np.pi * SIGMA * distance)

    measured = (r[1, 0] - r[2, 0]) - (r[1, 3] - r[2, 3])
    assert measured == pytest.approx(2 * potential(apart) - 2 * potential(2 * apart), rel=3e-3)


# Around a sphere: a third of the half-space below a hemisphere that lies in its face.


def sector(n: int, near: float, far: float) -> Mesh:
    """A sixth of the space around a sphere, out to ``far``; electrodes are both spheres' parts."""
    side, depth = np.linspace(-1, 1, 2 * n + 1), np.linspace(0, 1, 8 * n + 1)

    def place(p: FloatArray) -> FloatArray:
        way = np.tan(np.pi / 4 * p[:, 1:])
        direction = np.column_stack([np.ones(len(p)), way])
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        return direction * near * (far / near) ** p[:, :1]

    return mapped(box(depth, side, side), place)


@pytest.mark.parametrize("order", [1, 2])
def test_a_sphere_in_space(order: int) -> None:
    """Current that spreads from a small electrode to far away, on cells that grow with r."""
    near, far, z, solid = 0.01, 1.0, np.array([2e-3, 1.0]), 4 * np.pi / 6
    contacts = z[0] / (solid * near**2) + z[1] / (solid * far**2)
    exact = (1 / near - 1 / far) / (SIGMA * solid) + contacts
    errors = []
    for n in (1, 2, 4):
        model = ForwardModel(sector(n, near, far), PAIR, z, order=order)
        errors.append(abs(float(model.solve(SIGMA).voltages[0]) / exact - 1))
    check_order_from_below(errors, 2, short=0.3)
