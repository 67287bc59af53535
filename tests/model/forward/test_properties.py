"""What every solution of the complete electrode model must satisfy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from golden import mismatch
from shapes import box, disc, folded, strip
from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, simplex_measure
from tomoskin.model.pattern import Pattern

N = 8
PATTERN = Pattern.adjacent(N)
Z = np.geomspace(0.001, 0.02, N)


def plane() -> Mesh:
    return disc(N)


def curved() -> Mesh:
    x = np.linspace(0, 0.2, 13)
    return folded(strip(x, np.linspace(0, 0.06, 5)), x[3:-1:3], 0.4)


def volume() -> Mesh:
    """Box with both ends and two patches on its sides as electrodes."""
    axes = np.linspace(0, 0.2, 6), np.linspace(0, 0.06, 4), np.linspace(0, 0.04, 3)
    bar = box(*axes)
    facet = bar.boundary
    middle = bar.points[facet].mean(axis=1)
    centre = (middle[:, 0] > 0.08) & (middle[:, 0] < 0.12)
    low = facet[centre & (middle[:, 1] == 0)]
    high = facet[centre & (middle[:, 1] == axes[1][-1])]
    return Mesh(bar.points, bar.cells, (*bar.electrodes, low, high))


MESHES = {"plane": plane, "curved": curved, "volume": volume}


@pytest.fixture(scope="module", params=MESHES)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]()


@pytest.fixture(scope="module")
def model(mesh: Mesh) -> ForwardModel:
    n = len(mesh.electrodes)
    pattern = Pattern.all_pairs(n, include_driven=n < 6)
    return ForwardModel(mesh, pattern, Z[:n], current=0.1)


@pytest.fixture(scope="module")
def sigma(mesh: Mesh) -> FloatArray:
    return np.exp(0.5 * np.random.default_rng(1).standard_normal(len(mesh.cells)))


def electrode_currents(model: ForwardModel, sigma: NDArray[Any]) -> NDArray[Any]:
    """(n_drive, n_el) A: ∫ (U − u)/z over each electrode's facets."""
    solution, mesh = model.solve(sigma), model.mesh
    currents = np.empty_like(solution.electrode_potentials)
    for e, facets in enumerate(mesh.electrodes):
        size = simplex_measure(mesh.points, facets)
        mean = solution.potentials[:, facets].mean(axis=2)
        drop = solution.electrode_potentials[:, e, None] - mean
        currents[:, e] = drop @ size / model.contact_impedance[e]
    return currents


def expected_currents(model: ForwardModel) -> FloatArray:
    rows = np.arange(model.pattern.n_drive)
    expected = np.zeros((model.pattern.n_drive, model.pattern.n_electrodes))
    expected[rows, model.pattern.drives[:, 0]] = model.current
    expected[rows, model.pattern.drives[:, 1]] = -model.current
    return expected


def test_currents_enter_and_leave_where_they_are_driven(
    model: ForwardModel, sigma: FloatArray
) -> None:
    currents = electrode_currents(model, sigma)
    assert mismatch(currents, expected_currents(model)) < 1e-10
    assert np.abs(currents.sum(axis=1)).max() < 1e-10 * model.current[0]


def test_transfer_resistance_is_symmetric_and_blind_to_constants(
    model: ForwardModel, sigma: FloatArray
) -> None:
    r = model.transfer_resistance(sigma)
    scale = np.abs(r).max()
    assert np.abs(r - r.T).max() < 1e-12 * scale
    assert np.abs(r.sum(axis=0)).max() < 1e-12 * scale
    eigenvalues = np.linalg.eigvalsh(r)
    assert eigenvalues[0] == pytest.approx(0, abs=1e-12 * scale)
    assert eigenvalues[1] > 0


def test_reciprocity_of_voltages_on_a_plane_sheet() -> None:
    voltages = ForwardModel(plane(), PATTERN, Z).solve(random_sigma(plane())).voltages
    table = {
        (tuple(sorted(d)), tuple(sorted(m))): v
        for d, m, v in zip(PATTERN.drive.tolist(), PATTERN.measure.tolist(), voltages, strict=True)
    }
    signs = np.sign(np.diff(PATTERN.drive) * np.diff(PATTERN.measure)).ravel()
    assert len(table) == len(signs) == N * (N - 3)
    for (d, m), value in table.items():
        assert abs(table[m, d]) == pytest.approx(abs(value), rel=1e-11)


