"""What an operator can tell, against forming everything and against pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import mismatch
from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging import (
    PRIORS,
    OneStep,
    averaging,
    condition_number,
    point_spread,
    prior_matrix,
    resolution_matrix,
    resolved,
    sensitivity,
    unresolved,
)
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

MODEL = ForwardModel(disc(8), Pattern.adjacent(8), 0.01)


@pytest.fixture(scope="module", params=PRIORS)
def operator(request: pytest.FixtureRequest) -> OneStep:
    return OneStep(MODEL, request.param, alpha=0.05)


def test_parts_of_the_resolution_matrix_are_parts_of_it(operator: OneStep) -> None:
    whole = resolution_matrix(operator, operator.problem)
    assert mismatch(resolved(operator, operator.problem), np.diag(whole)) < 1e-12
    cells = [3, 100, 7]
    assert mismatch(point_spread(operator, operator.problem, cells), whole[:, cells]) < 1e-12
    assert mismatch(averaging(operator, operator.problem, cells), whole[cells]) < 1e-12


def test_a_point_spread_is_the_picture_of_a_small_change(operator: OneStep) -> None:
    change = np.zeros(len(MODEL.mesh.cells))
    change[42] = 1e-5
    dv = MODEL.solve(1.0 + change).voltages - operator.reference
    spread = point_spread(operator, operator.problem, [42])[:, 0]
    assert mismatch(operator(dv).values / 1e-5, spread) < 1e-4


def test_the_resolved_parts_sum_to_the_degrees_of_freedom(operator: OneStep) -> None:
    """The trace of RJ is that of JR: of 40 rows 20 are reciprocal, so 20 is the most."""
    freedom = resolved(operator, operator.problem).sum()
    assert freedom == pytest.approx(np.trace(operator.problem.jacobian @ operator.matrix))
    assert 1 < freedom < 20


RADIUS, ALPHA = 0.03, 0.05
WITH_FREE = ("laplace", "gaussian")
"""Priors that leave a constant free."""


def disc_means(radius: float = RADIUS) -> FloatArray:
    """(n_cells, n_cells) mean over the disc about each cell, cell by cell."""
    mesh = MODEL.mesh
    apart = np.linalg.norm(mesh.centroids[:, None] - mesh.centroids, axis=2)
    weights = np.where(apart <= radius, mesh.volumes, 0.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


@pytest.mark.parametrize("difference", ["plain", "normalised"])
@pytest.mark.parametrize("prior", [p for p in PRIORS if p not in WITH_FREE])
def test_what_is_unresolved_is_the_variance_that_bayes_leaves(prior: str, difference: str) -> None:
    """Prior N(0, Q⁻¹), noise N(0, α²W⁻¹): the posterior's covariance, by inverting all of it."""
    operator = OneStep(MODEL, prior, alpha=ALPHA, difference=difference)
    problem = operator.problem
    q = prior_matrix(prior, MODEL.mesh, problem.jacobian)
    q = np.diag(q) if q.ndim == 1 else q
    information = (problem.jacobian.T * problem.weights) @ problem.jacobian / ALPHA**2
    means = disc_means()
    left, before = (np.diag(means @ np.linalg.inv(m) @ means.T) for m in (information + q, q))
    found = unresolved(operator, problem, ALPHA, RADIUS)
    assert mismatch(found, left / before) < 1e-5
    assert 0.05 < found.min() < found.max() < 0.999


@pytest.mark.parametrize("prior", WITH_FREE)
@pytest.mark.parametrize("lost", [(), tuple(range(5)), (0, 9, 18, 27, 36)])
def test_what_is_unresolved_of_a_smooth_image_is_the_error_of_many(
    prior: str, lost: tuple[int, ...]
) -> None:
    """Images that the prior holds for likely, a constant on top, drawn and reconstructed."""
    problem = OneStep(MODEL, prior, alpha=ALPHA).problem
    operator = problem.operator(ALPHA).without(lost)
    rng, means = np.random.default_rng(8), disc_means()
    values, vectors = np.linalg.eigh(prior_matrix(prior, MODEL.mesh, problem.jacobian))
    images = (vectors[:, 1:] / np.sqrt(values[1:])) @ rng.normal(size=(len(values) - 1, 20_000))
    noise = ALPHA * rng.normal(size=(len(problem.weights), 20_000))
    error = operator.matrix @ (problem.jacobian @ (images + 5.0) + noise) - 5.0 - images
    expected = np.mean((means @ error) ** 2, axis=1) / np.mean((means @ images) ** 2, axis=1)
    found = unresolved(operator, problem, ALPHA, RADIUS)
    assert np.abs(found / np.minimum(expected, 1.0) - 1.0).max() < 0.06


