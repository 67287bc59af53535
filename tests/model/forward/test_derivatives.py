"""Every derivative against central differences, and the balance of power."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from golden import mismatch
from shapes import box, disc, folded, patched, strip
from tomoskin.core import IntArray, ModelError
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.mesh import Mesh, simplex_measure
from tomoskin.model.pattern import Pattern


def curved() -> Mesh:
    x = np.linspace(0, 0.2, 13)
    return folded(strip(x, np.linspace(0, 0.06, 5)), x[3:-1:3], 0.4)


def volume() -> Mesh:
    """Box with patches on three sides; two of them meet in a corner of the box."""
    bar = box(np.linspace(0, 0.2, 6), np.linspace(0, 0.06, 4), np.linspace(0, 0.04, 3))
    return patched(
        bar,
        lambda p: (p[:, 2] == 0.04) & (p[:, 0] < 0.05),
        lambda p: (p[:, 2] == 0.04) & (p[:, 0] > 0.13),
        lambda p: p[:, 0] == 0,
        lambda p: (p[:, 1] == 0.06) & (p[:, 0] > 0.1) & (p[:, 0] < 0.2),
    )


MESHES: dict[str, Callable[[], Mesh]] = {"plane": disc, "curved": curved, "volume": volume}


@pytest.fixture(scope="module", params=MESHES)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]()


@pytest.fixture(params=[1.0, 1 + 0.6j], ids=["real", "complex"])
def turn(request: pytest.FixtureRequest) -> complex:
    return request.param


@pytest.fixture(params=[1, 2], ids=["linear", "quadratic"])
def order(request: pytest.FixtureRequest) -> int:
    return request.param


def model(
    mesh: Mesh, *, order: int = 1, impedance: Any = None, turn: complex = 1.0
) -> ForwardModel:
    n = len(mesh.electrodes)
    z = np.geomspace(0.002, 0.02, n) * np.conj(turn) if impedance is None else impedance
    pattern = Pattern.all_pairs(n, include_driven=n < 6)
    current = np.linspace(0.1, 0.2, pattern.n_drive)
    return ForwardModel(mesh, pattern, z, current, order=order)


def scalar(mesh: Mesh, turn: complex) -> NDArray[Any]:
    rng = np.random.default_rng(0)
    return np.exp(0.5 * rng.standard_normal(len(mesh.cells))) * turn


def tensor(mesh: Mesh, turn: complex) -> NDArray[Any]:
    rng, d = np.random.default_rng(1), mesh.points.shape[1]
    root = rng.standard_normal((len(mesh.cells), d, d))
    skew = 0 if turn == 1 else 0.3j * (root + root.swapaxes(1, 2))
    return root @ root.swapaxes(1, 2) + 0.5 * np.eye(d) + skew


def central(voltages: Callable[[float], NDArray[Any]], step: float) -> NDArray[Any]:
    """Derivative at 0, to the fourth power of the step."""
    near, far = (voltages(h) - voltages(-h) for h in (step, 2 * step))
    return (8 * near - far) / (12 * step)


def random(shape: tuple[int, ...], *, like: NDArray[Any]) -> NDArray[Any]:
    rng = np.random.default_rng(2)
    direction = rng.standard_normal(shape)
    return direction + 1j * rng.standard_normal(shape) if np.iscomplexobj(like) else direction


def test_conductivity(mesh: Mesh, order: int, turn: complex) -> None:
    forward, sigma = model(mesh, order=order, turn=turn), scalar(mesh, turn)
    direction = sigma * random(sigma.shape, like=sigma)
    expected = central(lambda h: forward.solve(sigma + h * direction).voltages, 1e-3)
    assert mismatch(forward.jacobian(sigma) @ direction, expected) < 1e-8


def test_conductivity_cell_by_cell(mesh: Mesh, order: int) -> None:
    forward, sigma = model(mesh, order=order), scalar(mesh, 1.0)
    jacobian = forward.jacobian(sigma)
    for cell in np.random.default_rng(3).choice(len(sigma), 4, replace=False):
        unit = np.arange(len(sigma)) == cell
        expected = central(lambda h, u=unit: forward.solve(sigma * (1 + h * u)).voltages, 1e-2)
        assert mismatch(jacobian[:, cell] * sigma[cell], expected) < 1e-6


def test_tensor_conductivity(mesh: Mesh, order: int, turn: complex) -> None:
    forward, sigma = model(mesh, order=order, turn=turn), tensor(mesh, turn)
    skewed = random(sigma.shape, like=sigma)
    direction = skewed + skewed.swapaxes(1, 2)
    expected = central(lambda h: forward.solve(sigma + h * direction).voltages, 1e-4)
    got = np.einsum("mnab,nab->m", forward.jacobian(sigma), direction)
    assert mismatch(got, expected) < 1e-7


def test_each_component_of_a_tensor(mesh: Mesh) -> None:
    forward, sigma = model(mesh), tensor(mesh, 1.0)
    jacobian, d = forward.jacobian(sigma), mesh.points.shape[1]
    assert np.array_equal(jacobian, jacobian.swapaxes(2, 3))
    cell = len(sigma) // 2
    for a in range(d):
        for b in range(a, d):
            change = np.zeros_like(sigma)
            change[cell, [a, b], [b, a]] = 1.0
            step = 1e-2 * np.linalg.eigvalsh(sigma[cell])[0]
            expected = central(lambda h, c=change: forward.solve(sigma + h * c).voltages, step)
            got = jacobian[:, cell, a, b] * (1 if a == b else 2)
            # a component that turns the field out of a curved sheet has no effect
            scale = max(np.abs(expected).max(), 1e-3 * np.abs(jacobian[:, cell]).max())
            assert np.abs(got - expected).max() < 1e-6 * scale


def test_the_trace_of_the_tensor_derivative_is_the_scalar_one(mesh: Mesh, order: int) -> None:
    forward, sigma = model(mesh, order=order), scalar(mesh, 1.0)
    d = mesh.points.shape[1]
    by_tensor = forward.jacobian(sigma[:, None, None] * np.eye(d))
    assert mismatch(np.trace(by_tensor, axis1=2, axis2=3), forward.jacobian(sigma)) < 1e-11


@pytest.mark.parametrize("kind", [scalar, tensor])
def test_contact_impedance(mesh: Mesh, order: int, turn: complex, kind: Any) -> None:
    forward, sigma = model(mesh, order=order, turn=turn), kind(mesh, turn)
    z = forward.contact_impedance
    jacobian = forward.at(sigma).contact_jacobian
    assert jacobian.shape == (forward.pattern.n_meas, len(z))
    for electrode in range(len(z)):
        unit = z[electrode] * (np.arange(len(z)) == electrode)

        def voltages(h: float, unit: NDArray[Any] = unit) -> NDArray[Any]:
            return model(mesh, order=order, impedance=z + h * unit).solve(sigma).voltages

        expected = central(voltages, 1e-2)
        assert mismatch(jacobian[:, electrode] * z[electrode], expected) < 1e-6


def shifted(mesh: Mesh, electrode: int, axis: int, by: float) -> Mesh:
    points = mesh.points.copy()
    points[np.unique(mesh.electrodes[electrode]), axis] += by
    return Mesh(points, mesh.cells, mesh.electrodes)


def check_movement(mesh: Mesh, turn: complex, electrodes: IntArray) -> None:
    sigma, z = scalar(mesh, turn), model(mesh, turn=turn).contact_impedance
    jacobian = model(mesh, impedance=z).at(sigma).movement_jacobian
    assert jacobian.shape[1:] == (len(mesh.electrodes), mesh.points.shape[1])
    for electrode, axis in np.ndindex(len(electrodes), mesh.points.shape[1]):
        number = int(electrodes[electrode])

        def voltages(h: float, number: int = number, axis: int = axis) -> NDArray[Any]:
            moved = shifted(mesh, number, axis, h)
            return model(moved, impedance=z).solve(sigma).voltages

        expected = central(voltages, 2e-5)
        scale = max(np.abs(expected).max(), 1e-3 * np.abs(jacobian).max())
        assert np.abs(jacobian[:, number, axis] - expected).max() < 1e-6 * scale


def test_movement_of_an_electrode(mesh: Mesh, turn: complex) -> None:
    check_movement(mesh, turn, np.arange(3))


def test_movement_stretches_an_electrode_that_shares_a_point() -> None:
    """Where two electrodes touch, moving one changes the size of the other."""
    bar = strip(np.linspace(0, 0.2, 9), np.linspace(0, 0.05, 4))
    low, high = [
        [lambda p, a=a, y=y: (p[:, 1] == y) & (np.abs(p[:, 0] - a) < 0.05) for a in (0.05, 0.15)]
        for y in (0, 0.05)
    ]
    check_movement(patched(bar, *low, *high), 1.0, np.arange(3))


@pytest.mark.parametrize(("order", "kind"), [(2, scalar), (1, tensor)])
def test_movement_is_refused_where_it_is_not_known(order: int, kind: Any) -> None:
    mesh = disc()
    with pytest.raises(ModelError, match="order 1 and a scalar"):
        _ = model(mesh, order=order).at(kind(mesh, 1.0)).movement_jacobian


# Power.


def driven_voltages(state: State) -> NDArray[Any]:
    """(n_drive,) V between source and sink of each drive."""
    drives, rows = state.model.pattern.drives, np.arange(state.model.pattern.n_drive)
    potentials = state.electrode_potentials
    return np.asarray(potentials[rows, drives[:, 0]] - potentials[rows, drives[:, 1]])


def contact_power(state: State) -> NDArray[Any]:
    """(n_drive,) W in all contacts: Re(1/z) ∫ |u − U|², u linear on each facet."""
    mesh, solution, total = state.model.mesh, state, 0.0
    for e, facets in enumerate(mesh.electrodes):
        drop = solution.potentials[:, facets] - solution.electrode_potentials[:, e, None, None]
        k = facets.shape[1]
        square = (np.abs(drop) ** 2).sum(axis=2) + np.abs(drop.sum(axis=2)) ** 2
        size = simplex_measure(mesh.points, facets)
        total = total + (1 / state.model.contact_impedance[e]).real * square @ size / (k * (k + 1))
    return np.asarray(total)


@pytest.mark.parametrize("kind", [scalar, tensor])
def test_power_in_cells_and_contacts_is_what_the_source_gives(
    mesh: Mesh, turn: complex, kind: Any
) -> None:
    forward = model(mesh, turn=turn)
    state = forward.at(kind(mesh, turn))
    given = (forward.current * driven_voltages(state)).real
    assert state.power.shape == (forward.pattern.n_drive, len(mesh.cells))
    assert (state.power > 0).all()
    assert mismatch(state.power.sum(axis=1) + contact_power(state), given) < 1e-10


@pytest.mark.parametrize("kind", [scalar, tensor])
def test_power_of_quadratic_elements(mesh: Mesh, kind: Any) -> None:
    """The contacts' share follows from the derivative: R is homogeneous, P = −I σ·∂V/∂σ."""
    drives = [[0, 1], [1, 2], [0, 2]]
    pattern = Pattern.from_tables(drives, drives, len(mesh.electrodes))
    state = ForwardModel(mesh, pattern, 0.01, 0.3, order=2).at(kind(mesh, 1.0))
    in_contacts = 0.3 * state.contact_jacobian.sum(axis=1) * 0.01
    given = 0.3 * state.voltages
    assert mismatch(state.power.sum(axis=1) + in_contacts, given) < 1e-10