def random_sigma(mesh: Mesh, seed: int = 2) -> FloatArray:
    return np.exp(0.5 * np.random.default_rng(seed).standard_normal(len(mesh.cells)))


def test_homogeneous_disc_gives_positive_voltages() -> None:
    assert (ForwardModel(plane(), PATTERN, 0.01).solve(1.0).voltages > 0).all()


def test_voltages_scale_with_resistance(mesh: Mesh, sigma: FloatArray, model: ForwardModel) -> None:
    scaled = ForwardModel(mesh, model.pattern, model.contact_impedance / 7, model.current)
    got, expected = scaled.solve(7 * sigma).voltages, model.solve(sigma).voltages / 7
    assert mismatch(got, expected) < 1e-11


def test_voltages_scale_with_each_drives_current() -> None:
    mesh, current = plane(), np.linspace(-2, 3, N)
    unit = ForwardModel(mesh, PATTERN, Z).at(1.0)
    driven = ForwardModel(mesh, PATTERN, Z, current).at(1.0)
    per_row = current[PATTERN.drive_index]
    assert mismatch(driven.voltages, per_row * unit.voltages) < 1e-13
    assert mismatch(driven.jacobian, per_row[:, None] * unit.jacobian) < 1e-13
    assert mismatch(driven.potentials, current[:, None] * unit.potentials) < 1e-13


def test_one_conductivity_is_that_of_every_cell() -> None:
    model = ForwardModel(plane(), PATTERN, 0.01)
    full = model.solve(np.full(len(model.mesh.cells), 3.0))
    assert np.array_equal(model.solve(3.0).voltages, full.voltages)
    assert np.array_equal(model.solve(3).voltages, full.voltages)


def test_complex_path_equals_real_path(model: ForwardModel, sigma: FloatArray) -> None:
    real, imaginary = model.at(sigma), model.at(sigma.astype(complex))
    assert np.iscomplexobj(imaginary.voltages)
    assert not np.iscomplexobj(real.voltages)
    assert mismatch(imaginary.voltages, real.voltages) < 1e-11
    assert mismatch(imaginary.jacobian, real.jacobian) < 1e-11


def test_complex_admittivity_is_reciprocal(mesh: Mesh, sigma: FloatArray) -> None:
    n = len(mesh.electrodes)
    model = ForwardModel(mesh, Pattern.all_pairs(n, include_driven=True), Z[:n] * (1 - 0.3j))
    admittivity = sigma * (1 + 0.7j * np.random.default_rng(3).random(len(sigma)))
    r = model.transfer_resistance(admittivity)
    assert np.abs(r - r.T).max() < 1e-12 * np.abs(r).max()
    assert np.abs(r.imag).max() > 0.01 * np.abs(r).max()
    assert mismatch(electrode_currents(model, admittivity), expected_currents(model)) < 1e-10


def test_jacobian_equals_the_complex_step(model: ForwardModel, sigma: FloatArray) -> None:
    rng, h = np.random.default_rng(4), 1e-20
    jacobian = model.jacobian(sigma)
    for _ in range(4):
        direction = rng.standard_normal(len(sigma))
        step = model.solve(sigma + 1j * h * direction).voltages.imag / h
        assert mismatch(jacobian @ direction, step) < 1e-10


def test_jacobian_equals_central_differences_cell_by_cell() -> None:
    model = ForwardModel(plane(), PATTERN, Z)
    sigma = random_sigma(model.mesh)
    jacobian = model.jacobian(sigma)
    for cell in np.random.default_rng(5).choice(len(sigma), 6, replace=False):
        h = np.zeros(len(sigma))
        h[cell] = 1e-5 * sigma[cell]
        change = model.solve(sigma + h).voltages - model.solve(sigma - h).voltages
        assert (
            np.abs(change / (2 * h[cell]) - jacobian[:, cell]).max()
            < 1e-6 * np.abs(jacobian[:, cell]).max()
        )


def test_complex_jacobian_equals_central_differences() -> None:
    model = ForwardModel(plane(), PATTERN, Z * (1 - 0.3j))
    rng = np.random.default_rng(6)
    sigma = random_sigma(model.mesh) * (1 + 0.5j * rng.random(len(model.mesh.cells)))
    for direction in (rng.standard_normal(len(sigma)), 1j * rng.standard_normal(len(sigma))):
        h = 1e-5 * direction
        change = model.solve(sigma + h).voltages - model.solve(sigma - h).voltages
        assert mismatch(change / 2e-5, model.jacobian(sigma) @ direction) < 1e-6


