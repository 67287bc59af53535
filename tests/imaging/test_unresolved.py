"""What a frame leaves open, against Bayes in full and against many drawn images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import mismatch
from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging import OneStep, unresolved
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import PRIORS, penalty_of

MODEL = ForwardModel(disc(8), Pattern.adjacent(8), 0.01)


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
    q = penalty_of(prior, MODEL.mesh, problem.jacobian).matrix
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
    values, vectors = np.linalg.eigh(penalty_of(prior, MODEL.mesh, problem.jacobian).matrix)
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
    assert mismatch(found, 1 - np.diag(problem.operator(ALPHA).matrix @ problem.jacobian)) < 1e-9


def test_an_operator_and_a_problem_that_do_not_belong_together() -> None:
    operator = OneStep(MODEL, alpha=0.1)
    moved = Mesh(1.1 * MODEL.mesh.points, MODEL.mesh.cells, MODEL.mesh.electrodes)
    for other in (
        OneStep(ForwardModel(moved, MODEL.pattern, 0.01), alpha=0.1),
        OneStep(ForwardModel(MODEL.mesh, Pattern.skip(8, 1), 0.01), alpha=0.1),
    ):
        with pytest.raises(ModelError, match="of one mesh, pattern and kind of difference"):
            unresolved(operator, other.problem, 0.1, RADIUS)
    normalised = replace(operator.problem, difference="normalised")
    with pytest.raises(ModelError, match=r"plain and .* normalised"):
        unresolved(operator, normalised, 0.1, RADIUS)
