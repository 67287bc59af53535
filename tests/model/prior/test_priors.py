"""The priors' defining properties, on a plane and in a volume."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.special import gamma, kv

from golden import mismatch
from shapes import box, disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior import (
    PRIORS,
    Laplace,
    Matern,
    Noser,
    Structural,
    penalty_of,
)
from tomoskin.model.prior.priors import Prior
from tomoskin.model.skin import Skin


@pytest.fixture(scope="module", params=["plane", "volume"])
def mesh(request: pytest.FixtureRequest) -> Mesh:
    if request.param == "plane":
        return disc(8)
    return box(np.linspace(0, 1, 5), np.linspace(0, 1, 3), np.linspace(0, 2, 4))


def jacobian(mesh: Mesh) -> FloatArray:
    return np.random.default_rng(0).standard_normal((12, len(mesh.cells)))


@pytest.mark.parametrize("name", PRIORS)
def test_symmetric_and_not_negative(mesh: Mesh, name: str) -> None:
    q = penalty_of(name, mesh, jacobian(mesh)).matrix
    full = np.diag(q) if q.ndim == 1 else q
    assert full.shape == (len(mesh.cells),) * 2
    assert np.abs(full - full.T).max() < 1e-12
    assert np.linalg.eigvalsh(full)[0] > -1e-10


@pytest.mark.parametrize("name", ["laplace", "gaussian"])
def test_smoothness_priors_do_not_punish_a_constant(mesh: Mesh, name: str) -> None:
    q = penalty_of(name, mesh, jacobian(mesh)).matrix
    assert np.abs(q @ np.ones(len(q))).max() < 1e-10
    smooth, rough = mesh.centroids[:, 0], np.random.default_rng(1).permutation(mesh.centroids[:, 0])
    assert smooth @ q @ smooth < 0.7 * (rough @ q @ rough)


def test_laplace_is_twice_the_sum_over_shared_facets(mesh: Mesh) -> None:
    x = np.random.default_rng(2).standard_normal(len(mesh.cells))
    first, second = mesh.neighbours.T
    expected = 2.0 * ((x[first] - x[second]) ** 2).sum()
    assert x @ penalty_of("laplace", mesh, jacobian(mesh)).matrix @ x == pytest.approx(expected)


def test_noser_is_the_root_of_the_sensitivity(mesh: Mesh) -> None:
    j = jacobian(mesh)
    got = penalty_of("noser", mesh, j).matrix
    assert got == pytest.approx(np.sqrt(np.diag(j.T @ j)))
    assert penalty_of("noser", mesh, 9 * j).matrix == pytest.approx(9 * got)


def test_gaussian_is_what_an_area_weighted_average_leaves_over(mesh: Mesh) -> None:
    """Half the weight at half the width, which is a tenth of the largest extent."""
    rng = np.random.default_rng(3)
    points = mesh.points * rng.uniform(0.98, 1.02, mesh.points.shape)
    uneven = Mesh(points, mesh.cells, mesh.electrodes)
    width = 0.1 * np.ptp(points, axis=0).max()
    gap = np.linalg.norm(uneven.centroids[:, None] - uneven.centroids[None], axis=2)
    weights = uneven.volumes * 0.5 ** ((2 * gap / width) ** 2)
    x = rng.standard_normal(len(uneven.cells))
    left_over = x - weights @ x / weights.sum(axis=1)
    got = x @ penalty_of("gaussian", uneven, jacobian(uneven)).matrix @ x
    assert got == pytest.approx(left_over @ left_over, rel=1e-10)


def test_gaussian_does_not_depend_on_size(mesh: Mesh) -> None:
    large = Mesh(1e3 * mesh.points, mesh.cells, mesh.electrodes)
    got = penalty_of("gaussian", large, jacobian(mesh)).matrix
    assert got == pytest.approx(penalty_of("gaussian", mesh, jacobian(mesh)).matrix, abs=1e-12)


@pytest.mark.parametrize("exponent", [0.0, 0.3, 1.0])
def test_noser_with_any_exponent(mesh: Mesh, exponent: float) -> None:
    j = jacobian(mesh)
    expected = np.linalg.norm(j, axis=0) ** (2.0 * exponent)
    assert penalty_of(Noser(exponent), mesh, j).matrix == pytest.approx(expected)


def test_a_structural_prior_is_laplace_within_its_regions(mesh: Mesh) -> None:
    labels = (mesh.centroids[:, 0] > mesh.centroids[:, 0].mean()).astype(int)
    first, second = mesh.neighbours.T
    weight = np.where(labels[first] == labels[second], 2.0, 2.0 * 0.05)
    x = np.random.default_rng(4).standard_normal(len(labels))
    got = x @ penalty_of(Structural(labels, 0.05), mesh, jacobian(mesh)).matrix @ x
    assert got == pytest.approx((weight * (x[first] - x[second]) ** 2).sum())


def test_a_coupling_of_one_is_laplace(mesh: Mesh) -> None:
    labels = np.arange(len(mesh.cells)) % 3
    j = jacobian(mesh)
    got = penalty_of(Structural(labels, coupling=1.0), mesh, j).matrix
    assert np.array_equal(got, penalty_of(Laplace(), mesh, j).matrix)


def test_regions_that_are_cut_apart_have_a_constant_each(mesh: Mesh) -> None:
    labels = (mesh.centroids[:, 0] > mesh.centroids[:, 0].mean()).astype(int)
    penalty = Structural(labels, coupling=0.0).penalty(mesh, jacobian(mesh))
    assert penalty.free.shape[1] == 2
    assert penalty.free.T @ penalty.free == pytest.approx(np.eye(2))
    assert np.abs(penalty.matrix @ penalty.free).max() < 1e-12
    for free in penalty.free.T:
        assert np.ptp(free[labels == 0]) == np.ptp(free[labels == 1]) == 0.0


@pytest.mark.parametrize(
    ("labels", "coupling", "message"),
    [
        (np.zeros(3, int), 0.1, "labels .*: expected one whole number for each of"),
        (None, 0.1, "labels .*: expected one whole number for each of"),
        (0.5, 0.1, "labels .*: expected one whole number for each of .* got float64"),
        (1, -0.1, "coupling .*: expected 0, or from 1e-06 to 1, got -0.1"),
        (1, 1.1, "coupling .*: expected 0, or from 1e-06 to 1, got 1.1"),
        (1, 1e-9, "coupling .*: expected 0, or from 1e-06 to 1"),
        (1, np.nan, "coupling .*: expected 0, or from 1e-06 to 1, got nan"),
    ],
)
def test_structural_priors_that_are_refused(labels: Any, coupling: float, message: str) -> None:
    plane = disc(8)
    given = np.full(len(plane.cells), labels) if np.isscalar(labels) else labels
    with pytest.raises(ModelError, match=message):
        Structural(given, coupling).penalty(plane, jacobian(plane))


@pytest.mark.parametrize("smoothness", [0.5, 1.5, 2.5])
def test_matern_is_the_covariance_of_the_book(mesh: Mesh, smoothness: float) -> None:
    """Rasmussen & Williams 2006, equation 4.14, from Bessel functions."""
    length = 0.3 * np.ptp(mesh.points[:, 0])
    gap = np.linalg.norm(mesh.centroids[:, None] - mesh.centroids[None], axis=2)
    s = np.sqrt(2 * smoothness) * np.where(gap, gap, 1.0) / length
    bessel = 2 ** (1 - smoothness) / gamma(smoothness) * s**smoothness * kv(smoothness, s)
    covariance = np.where(gap, bessel, 1.0)
    j = jacobian(mesh)
    spread, gram = Matern(length, smoothness).penalty(mesh, j).carry(j)
    assert mismatch(spread, covariance @ j.T) < 1e-12
    assert mismatch(gram, j @ covariance @ j.T) < 1e-12


def test_a_covariance_and_its_inverse_are_the_same_prior(mesh: Mesh) -> None:
    j = jacobian(mesh)
    prior = Matern(0.2 * np.ptp(mesh.points[:, 0]), 0.5)
    precision = penalty_of(prior, mesh, j).matrix
    spread, _ = prior.penalty(mesh, j).carry(j)
    assert mismatch(precision @ spread, j.T) < 1e-9


def test_a_tenth_of_the_extent_is_the_correlation_length_unless_given(mesh: Mesh) -> None:
    j = jacobian(mesh)
    given = Matern(0.1 * np.ptp(mesh.points, axis=0).max())
    assert np.array_equal(penalty_of(Matern(), mesh, j).matrix, penalty_of(given, mesh, j).matrix)


def test_distances_on_a_curved_sheet_are_taken_in_space() -> None:
    plane = disc(8)
    angle = plane.points[:, 0] / 0.05
    rolled = np.column_stack([0.05 * np.sin(angle), plane.points[:, 1], 0.05 * np.cos(angle)])
    curved = Mesh(rolled, plane.cells, plane.electrodes)
    gap = np.linalg.norm(curved.centroids[:, None] - curved.centroids[None], axis=2)
    j = jacobian(curved)
    spread, _ = Matern(0.03, 0.5).penalty(curved, j).carry(j)
    assert mismatch(spread, np.exp(-gap / 0.03) @ j.T) < 1e-12


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_an_impossible_correlation_length(length: float) -> None:
    plane = disc(8)
    with pytest.raises(ModelError, match=f"expected a correlation length above 0 m, got {length}"):
        Matern(length).penalty(plane, jacobian(plane))


def test_a_smoothness_that_is_not_known() -> None:
    plane = disc(8)
    with pytest.raises(ModelError, match=r"expected a smoothness among 0.5, 1.5, 2.5, got 1.0"):
        Matern(0.1, smoothness=1.0).penalty(plane, jacobian(plane))


@pytest.mark.parametrize(
    ("keys", "prior"),
    [
        ({"exponent": 1.0}, Noser(1.0)),
        ({"prior": "exponential", "correlation_length": "20 mm"}, Matern(0.02, 0.5)),
        ({"prior": "matern"}, Matern(None, 1.5)),
        ({"prior": "laplace", "exponent": 1.0}, Laplace()),
    ],
)
def test_a_prior_takes_what_the_skin_file_says(keys: dict[str, Any], prior: Prior) -> None:
    skin = Skin.load("textile-disc-8").altered({"inverse": keys})
    assert skin.inverse.record("prior") == prior


def test_a_prior_that_is_not_known(mesh: Mesh) -> None:
    with pytest.raises(ModelError, match=r'expected a prior among .*, got "tv"'):
        penalty_of("tv", mesh, jacobian(mesh))


@pytest.mark.parametrize("make", [np.asarray, csr_array])
def test_a_matrix_of_ones_own_is_symmetric(mesh: Mesh, make: Callable[[FloatArray], Any]) -> None:
    matrix = np.eye(len(mesh.cells))
    penalty_of(make(matrix), mesh, np.empty((0, 0)))
    matrix[3, 7] = 0.25
    with pytest.raises(ModelError, match=r"differ by -?0\.25") as caught:
        penalty_of(make(matrix), mesh, np.empty((0, 0)))
    assert caught.value.where == "prior, cells 3 and 7"
