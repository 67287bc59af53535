"""The spectrum: every alpha of a problem, the same as if the operator had been made for it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from golden import mismatch
from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging import LinearProblem, Spectrum
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import PRIORS, penalty_of

ALPHAS = [1e-3, 0.03, 1.0, 30.0]


@cache
def model() -> ForwardModel:
    return ForwardModel(disc(8), Pattern.adjacent(8), np.geomspace(0.005, 0.02, 8), current=0.1)


def problem(prior: Any = "noser", **settings: Any) -> LinearProblem:
    return LinearProblem.of(model(), prior, **settings)


@pytest.fixture(scope="module", params=PRIORS)
def spectrum(request: pytest.FixtureRequest) -> Spectrum:
    return Spectrum.of(problem(request.param))


def data(n: int = 3) -> FloatArray:
    return np.random.default_rng(1).normal(0.0, 1e-4, (n, 40))


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("kind", ["plain", "normalised"])
@pytest.mark.parametrize("alpha", ALPHAS)
def test_operator_is_the_problems_own(prior: str, kind: str, alpha: float) -> None:
    p = problem(prior, difference=kind)
    got, expected = Spectrum.of(p).operator(alpha), p.operator(alpha)
    assert mismatch(got.matrix, expected.matrix) < 1e-9
    assert mismatch(got.precision, expected.precision) < 1e-9
    assert (got.unit, got.difference) == (expected.unit, expected.difference)
    assert np.array_equal(got.reference, expected.reference)


@pytest.mark.parametrize("form", ["matrix", "weights"])
def test_operator_with_a_prior_and_weights_of_the_users_own(form: str) -> None:
    rng = np.random.default_rng(2)
    n = len(model().mesh.cells)
    mixed = rng.standard_normal((n, n))
    settings: dict[str, Any] = {"weights": rng.uniform(0.1, 1.0, 40)} if form == "weights" else {}
    p = problem(mixed @ mixed.T / n + np.eye(n) if form == "matrix" else "laplace", **settings)
    assert mismatch(Spectrum.of(p).operator(0.05).matrix, p.operator(0.05).matrix) < 1e-9


@pytest.mark.parametrize("prior", ["noser", "laplace"])
def test_operator_of_a_complex_problem(prior: str) -> None:
    p = problem(prior, conductivity=1.0 + 0.3j)
    got, expected = Spectrum.of(p).operator(0.05), p.operator(0.05)
    assert np.iscomplexobj(expected.matrix)
    assert mismatch(got.matrix, expected.matrix) < 1e-9
    assert mismatch(got.precision, expected.precision) < 1e-9


def test_operator_where_every_part_of_the_mesh_is_free() -> None:
    """A prior that looks at differences within two halves only: two free images."""
    centroids = model().mesh.centroids
    q = penalty_of("laplace", model().mesh, np.empty((0, 0))).matrix.copy()
    left = centroids[:, 0] < 0
    q[np.ix_(left, ~left)] = q[np.ix_(~left, left)] = 0.0
    q[np.diag_indices_from(q)] -= q.sum(axis=1)
    p = problem(q)
    spectrum = Spectrum.of(p)
    assert np.isinf(spectrum.values).sum() == p.prior.free.shape[1] >= 1
    assert mismatch(spectrum.operator(0.1).matrix, p.operator(0.1).matrix) < 1e-9


@given(st.floats(-3, 0))
def test_noise_and_filters_are_those_of_the_image(exponent: float) -> None:
    alpha = 10.0**exponent
    noise = np.random.default_rng(3).uniform(0.5e-6, 2e-6, 40)
    volumes = model().mesh.volumes
    for prior in ("noser", "laplace"):
        spectrum = cached(prior)
        matrix = spectrum.problem.operator(alpha).matrix
        spread = np.sqrt(((matrix * noise) ** 2).sum(axis=1) @ volumes / volumes.sum())
        influence = np.trace(spectrum.problem.jacobian @ matrix)
        covariance = spectrum.noise_coefficients(noise)
        (energy,) = spectrum.energies(np.array([alpha]), covariance)
        assert np.sqrt(energy / volumes.sum()) == pytest.approx(spread, rel=1e-6, abs=0)
        assert spectrum.filters(alpha).sum() == pytest.approx(influence, rel=1e-6)


@cache
def cached(prior: str) -> Spectrum:
    return Spectrum.of(problem(prior))


def test_singular_values_of_a_diagonal_prior() -> None:
    p = problem("noser")
    q = penalty_of("noser", model().mesh, p.jacobian).matrix
    expected = np.linalg.svd(p.jacobian / np.sqrt(q), compute_uv=False)
    spectrum = cached("noser")
    n = len(spectrum.singular_values)
    assert n == 20  # the 40 rows are reciprocal in pairs
    assert spectrum.singular_values == pytest.approx(expected[:n], rel=1e-6)
    assert spectrum.condition == pytest.approx(expected[0] / expected[n - 1], rel=1e-6)


def test_limits_of_alpha(spectrum: Spectrum) -> None:
    free = np.isinf(spectrum.values).sum()
    assert spectrum.filters(1e9).sum() == pytest.approx(free, abs=1e-9)
    assert spectrum.filters(1e-7).sum() == pytest.approx(20, abs=1.5)
    steps = [spectrum.filters(a).sum() for a in spectrum.alphas]
    assert (np.diff(steps) < 0).all()


@pytest.mark.parametrize("alpha", [0.0, -1.0, np.nan, np.inf])
def test_alpha_must_be_above_zero(alpha: float) -> None:
    with pytest.raises(ModelError, match="expected alpha above 0"):
        cached("noser").operator(alpha)


def test_a_free_image_that_the_data_do_not_see() -> None:
    p = problem("laplace")
    mean = p.jacobian.mean(axis=1, keepdims=True)
    blind = replace(p, jacobian=p.jacobian - mean)
    with pytest.raises(ModelError, match="do not determine an image"):
        Spectrum.of(blind)
