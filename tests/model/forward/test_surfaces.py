"""Curved sheets: bent without stretching, round tubes, caps and bowls.

A sheet that turns into itself around an axis maps to a flat disc or ring with the angles kept
(Gauss's isothermal coordinates), and so do its potentials: only its rim and the depth
∫ ds / r(s) count. The rim carries the electrodes' lengths as they are.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from convergence import check_order_from_below, check_order_with_log
from golden import mismatch
from oracles import disc_resistance, inclusion, tube
from shapes import folded, mapped, patched, rings, strip, tube as tube_mesh
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

Z = np.geomspace(0.01, 0.04, 4)
QUARTERS = np.arange(4) * np.pi / 2
HALF = np.pi / 8
RIM = 0.1


def resistance(mesh: Mesh, sigma: FloatArray | float, order: int = 1) -> FloatArray:
    model = ForwardModel(mesh, Pattern.adjacent(len(mesh.electrodes)), Z, order=order)
    return np.asarray(model.transfer_resistance(sigma))


def on_rim(at_rim: Callable[[FloatArray], FloatArray], mesh: Mesh) -> Mesh:
    """Four electrodes on the part of the boundary where ``at_rim`` holds, a quarter turn apart."""

    def patch(centre: float) -> Callable[[FloatArray], FloatArray]:
        def inside(p: FloatArray) -> FloatArray:
            turn = np.arctan2(p[:, 1], p[:, 0]) - centre
            return np.asarray(at_rim(p) & (np.cos(turn) > np.cos(HALF)))

        return inside

    return patched(mesh, *map(patch, QUARTERS))


# Bent without stretching.


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("turns", [0.3, 0.95, 2.5])
def test_a_rolled_strip_equals_the_flat_one(turns: float, order: int) -> None:
    """Any number of turns: the sheet knows nothing of the space around it."""
    x = np.linspace(0, 0.2, 25)
    flat = strip(x, np.linspace(0, 0.06, 7))
    rolled = folded(flat, x[1:-1], 2 * np.pi * turns / 24)
    sigma = np.random.default_rng(0).uniform(0.5, 2, len(flat.cells))
    pattern = Pattern.adjacent(4, include_driven=True)
    got, expected = (ForwardModel(m, pattern, Z, order=order).at(sigma) for m in (rolled, flat))
    assert mismatch(got.voltages, expected.voltages) < 1e-10
    assert mismatch(got.potentials, expected.potentials) < 1e-10
    assert mismatch(got.jacobian, expected.jacobian) < 1e-10
    assert mismatch(got.power, expected.power) < 1e-10
    assert mismatch(got.contact_jacobian, expected.contact_jacobian) < 1e-10


@pytest.mark.parametrize("order", [1, 2])
def test_folds_at_any_angle(order: int) -> None:
    x = np.linspace(0, 0.2, 25)
    flat = strip(x, np.linspace(0, 0.06, 7))
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, 4)
    path = mapped(flat, lambda p: np.column_stack([p, 0 * p[:, 0]]))
    for place, angle in zip(x[[4, 9, 15, 20]], angles, strict=True):
        path = mapped(path, lambda p, s=place, a=angle: turned(flat, p, s, a))
    assert np.ptp(path.points[:, 2]) > 0.02
    sigma = np.random.default_rng(2).uniform(0.5, 2, len(flat.cells))
    assert mismatch(resistance(path, sigma, order), resistance(flat, sigma, order)) < 1e-10


def turned(flat: Mesh, points: FloatArray, place: float, angle: float) -> FloatArray:
    """Turn what lies beyond x = ``place`` on the flat sheet about that line."""
    beyond = flat.points[:, 0] > place
    axis = points[np.isclose(flat.points[:, 0], place)][0] * [1, 0, 1]
    c, s = np.cos(angle), np.sin(angle)
    moved = (points - axis) @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T + axis
    return np.where(beyond[:, None], moved, points)


# Tubes.


@pytest.mark.parametrize("stagger", [0.0, 0.5], ids=["prism", "staggered"])
def test_a_round_tube(stagger: float) -> None:
    """Inscribed meshes, in the faces of a prism or not, close in on the unrolled tube."""
    exact = disc_resistance(RIM, 2.0, QUARTERS, HALF, Z, factor=tube(1.2))

    def error(n: int, order: int) -> float:
        mesh = tube_mesh(16 * n, 4 * n, RIM, 1.2 * RIM, stagger=stagger)
        return mismatch(resistance(on_rim(lambda p: p[:, 2] == 0, mesh), 2.0, order), exact)

    check_order_with_log([error(n, 1) for n in (1, 2, 4)], 2)
    check_order_from_below([error(n, 2) for n in (1, 2, 4)], 2)


def test_a_tube_with_electrodes_on_both_rims() -> None:
    """Both rims driven alike: no current crosses the middle, as in a tube of half the height."""
    mesh = tube_mesh(64, 32, RIM, 2.4 * RIM, stagger=0.5)
    rims = (on_rim(lambda p, z=z: np.isclose(p[:, 2], z), mesh) for z in (0, 2.4 * RIM))
    both = Mesh(mesh.points, mesh.cells, tuple(e for rim in rims for e in rim.electrodes))
    model = ForwardModel(both, Pattern.adjacent(8), np.tile(Z, 2), order=2)
    r = model.transfer_resistance(2.0)
    exact = disc_resistance(RIM, 2.0, QUARTERS, HALF, Z, factor=tube(1.2))
    assert mismatch(r[:4, :4] + r[:4, 4:], exact) < 2e-3
    assert mismatch(r[4:, 4:] + r[4:, :4], exact) < 2e-3


# Caps and bowls.


def cap(n: int, angle: float, inner: float) -> Mesh:
    """Part of a sphere within ``angle`` rad of its pole, rim radius RIM, a ring at ``inner``."""
    steps = np.linspace(0, inner, 2 * n + 1), np.linspace(inner, angle, 2 * n + 1)[1:]
    polar = np.concatenate(steps)[1:]
    sphere = RIM / np.sin(angle)

    def place(p: FloatArray) -> FloatArray:
        theta, turn = np.linalg.norm(p, axis=1), np.arctan2(p[:, 1], p[:, 0])
        ring = np.sin(theta)
        return sphere * np.column_stack([ring * np.cos(turn), ring * np.sin(turn), np.cos(theta)])

    return on_rim(lambda p: np.full(len(p), True), mapped(rings(polar, 16 * n), place))


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.4], ids=["flat", "hemisphere", "bulb"])
def test_a_homogeneous_cap_is_the_disc_of_its_rim(angle: float) -> None:
    exact = disc_resistance(RIM, 2.0, QUARTERS, HALF, Z)
    linear, quadratic = (
        [mismatch(resistance(cap(n, angle, angle / 2), 2.0, order), exact) for n in (1, 2, 4)]
        for order in (1, 2)
    )
    check_order_with_log(linear, 2)
    check_order_from_below(quadratic, 2)


@pytest.mark.parametrize("contrast", [0.1, 10.0])
@pytest.mark.parametrize("angle", [np.pi / 2, 2.4], ids=["hemisphere", "bulb"])
def test_a_cap_with_another_pole(angle: float, contrast: float) -> None:
    """Stereographic projection: tan(θ/2) is the radius on the disc."""
    inner = 0.7 * angle
    factor = inclusion(contrast, np.tan(inner / 2) / np.tan(angle / 2))
    exact = disc_resistance(RIM, 2.0, QUARTERS, HALF, Z, factor=factor)

    def error(n: int, order: int) -> float:
        mesh = cap(n, angle, inner)
        polar = mesh.centroids[:, 2] > RIM / np.sin(angle) * np.cos(inner)
        sigma = np.where(polar, 2.0 * contrast, 2.0)
        return mismatch(resistance(mesh, sigma, order), exact)

    check_order_with_log([error(n, 1) for n in (1, 2, 4)], 2)
    check_order_from_below([error(n, 2) for n in (1, 2, 4)], 2)