def test_less_noise_and_larger_discs_leave_less_open_and_lost_electrodes_more() -> None:
    problem = OneStep(MODEL, alpha=ALPHA).problem
    whole = problem.operator(ALPHA)
    left = unresolved(whole, problem, ALPHA, RADIUS)
    quiet = ALPHA / 10
    assert (unresolved(problem.operator(quiet), problem, quiet, RADIUS) < left).all()
    assert unresolved(whole, problem, ALPHA, 2 * RADIUS).mean() < 0.9 * left.mean()
    without = whole.without(MODEL.pattern.rows_of(0))
    loss = unresolved(without, problem, ALPHA, RADIUS) - left
    assert (loss > -1e-12).all()
    beside = MODEL.mesh.points[MODEL.mesh.electrodes[0]].mean(axis=(0, 1))
    lost_most = MODEL.mesh.centroids[loss.argmax()]
    assert np.linalg.norm(lost_most - beside) < 0.04
    with pytest.raises(ModelError, match="radius above 0 m, got 0 m"):
        unresolved(whole, problem, ALPHA, 0.0)


def test_a_cell_alone_is_the_smallest_disc() -> None:
    problem = OneStep(MODEL, "identity", alpha=ALPHA).problem
    found = unresolved(problem.operator(ALPHA), problem, ALPHA, 1e-9)
    assert mismatch(found, 1 - resolved(problem.operator(ALPHA), problem)) < 1e-9


def test_sensitivity_does_not_depend_on_the_size_of_cells() -> None:
    """Four times as many triangles: the middle is as sensitive, and less so than an electrode."""
    fine = ForwardModel(disc(8, 900), Pattern.adjacent(8), 0.01)
    middle = []
    for model in (MODEL, fine):
        found = sensitivity(OneStep(model, alpha=0.1).problem)
        distance = np.linalg.norm(model.mesh.centroids, axis=1)
        middle.append(found[distance < 0.03].mean())
        assert found[distance > 0.09].max() > 5 * middle[-1]
    assert middle[0] == pytest.approx(middle[1], rel=0.1)


def test_sensitivity_counts_the_weights() -> None:
    weights = np.random.default_rng(0).uniform(0.5, 2.0, 40)
    problem = OneStep(MODEL, alpha=0.1, weights=weights).problem
    expected = np.linalg.norm(np.sqrt(weights)[:, None] * problem.jacobian, axis=0)
    assert sensitivity(problem) == pytest.approx(expected / MODEL.mesh.volumes)


def test_condition_number_is_that_of_the_matrix_without_repeated_rows() -> None:
    operator = OneStep(MODEL, "identity", alpha=0.05)
    values = np.linalg.svd(operator.matrix, compute_uv=False)
    assert condition_number(operator) == pytest.approx(values[0] / values[19], rel=1e-6)
    less = condition_number(OneStep(MODEL, "identity", alpha=10.0))
    assert less == pytest.approx(condition_number(OneStep(MODEL, "identity", alpha=20.0)), rel=0.1)


def test_an_operator_and_a_problem_that_do_not_belong_together() -> None:
    operator = OneStep(MODEL, alpha=0.1)
    moved = Mesh(1.1 * MODEL.mesh.points, MODEL.mesh.cells, MODEL.mesh.electrodes)
    for other in (
        OneStep(ForwardModel(moved, MODEL.pattern, 0.01), alpha=0.1),
        OneStep(ForwardModel(MODEL.mesh, Pattern.skip(8, 1), 0.01), alpha=0.1),
    ):
        with pytest.raises(ModelError, match="of one mesh, pattern and kind of difference"):
            resolved(operator, other.problem)
    with pytest.raises(ModelError, match=r"plain and .* normalised"):
        resolution_matrix(operator, replace(operator.problem, difference="normalised"))
