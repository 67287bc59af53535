"""Tensor conductivity: what a change of shape or of axes must leave as it is, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from golden import mismatch
from shapes import box, disc, folded, mapped, patched, strip
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, simplex_measure
from tomoskin.model.pattern import Pattern

Z = np.array([0.001, 0.003, 0.01, 0.02])


def flat() -> Mesh:
    return strip(np.linspace(0, 0.2, 13), np.linspace(0, 0.06, 5))


def curved() -> Mesh:
    return folded(flat(), np.linspace(0, 0.2, 13)[3:-1:3], 0.4)


def volume() -> Mesh:
    bar = box(np.linspace(0, 0.2, 6), np.linspace(0, 0.06, 4), np.linspace(0, 0.04, 4))
    return patched(
        bar,
        lambda p: p[:, 0] == 0,
        lambda p: p[:, 0] == 0.2,
        lambda p: (p[:, 2] == 0.04) & (p[:, 0] < 0.1),
        lambda p: (p[:, 1] == 0.06) & (p[:, 0] > 0.1),
    )


MESHES: dict[str, Callable[[], Mesh]] = {"flat": flat, "curved": curved, "volume": volume}


@pytest.fixture(scope="module", params=MESHES)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]()


@pytest.fixture(params=[1, 2], ids=["linear", "quadratic"])
def order(request: pytest.FixtureRequest) -> int:
    return request.param


def voltages(mesh: Mesh, sigma: NDArray[Any], order: int, z: NDArray[Any] = Z) -> NDArray[Any]:
    pattern = Pattern.all_pairs(len(z), include_driven=True)
    return ForwardModel(mesh, pattern, z, order=order).solve(sigma).voltages


def tensors(mesh: Mesh, *, d: int | None = None) -> FloatArray:
    rng, d = np.random.default_rng(1), d or mesh.points.shape[1]
    root = rng.standard_normal((len(mesh.cells), d, d))
    return np.asarray(root @ root.swapaxes(1, 2) + 0.3 * np.eye(d))


def carried(mesh: Mesh, moved: Mesh, sigma: NDArray[Any]) -> NDArray[Any]:
    """FσFᵀ/det F of each cell, F the map that takes its edges to those of the moved cell."""
    before, after = (m.points[m.cells][:, 1:] - m.points[m.cells][:, :1] for m in (mesh, moved))
    gradient = (np.linalg.pinv(before) @ after).swapaxes(1, 2)
    turned = gradient @ sigma @ gradient.swapaxes(1, 2)
    return np.asarray(turned * (mesh.volumes / moved.volumes)[:, None, None])


@pytest.mark.parametrize("turn", [1.0, 1 + 0.5j])
def test_a_multiple_of_the_identity_is_a_scalar(mesh: Mesh, order: int, turn: complex) -> None:
    sigma = np.exp(np.random.default_rng(0).standard_normal(len(mesh.cells))) * turn
    tensor = sigma[:, None, None] * np.eye(mesh.points.shape[1])
    model = ForwardModel(mesh, Pattern.all_pairs(4, include_driven=True), Z, order=order)
    got, expected = model.at(tensor), model.at(sigma)
    assert mismatch(got.voltages, expected.voltages) < 1e-11
    assert mismatch(got.potentials, expected.potentials) < 1e-11
    assert mismatch(got.power, expected.power) < 1e-11
    assert mismatch(got.contact_jacobian, expected.contact_jacobian) < 1e-11


@pytest.mark.parametrize("sheared", [False, True])
def test_a_stretched_body(mesh: Mesh, order: int, *, sheared: bool) -> None:
    """x → Fx with σ → FσFᵀ/det F; z grows as the electrodes do, straight or plane as they are."""
    stretch = np.diag([1.7, 0.6, 1.2][: mesh.points.shape[1]])
    if sheared:
        stretch = stretch + np.random.default_rng(2).uniform(-0.3, 0.3, stretch.shape)
    if mesh.points.shape[1] > mesh.dimension:
        stretch[[0, 2], :] = 0.0
        stretch[0, 0] = stretch[2, 2] = 1.3  # folds turn the sides: all in this plane alike
        stretch[1] = 0.0
        stretch[1, 1] = 0.6
    moved = mapped(mesh, lambda p: p @ stretch.T)
    sizes = [[simplex_measure(m.points, e).sum() for e in m.electrodes] for m in (mesh, moved)]
    sigma = tensors(mesh)
    got = voltages(moved, carried(mesh, moved, sigma), order, Z * np.divide(*sizes[::-1]))
    assert mismatch(got, voltages(mesh, sigma, order)) < 1e-10


def test_cells_of_another_shape(mesh: Mesh, order: int) -> None:
    """Points off the electrodes moved at random, in space too: each cell has its own F."""
    rng, free = np.random.default_rng(3), np.ones(len(mesh.points), dtype=bool)
    free[np.concatenate([e.ravel() for e in mesh.electrodes])] = False
    points = mesh.points.copy()
    points[free] += rng.uniform(-1, 1, points[free].shape) * 0.002
    moved, sigma = Mesh(points, mesh.cells, mesh.electrodes), tensors(mesh)
    got = voltages(moved, carried(mesh, moved, sigma), order)
    assert mismatch(got, voltages(mesh, sigma, order)) < 1e-10


def test_turned_axes(mesh: Mesh, order: int) -> None:
    d = mesh.points.shape[1]
    turn, _ = np.linalg.qr(np.random.default_rng(4).standard_normal((d, d)))
    sigma = tensors(mesh)
    got = voltages(mapped(mesh, lambda p: p @ turn.T), turn @ sigma @ turn.T, order)
    assert mismatch(got, voltages(mesh, sigma, order)) < 1e-10


def test_a_folded_fabric_equals_the_flat_one(order: int) -> None:
    """Conductivities along and across the threads; none through the sheet."""
    plane, bent = flat(), curved()
    sigma = tensors(plane)
    assert (
        mismatch(voltages(bent, carried(plane, bent, sigma), order), voltages(plane, sigma, order))
        < 1e-10
    )


def test_nothing_flows_out_of_a_sheet(order: int) -> None:
    mesh = curved()
    corner = mesh.points[mesh.cells]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    sigma = tensors(mesh)
    through = sigma + 50.0 * normal[:, :, None] * normal[:, None, :]
    assert mismatch(voltages(mesh, through, order), voltages(mesh, sigma, order)) < 1e-11


def test_a_bar_of_slanted_fibres() -> None:
    """Thin and insulated: what counts is 1/(σ⁻¹)ₓₓ, as no current can leave the axis."""
    x, y = np.linspace(0, 1.0, 201), np.linspace(0, 0.01, 3)
    bar = patched(strip(x, y), lambda p: p[:, 0] == 0, lambda p: p[:, 0] == 1.0)
    sigma = np.array([[2.0, 0.9], [0.9, 1.0]])
    pattern = Pattern.from_tables([[0, 1]], [[0, 1]])
    field = ForwardModel(bar, pattern, 1e-3, order=2)
    measured = field.solve(np.broadcast_to(sigma, (len(bar.cells), 2, 2))).voltages[0]
    resistivity = np.linalg.inv(sigma)[0, 0]
    assert measured == pytest.approx(resistivity * 1.0 / 0.01 + 2e-3 / 0.01, rel=1e-2)


# Refusals.


def test_each_cells_matrix_is_that_of_all_components(mesh: Mesh, order: int) -> None:
    sigma, model = tensors(mesh), ForwardModel(mesh, Pattern.adjacent(4), Z, order=order)
    assembly, g = model.assembly, model.assembly.element.gradients
    values = np.array(model.contacts)
    np.add.at(values, assembly.position, np.einsum("nqia,nab,nqjb->nij", g, sigma, g))
    assert mismatch(assembly.matrix(sigma, model.contacts).values, values) < 1e-14


def with_cell(mesh: Mesh, tensor: Any, cell: int = 7) -> NDArray[Any]:
    d = mesh.points.shape[1]
    sigma = np.broadcast_to(np.eye(d), (len(mesh.cells), d, d)).astype(np.asarray(tensor).dtype)
    sigma[cell] = tensor
    return sigma


@pytest.mark.parametrize(
    ("tensor", "message"),
    [
        ([[1.0, 0.5], [0.4, 1.0]], "symmetric"),
        ([[1.0, 0.5j], [-0.5j, 1.0]], "symmetric"),
        ([[1.0, 1.0], [1.0, 1.0]], "positive definite"),
        ([[1.0, 2.0], [2.0, 1.0]], "positive definite"),
        ([[-1.0, 0.0], [0.0, 1.0]], "positive definite"),
        ([[1.0j, 0.0], [0.0, 1.0j]], "positive definite"),
        ([[0.0, 0.0], [0.0, 0.0]], "positive definite"),
        ([[np.nan, 0.0], [0.0, 1.0]], "finite"),
        ([[np.inf, 0.0], [0.0, 1.0]], "finite"),
    ],
)
def test_impossible_tensors_name_the_cell(tensor: Any, message: str) -> None:
    mesh = disc()
    with pytest.raises(ModelError, match=message) as caught:
        ForwardModel(mesh, Pattern.adjacent(8), 0.01).solve(with_cell(mesh, tensor))
    assert caught.value.where == "cell 7"


def test_a_sheet_needs_a_tensor_that_is_positive_in_it() -> None:
    mesh = curved()
    with pytest.raises(ModelError, match="positive definite") as caught:
        voltages(mesh, with_cell(mesh, np.diag([0.0, 0.0, 1.0])), 1)
    assert caught.value.where == "cell 7"


@pytest.mark.parametrize("shape", [(2, 2), (1, 2, 2), (220, 2), (220, 3, 3)])
def test_tensors_of_another_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(ModelError, match="expected conductivity of shape"):
        ForwardModel(disc(), Pattern.adjacent(8), 0.01).solve(np.ones(shape))
