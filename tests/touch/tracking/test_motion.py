"""The motion model against what it follows from."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from tomoskin.touch import TrackSettings
from tomoskin.touch.tracking.motion import States, begin, distances, observe, predict, update
from touch.tracking.detections import detection

SETTINGS = TrackSettings()


def state() -> States:
    place, spread = observe([detection(0.01, -0.02)], SETTINGS)
    return begin(place[0], spread[0], SETTINGS)


@pytest.mark.parametrize("seconds", [0.001, 0.02, 0.3, 5.0])
def test_noise_is_that_of_the_stochastic_equation(seconds: float) -> None:
    """dv = −v/τ dt + √(2/τ) s dW, dx = v dt: the covariance by Van Loan's exponential (1978)."""
    tau, speed = SETTINGS.turning, SETTINGS.speed
    drift = np.array([[0.0, 1.0], [0.0, -1 / tau]])
    noise = np.diag([0.0, 2 * speed**2 / tau])
    block = np.block([[-drift, noise], [np.zeros((2, 2)), drift.T]]) * seconds
    both = expm(block)
    step = both[2:, 2:].T
    grown = step @ both[:2, 2:]
    known = States(np.array([[0.0, 0.0, 0.1, 0.0]]), np.zeros((1, 4, 4)))
    got = predict(known, seconds, SETTINGS)
    assert got.mean[0, [0, 2]] == pytest.approx(step @ [0, 0.1])
    assert got.covariance[0][np.ix_([0, 2], [0, 2])] == pytest.approx(grown, rel=1e-6)
    assert not got.covariance[0][np.ix_([0, 2], [1, 3])].any()


def test_speed_does_not_grow_over_a_gap() -> None:
    got = predict(state(), 100.0, SETTINGS)
    assert np.sqrt(got.covariance[0, 2, 2]) == pytest.approx(SETTINGS.speed)
    drift = np.array([[-1 / SETTINGS.turning]])
    lasting = solve_continuous_lyapunov(
        drift, -np.array([[2 * SETTINGS.speed**2 / SETTINGS.turning]])
    )
    assert lasting[0, 0] == pytest.approx(SETTINGS.speed**2)


def test_two_short_steps_are_one_long_one() -> None:
    twice = predict(predict(state(), 0.1, SETTINGS), 0.2, SETTINGS)
    once = predict(state(), 0.3, SETTINGS)
    assert twice.covariance == pytest.approx(once.covariance)


def test_the_update_is_the_mean_of_two_gaussians() -> None:
    before = predict(state(), 0.1, SETTINGS)
    places, spreads = observe([detection(0.03, 0.0, sd_x=0.004, cov_xy=2e-6)], SETTINGS)
    after = update(before, places, spreads)
    prior = before.covariance[0, :2, :2]
    precision = np.linalg.inv(prior) + np.linalg.inv(spreads[0])
    mean = np.linalg.solve(
        precision,
        np.linalg.solve(prior, before.mean[0, :2]) + np.linalg.solve(spreads[0], places[0]),
    )
    assert after.mean[0, :2] == pytest.approx(mean)
    assert after.covariance[0, :2, :2] == pytest.approx(np.linalg.inv(precision))
    assert after.mean[0, 2] > 0


def test_distances_are_mahalanobis() -> None:
    places, spreads = observe([detection(0.03, 0.01, cov_xy=5e-7), detection(0, 0)], SETTINGS)
    before = state()
    got = distances(before, places, spreads)
    for k in (0, 1):
        away = places[k] - before.mean[0, :2]
        both = before.covariance[0, :2, :2] + spreads[k]
        assert got[0, k] == pytest.approx(away @ np.linalg.solve(both, away))


def test_no_time_changes_nothing() -> None:
    before = state()
    assert predict(before, 0.0, SETTINGS) is before
