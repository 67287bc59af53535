"""The model against solutions that are known without it."""

from __future__ import annotations

import numpy as np
import pytest

from oracles import disc_points, disc_resistance
from shapes import box, disc, folded, refined, strip
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

RADIUS, SIGMA, WIDTH = 0.1, 2.0, 0.03
ENDS = Pattern.from_tables([[1, 0]], [[1, 0]])


def on_circle(points: FloatArray) -> FloatArray:
    return np.asarray(RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True))


def rim(n: int) -> FloatArray:
    """(n,) rad: the middle of each electrode of ``shapes.disc``."""
    return np.asarray(np.pi / 2 - 2 * np.pi * np.arange(n) / n)


def resistance(mesh: Mesh, impedance: FloatArray) -> FloatArray:
    model = ForwardModel(mesh, Pattern.adjacent(len(mesh.electrodes)), impedance)
    return np.asarray(model.transfer_resistance(SIGMA))


def test_disc_with_complete_electrodes_converges_to_the_series() -> None:
    impedance = np.geomspace(0.01, 0.1, 8)
    exact = disc_resistance(RADIUS, SIGMA, rim(8), WIDTH / RADIUS / 2, impedance)
    meshes = [disc(8, 250, width=WIDTH)]
    for _ in range(2):
        meshes.append(refined(meshes[-1], on_circle))
    errors = [np.abs(resistance(m, impedance) - exact).max() / np.abs(exact).max() for m in meshes]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 1e-3
    # an energy of linear elements: order 2, slowed by the field's r·log r at electrode ends
    assert ((orders > 1.5) & (orders < 2.2)).all(), (errors, orders)


def test_series_has_converged() -> None:
    impedance = np.full(8, 0.002)
    coarse = disc_resistance(RADIUS, SIGMA, rim(8), 0.1, impedance, degree=8, harmonics=2000)
    fine = disc_resistance(RADIUS, SIGMA, rim(8), 0.1, impedance, degree=14, harmonics=8000)
    assert np.abs(coarse - fine).max() < 1e-5 * np.abs(fine).max()


def test_series_tends_to_points() -> None:
    """Tiny electrodes that carry no current read the potential of point electrodes."""
    angle = rim(8)
    point = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    r = disc_resistance(RADIUS, SIGMA, angle, 1e-3, np.full(8, 1.0), degree=2, harmonics=20000)
    measured = r[:, 1] - r[:, 0]
    exact = disc_points(SIGMA, point[1], point[0], point[2:])
    assert measured[2] - measured[5] == pytest.approx(exact[0] - exact[3], rel=1e-5)


def test_potentials_far_from_small_electrodes_are_those_of_points() -> None:
    mesh = disc(8, 2500, width=0.004)
    pattern = Pattern.opposite(8)
    model = ForwardModel(mesh, pattern, contact_impedance=0.05)
    solution = model.solve(SIGMA)
    ends = RADIUS * np.column_stack([np.cos(rim(8)), np.sin(rim(8))])
    inner = np.linalg.norm(mesh.points, axis=1) < 0.6 * RADIUS
    for drive, (source, sink) in enumerate(pattern.drives):
        exact = disc_points(SIGMA, ends[source], ends[sink], mesh.points[inner])
        got = solution.potentials[drive, inner]
        difference = got - exact
        # the mesh's coarse source shifts the electrodes' mean, and with it the free constant
        assert np.ptp(difference) < 1e-3 * np.ptp(exact)


def test_bar_between_full_ends() -> None:
    """A linear potential is exact: R = L/(σ A) + z₁/A + z₂/A."""
    mesh = box(np.linspace(0, 0.3, 5), np.array([0, 0.01, 0.04]), np.array([0, 0.02, 0.03]))
    model = ForwardModel(mesh, ENDS, contact_impedance=[1e-4, 3e-4], current=0.5)
    area = 0.04 * 0.03
    expected = 0.5 * (0.3 / (SIGMA * area) + 4e-4 / area)
    assert model.solve(SIGMA).voltages[0] == pytest.approx(expected, rel=1e-12)


def test_layers_of_a_bar_add_up() -> None:
    x = np.array([0, 0.1, 0.15, 0.3])
    layers = np.array([1.0, 5.0, 0.2])
    mesh = box(x, np.linspace(0, 0.04, 3), np.linspace(0, 0.03, 3))
    layer = np.searchsorted(x, mesh.centroids[:, 0]) - 1
    area, z = 0.04 * 0.03, 1e-4
    expected = (np.diff(x) / layers).sum() / area + 2 * z / area
    model = ForwardModel(mesh, ENDS, z)
    assert model.solve(layers[layer]).voltages[0] == pytest.approx(expected, rel=1e-10)
    # each layer's share of the derivative: dR/dσ = −Δx/(σ² A)
    jacobian = model.jacobian(layers[layer])[0]
    shares = np.bincount(layer, weights=jacobian)
    assert shares == pytest.approx(-np.diff(x) / layers**2 / area, rel=1e-10)


def test_strip_between_its_ends() -> None:
    """In two dimensions: R = L/(σ W) + 2 z/W."""
    flat = strip(np.linspace(0, 0.2, 9), np.linspace(0, 0.05, 4))
    ends = (np.array([[0, 9], [9, 18], [18, 27]]), np.array([[8, 17], [17, 26], [26, 35]]))
    model = ForwardModel(Mesh(flat.points, flat.cells, ends), ENDS, 1e-3)
    expected = 0.2 / (SIGMA * 0.05) + 2e-3 / 0.05
    assert model.solve(SIGMA).voltages[0] == pytest.approx(expected, rel=1e-12)


def test_folded_strip_equals_the_flat_one() -> None:
    x = np.linspace(0, 0.2, 25)
    flat = strip(x, np.linspace(0, 0.06, 7))
    rolled = folded(flat, x[1:-1], 2 * np.pi / 26)
    assert rolled.points.shape[1] == 3
    assert np.ptp(rolled.points[:, 2]) > 0.05
    pattern = Pattern.adjacent(4, include_driven=True)
    sigma = np.random.default_rng(0).uniform(0.5, 2, len(flat.cells))
    got = ForwardModel(rolled, pattern, 1e-3).at(sigma)
    expected = ForwardModel(flat, pattern, 1e-3).at(sigma)
    scale = np.abs(expected.voltages).max()
    assert got.voltages == pytest.approx(expected.voltages, abs=1e-10 * scale)
    assert got.jacobian == pytest.approx(
        expected.jacobian, abs=1e-10 * np.abs(expected.jacobian).max()
    )