def test_conductivity_and_contact_derivatives_add_up_to_the_voltage(
    model: ForwardModel, sigma: FloatArray
) -> None:
    """V is homogeneous of degree −1 in (σ, 1/z): Σ σ ∂V/∂σ + Σ (1/z) ∂V/∂(1/z) = −V."""
    h = 1e-20
    state = model.at(sigma)
    contact = ForwardModel(
        model.mesh, model.pattern, model.contact_impedance / (1 + 1j * h), model.current
    )
    from_contact = contact.solve(sigma).voltages.imag / h
    total = state.jacobian @ sigma + from_contact
    assert mismatch(total, -state.voltages) < 1e-10
    assert np.abs(from_contact).max() > 1e-3 * np.abs(state.voltages).max()


def test_orientation_of_cells_and_facets_does_not_matter(
    model: ForwardModel, sigma: FloatArray
) -> None:
    mesh, rng = model.mesh, np.random.default_rng(7)
    cells = rng.permuted(mesh.cells, axis=1)
    electrodes = tuple(rng.permuted(e, axis=1) for e in mesh.electrodes)
    turned = altered(model, Mesh(mesh.points, cells, electrodes)).at(sigma)
    expected = model.at(sigma)
    assert mismatch(turned.voltages, expected.voltages) < 1e-11
    assert mismatch(turned.jacobian, expected.jacobian) < 1e-11


def test_numbering_does_not_matter(model: ForwardModel, sigma: FloatArray) -> None:
    mesh, rng = model.mesh, np.random.default_rng(8)
    old = rng.permutation(len(mesh.points))
    new: IntArray = np.argsort(old)
    order = rng.permutation(len(mesh.cells))
    electrodes = tuple(new[e] for e in mesh.electrodes)
    moved = altered(model, Mesh(mesh.points[old], new[mesh.cells][order], electrodes))
    got, expected = moved.at(sigma[order]), model.at(sigma)
    assert mismatch(got.voltages, expected.voltages) < 1e-11
    assert mismatch(got.jacobian, expected.jacobian[:, order]) < 1e-11
    assert mismatch(got.potentials, expected.potentials[:, old]) < 1e-11


def altered(model: ForwardModel, mesh: Mesh) -> ForwardModel:
    return ForwardModel(mesh, model.pattern, model.contact_impedance, model.current)


def test_numbering_of_electrodes_does_not_matter() -> None:
    mesh, sigma = plane(), random_sigma(plane())
    order = np.random.default_rng(9).permutation(N)
    model = ForwardModel(mesh, PATTERN, Z)
    moved = Mesh(mesh.points, mesh.cells, tuple(mesh.electrodes[e] for e in order))
    got = ForwardModel(moved, PATTERN, Z[order]).transfer_resistance(sigma)
    assert mismatch(got, model.transfer_resistance(sigma)[np.ix_(order, order)]) < 1e-11


def test_electrode_potentials_sum_to_zero(model: ForwardModel, sigma: FloatArray) -> None:
    potentials = model.solve(sigma).electrode_potentials
    assert np.abs(potentials.sum(axis=1)).max() < 1e-12 * np.abs(potentials).max()


def test_potentials_obey_the_maximum_principle(model: ForwardModel, sigma: FloatArray) -> None:
    solution = model.solve(sigma)
    assert solution.potentials.max() <= solution.electrode_potentials.max()
    assert solution.potentials.min() >= solution.electrode_potentials.min()


def test_shapes_and_what_a_state_shares() -> None:
    model = ForwardModel(plane(), PATTERN, Z)
    state = model.at(1.0)
    assert state.voltages.shape == (PATTERN.n_meas,)
    assert state.electrode_potentials.shape == (PATTERN.n_drive, N)
    assert state.potentials.shape == (PATTERN.n_drive, len(model.mesh.points))
    assert state.jacobian.shape == (PATTERN.n_meas, len(model.mesh.cells))
    assert state.potentials is state.potentials
    assert np.array_equal(model.jacobian(1.0), state.jacobian)
