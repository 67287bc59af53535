"""The priors' defining properties, on a plane and in a volume."""

from __future__ import annotations

import numpy as np
import pytest

from shapes import box, disc
from tomoskin.core import FloatArray
from tomoskin.inverse import PRIORS, prior_matrix
from tomoskin.mesh import Mesh


@pytest.fixture(scope="module", params=["plane", "volume"])
def mesh(request: pytest.FixtureRequest) -> Mesh:
    if request.param == "plane":
        return disc(8)
    return box(np.linspace(0, 1, 5), np.linspace(0, 1, 3), np.linspace(0, 2, 4))


def jacobian(mesh: Mesh) -> FloatArray:
    return np.random.default_rng(0).standard_normal((12, len(mesh.cells)))


@pytest.mark.parametrize("name", PRIORS)
def test_symmetric_and_not_negative(mesh: Mesh, name: str) -> None:
    q = prior_matrix(name, mesh, jacobian(mesh))
    full = np.diag(q) if q.ndim == 1 else q
    assert full.shape == (len(mesh.cells),) * 2
    assert np.abs(full - full.T).max() < 1e-12
    assert np.linalg.eigvalsh(full)[0] > -1e-10


@pytest.mark.parametrize("name", ["laplace", "gaussian"])
def test_smoothness_priors_do_not_punish_a_constant(mesh: Mesh, name: str) -> None:
    q = prior_matrix(name, mesh, jacobian(mesh))
    assert np.abs(q @ np.ones(len(q))).max() < 1e-10
    smooth, rough = mesh.centroids[:, 0], np.random.default_rng(1).permutation(mesh.centroids[:, 0])
    assert smooth @ q @ smooth < 0.7 * (rough @ q @ rough)


def test_laplace_is_twice_the_sum_over_shared_facets(mesh: Mesh) -> None:
    x = np.random.default_rng(2).standard_normal(len(mesh.cells))
    first, second = mesh.neighbours.T
    expected = 2.0 * ((x[first] - x[second]) ** 2).sum()
    assert x @ prior_matrix("laplace", mesh, jacobian(mesh)) @ x == pytest.approx(expected)


def test_noser_is_the_root_of_the_sensitivity(mesh: Mesh) -> None:
    j = jacobian(mesh)
    got = prior_matrix("noser", mesh, j)
    assert got == pytest.approx(np.sqrt(np.diag(j.T @ j)))
    assert prior_matrix("noser", mesh, 9 * j) == pytest.approx(9 * got)


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
    got = x @ prior_matrix("gaussian", uneven, jacobian(uneven)) @ x
    assert got == pytest.approx(left_over @ left_over, rel=1e-10)


def test_gaussian_does_not_depend_on_size(mesh: Mesh) -> None:
    large = Mesh(1e3 * mesh.points, mesh.cells, mesh.electrodes)
    got = prior_matrix("gaussian", large, jacobian(mesh))
    assert got == pytest.approx(prior_matrix("gaussian", mesh, jacobian(mesh)), abs=1e-12)
