"""Every form of Q gives the operator of the formula, in the space of the measurements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.sparse import csr_array

from golden import mismatch
from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging import LinearProblem, OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import PRIORS, Matern, Penalty, Structural
from tomoskin.model.prior.penalty import dense_penalty, sparse_penalty

MODEL = ForwardModel(disc(8), Pattern.adjacent(8), 0.01)
FORMS: dict[str, Any] = {"dense": lambda q: q, "sparse": csr_array}


def problem(jacobian: Any, weights: FloatArray, prior: Penalty) -> LinearProblem:
    """A problem of any size; only its linear algebra is asked for."""
    return LinearProblem(
        model=MODEL,
        conductivity=np.ones(jacobian.shape[1]),
        jacobian=jacobian,
        weights=weights,
        prior=prior,
        difference="plain",
        reference=np.ones(len(weights)),
    )


def in_the_space_of_images(
    jacobian: Any, weights: FloatArray, q: FloatArray, alpha: float
) -> FloatArray:
    weighted = jacobian.conj().T * weights
    return np.asarray(np.linalg.solve(weighted @ jacobian + alpha**2 * q, weighted))


@st.composite
def semi_definite(draw: st.DrawFn) -> FloatArray:
    """(n, n) of any rank but zero, eigenvalues that are not zero far from it."""
    n = draw(st.integers(2, 30))
    rank = draw(st.integers(1, n))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    root = rng.standard_normal((n, rank)) * (rng.random((n, 1)) < draw(st.sampled_from([0.4, 1])))
    axes, sizes, _ = np.linalg.svd(root, full_matrices=False)
    axes = axes[:, sizes > 1e-9 * sizes[0]] if sizes[0] else np.eye(n)
    return np.asarray(axes * rng.uniform(0.1, 30.0, axes.shape[1]) @ axes.T)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("dtype", [float, complex])
@settings(max_examples=50)
@given(q=semi_definite(), seed=st.integers(0, 999), alpha=st.floats(0.1, 3.0))
def test_both_spaces_agree(form: str, dtype: type, q: FloatArray, seed: int, alpha: float) -> None:
    """More rows than free images, as in any problem that has an answer."""
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((len(q) + 3, len(q)))
    if dtype is complex:
        jacobian = jacobian + 1j * rng.standard_normal(jacobian.shape)
    weights = rng.uniform(0.5, 2.0, len(jacobian))
    operator = problem(jacobian, weights, _penalty(FORMS[form](q))).operator(alpha)
    expected = in_the_space_of_images(jacobian, weights, q, alpha)
    assert mismatch(operator.matrix, expected) < 1e-8


def _penalty(q: Any) -> Penalty:
    return sparse_penalty(q) if isinstance(q, csr_array) else dense_penalty(q)


@pytest.mark.parametrize("form", FORMS)
def test_free_images_are_the_null_space(form: str) -> None:
    """Second differences on a line: straight lines are free, and no constant alone."""
    second = np.diff(np.eye(12), 2, axis=0)
    free = _penalty(FORMS[form](second.T @ second)).free
    assert free.shape == (12, 2)
    assert np.abs(second @ free).max() < 1e-12
    assert free.T @ free == pytest.approx(np.eye(2))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("little", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_a_free_image_that_hardly_touches_some_cell(form: str, little: float) -> None:
    """Pivots alone do not tell it: rounding grows as they shrink."""
    image = np.array([1.0, -0.7, 0.9, 1.1, little])
    free = image / np.linalg.norm(image)
    axes = np.linalg.svd(free[:, None])[0][:, 1:]
    found = _penalty(FORMS[form](axes * [1.0, 7.0, 20.0, 30.0] @ axes.T)).free
    assert np.abs(found.T @ free) == pytest.approx(1.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_prior_with_a_negative_eigenvalue(form: str) -> None:
    q = np.diag([1.0, 2.0, -0.5]) + 0.1
    with pytest.raises(ModelError, match=r"not positive definite: it has eigenvalue -0\.4"):
        _penalty(FORMS[form](q))


@pytest.mark.parametrize("prior", [*PRIORS, Structural(np.arange(232) % 2, coupling=0.1)])
def test_named_priors_carry_the_pseudo_inverse(prior: Any) -> None:
    jacobian = np.random.default_rng(0).standard_normal((9, len(MODEL.mesh.cells)))
    made = PRIORS[prior] if isinstance(prior, str) else prior
    penalty = made.penalty(MODEL.mesh, jacobian)
    q = np.diag(penalty.matrix) if penalty.matrix.ndim == 1 else penalty.matrix
    spread, gram = penalty.carry(jacobian)
    expected = np.linalg.pinv(q, rcond=1e-12, hermitian=True) @ jacobian.T
    assert mismatch(spread, expected) < 1e-9
    assert mismatch(gram, jacobian @ expected) < 1e-9


@pytest.mark.parametrize("coupling", [0.0, 1e-6, 1e-3, 0.3, 1.0])
def test_structural_operators_are_those_of_the_formula(coupling: float) -> None:
    labels = (np.linalg.norm(MODEL.mesh.centroids - [0.03, 0.02], axis=1) < 0.04).astype(int)
    operator = OneStep(MODEL, Structural(labels, coupling), alpha=0.05)
    q = operator.problem.prior.matrix
    expected = in_the_space_of_images(operator.problem.jacobian, np.ones(40), q, 0.05)
    assert mismatch(operator.matrix, expected) < 1e-9


def test_a_region_that_is_known_shows_whole() -> None:
    """A change that fills a region comes out flatter with its edge known than without."""
    inside = np.linalg.norm(MODEL.mesh.centroids - [0.03, 0.02], axis=1) < 0.04
    dv = MODEL.jacobian(1.0) @ np.where(inside, -0.3, 0.0)
    wrong = {}
    for coupling in (0.0, 1.0):
        image = OneStep(MODEL, Structural(inside, coupling), alpha=0.05)(dv).values
        wrong[coupling] = float(np.abs(image - np.where(inside, -0.3, 0.0)).max())
    assert wrong[0.0] < 0.01
    assert wrong[1.0] > 0.1


@pytest.mark.parametrize("smoothness", [0.5, 1.5])
def test_a_covariance_prior_is_its_inverse_as_a_precision(smoothness: float) -> None:
    operator = OneStep(MODEL, Matern(0.03, smoothness), alpha=0.3)
    precision = operator.problem.prior.matrix
    assert mismatch(OneStep(MODEL, precision, alpha=0.3).matrix, operator.matrix) < 1e-8


def test_a_covariance_prior_is_the_conditional_mean_of_a_random_field() -> None:
    """Images drawn from the prior, data with noise: no other linear operator errs less."""
    rng = np.random.default_rng(8)
    prior, sd, n = Matern(0.03, 0.5), 0.05, 2000
    made = prior.penalty(MODEL.mesh, np.empty((0, 0)))
    root = np.linalg.cholesky(np.linalg.inv(made.matrix))
    truth = root @ rng.standard_normal((len(root), n))
    dv = MODEL.jacobian(1.0) @ truth + sd * rng.standard_normal((40, n))
    error = {
        alpha: float(np.mean((OneStep(MODEL, prior, alpha=alpha).matrix @ dv - truth) ** 2))
        for alpha in (sd / 2, sd, 2 * sd)
    }
    assert min(error, key=error.__getitem__) == sd
