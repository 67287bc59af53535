"""What an operator can tell, against forming everything and against pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import mismatch
from shapes import disc
from tomoskin.core import ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse import (
    PRIORS,
    OneStep,
    averaging,
    condition_number,
    point_spread,
    resolution_matrix,
    resolved,
    sensitivity,
)
from tomoskin.mesh import Mesh
from tomoskin.pattern import Pattern

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
