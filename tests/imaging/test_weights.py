"""Weights from noise."""

from __future__ import annotations

import numpy as np
import pytest

from golden import mismatch
from shapes import disc
from tomoskin.core import DataError
from tomoskin.imaging import LinearProblem, noise_weights
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

MODEL = ForwardModel(disc(8), Pattern.adjacent(8), 0.01)
RNG = np.random.default_rng(0)


def test_weights_are_the_inverse_of_the_variance() -> None:
    sd = RNG.uniform(1e-4, 1e-3, 40)
    weights = noise_weights(sd, np.ones(40))
    assert np.ptp(weights * sd**2) < 1e-12 * weights[0]
    assert np.exp(np.mean(np.log(weights))) == pytest.approx(1.0)


@pytest.mark.parametrize("difference", ["plain", "normalised"])
@pytest.mark.parametrize("sd", [1e-6, 3.0])
def test_noise_that_is_the_same_in_volts_changes_nothing(difference: str, sd: float) -> None:
    problem = LinearProblem.of(MODEL, difference=difference)
    noise = sd / (np.abs(problem.reference) if difference == "normalised" else np.ones(40))
    assert problem.weighted(noise).weights == pytest.approx(problem.weights)


def test_a_row_that_never_moves_is_not_believed_without_limit() -> None:
    sd = np.full(40, 1e-3)
    sd[7] = 0.0
    weights = noise_weights(sd, np.ones(40))
    assert weights[7] == pytest.approx(100 * weights[8])
    assert np.array_equal(noise_weights(np.zeros(40), np.arange(1.0, 41.0)), np.arange(1.0, 41.0))


def test_weighing_by_the_noise_shows_less_of_it() -> None:
    """Random changes, rows with a hundredfold range of noise: the mean error shrinks."""
    sd = 1e-3 * 10.0 ** RNG.uniform(-1, 1, 40)
    problem = LinearProblem.of(MODEL, "noser")
    truth = RNG.standard_normal((len(MODEL.mesh.cells), 300))
    dv = problem.jacobian @ truth + sd[:, None] * RNG.standard_normal((40, 300))
    alphas = np.geomspace(1e-4, 1, 30)
    error = [
        min(float(np.mean((p.operator(a).matrix @ dv - truth) ** 2)) for a in alphas)
        for p in (problem, problem.weighted(sd))
    ]
    assert error[1] < error[0]


def test_a_noisy_row_loses_its_say() -> None:
    """With ever more noise on some rows the operator becomes the one without them."""
    problem, rows = LinearProblem.of(MODEL, "laplace"), [3, 17]
    weights = np.ones(40)
    weights[rows] = 1e-12
    nearly = LinearProblem.of(MODEL, "laplace", weights=weights).operator(0.1)
    assert mismatch(nearly.matrix, problem.operator(0.1).without(rows).matrix) < 1e-6


@pytest.mark.parametrize(
    ("noise", "message"),
    [
        (np.ones(39), r"expected noise of shape \(40,\), got \(39,\)"),
        (np.r_[np.ones(39), np.nan], "row 39: expected noise of at least 0, got nan"),
        (np.r_[-1.0, np.ones(39)], "row 0: expected noise of at least 0, got -1.0"),
    ],
)
def test_refused(noise: np.ndarray, message: str) -> None:
    with pytest.raises(DataError, match=message):
        LinearProblem.of(MODEL).weighted(noise)
