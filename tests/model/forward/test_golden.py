"""Voltages, potentials and Jacobians of EIDORS, to rounding."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from golden import SHARED, Golden, mismatch
from tomoskin.model.pattern import Pattern

pytestmark = pytest.mark.data
CASES = list(product(range(3), range(3)))


@pytest.fixture(scope="module")
def golden(data_dir: Path) -> Golden:
    return Golden.load(data_dir / SHARED)


def test_pattern_is_adjacent_in_the_same_order_and_sign(golden: Golden) -> None:
    adjacent = Pattern.adjacent(golden.pattern.n_electrodes)
    assert np.array_equal(adjacent.drives, golden.pattern.drives)
    assert np.array_equal(adjacent.drive, golden.pattern.drive)
    assert np.array_equal(adjacent.measure, golden.pattern.measure)
    assert adjacent.identity == golden.pattern.identity


def test_areas(golden: Golden) -> None:
    assert mismatch(golden.mesh.volumes, golden.fields["elem_volume"].ravel()) < 1e-13


@pytest.mark.parametrize(("sigma", "z"), CASES)
def test_voltages(golden: Golden, sigma: int, z: int) -> None:
    solution = golden.model(z).solve(golden.sigma[sigma])
    assert mismatch(solution.voltages, golden.fields["V"][:, sigma, z]) < 1e-10
    assert solution.residual < 1e-10


@pytest.mark.parametrize(("sigma", "z"), CASES)
def test_jacobian_times_random_vectors(golden: Golden, sigma: int, z: int) -> None:
    jacobian = golden.model(z).jacobian(golden.sigma[sigma])
    expected = golden.fields["JP"][:, :, sigma, z]
    assert mismatch(jacobian @ golden.fields["P"], expected) < 1e-10


@pytest.mark.parametrize(
    ("name", "sigma", "z"), [("J_hom_z1", 0, 0), ("J_logn_z1", 1, 0), ("J_logn_z3", 1, 2)]
)
def test_full_jacobian(golden: Golden, name: str, sigma: int, z: int) -> None:
    jacobian = golden.model(z).jacobian(golden.sigma[sigma])
    assert mismatch(jacobian, golden.fields[name]) < 1e-10


@pytest.mark.parametrize(("name", "sigma"), [("node_volt_hom", 0), ("node_volt_logn", 1)])
def test_potentials_up_to_the_free_constant(golden: Golden, name: str, sigma: int) -> None:
    solution = golden.model().solve(golden.sigma[sigma])
    expected = golden.fields[name].T
    electrodes = golden.pattern.n_electrodes
    expected = expected - expected[:, -electrodes:].mean(axis=1, keepdims=True)
    assert mismatch(solution.potentials, expected[:, :-electrodes]) < 1e-10
    assert mismatch(solution.electrode_potentials, expected[:, -electrodes:]) < 1e-10
