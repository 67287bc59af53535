"""Priors and one-step reconstructions of EIDORS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from golden import SHARED, Golden, mismatch
from tomoskin.core import FloatArray
from tomoskin.imaging import OneStep
from tomoskin.model.prior import penalty_of
from tomoskin.sensing.signal import difference

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def golden(data_dir: Path) -> Golden:
    return Golden.load(data_dir / SHARED)


def images(operator: OneStep, golden: Golden) -> FloatArray:
    """(n_cells, 3) images of the file's three data sets."""
    reference = golden.fields["vh"].ravel()
    changes = difference(golden.fields["vi"].T, reference, operator.difference)
    return np.column_stack([operator(dv).values for dv in changes])


def test_noser_matrix(golden: Golden) -> None:
    noser = penalty_of("noser", golden.mesh, golden.model().jacobian(1.0)).matrix
    assert mismatch(noser, golden.fields["RtR_noser_diag"].ravel()) < 1e-10


def test_laplace_matrix(golden: Golden) -> None:
    laplace = penalty_of("laplace", golden.mesh, np.empty((0, 0))).matrix
    assert np.array_equal(laplace, golden.matrix("RtR_laplace_ijv"))


@pytest.mark.parametrize(
    ("prior", "name"), [("identity", "tikhonov"), ("noser", "noser"), ("laplace", "laplace")]
)
def test_reconstruction(golden: Golden, prior: str, name: str) -> None:
    alpha = golden.hyperparameter(f"prior_{name}")
    operator = OneStep(golden.model(), prior, alpha=alpha)
    assert mismatch(images(operator, golden), golden.fields[f"x_{name}"]) < 1e-9


def test_reconstruction_with_a_prior_of_the_users_own(golden: Golden) -> None:
    prior = golden.matrix("RtR_gaussian_HPF_triu_ijv")
    alpha = golden.hyperparameter("prior_gaussian_HPF")
    operator = OneStep(golden.model(), prior, alpha=alpha)
    assert mismatch(images(operator, golden), golden.fields["x_gaussian_HPF"]) < 1e-9


def test_normalised_reconstruction(golden: Golden) -> None:
    alpha = float(golden.fields["hp_noser_normalized"].item())
    operator = OneStep(golden.model(), "noser", alpha=alpha, difference="normalised")
    assert mismatch(images(operator, golden), golden.fields["x_noser_normalized"]) < 1e-9


def test_reference_is_the_homogeneous_data(golden: Golden) -> None:
    operator = OneStep(golden.model(), alpha=0.1)
    assert mismatch(operator.reference, golden.fields["vh"].ravel()) < 1e-10


def test_gaussian_prior_resembles_the_rastered_one(golden: Golden) -> None:
    """EIDORS samples its filter on a raster, so only the picture can agree, not the matrix."""
    alpha = golden.hyperparameter("prior_gaussian_HPF")
    picture = images(OneStep(golden.model(), "gaussian", alpha=alpha), golden)[:, 0]
    expected = golden.fields["x_gaussian_HPF"][:, 0]
    assert np.corrcoef(picture, expected)[0, 1] > 0.95
    assert np.std(picture) == pytest.approx(np.std(expected), rel=0.2)
