"""The motion model against what it follows from."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from sensing.track.detections import detection
from tomoskin.core import FloatArray
from tomoskin.sensing.track import TrackSettings
from tomoskin.sensing.track.motion import TrackState, begin, distance, observe, predict, update

SETTINGS = TrackSettings()


def state() -> TrackState:
    return begin(observe(detection(0.01, -0.02), SETTINGS), SETTINGS)


def mean(state: TrackState) -> FloatArray:
    return np.array(state[:4])


def covariance(state: TrackState) -> FloatArray:
    """(4, 4) in the order x, y, u, v."""
    s = state
    rows = [[s.xx, s.xy, s.xu, s.xv], [s.xy, s.yy, s.yu, s.yv]]
    rows += [[s.xu, s.yu, s.uu, s.uv], [s.xv, s.yv, s.uv, s.vv]]
    return np.array(rows)


def moved() -> TrackState:
    """One whose covariance has no zeros."""
    turned = observe(detection(0.012, -0.021, sd_x=0.004, cov_xy=2e-6), SETTINGS)
    return predict(update(predict(state(), 0.1, SETTINGS), turned), 0.2, SETTINGS)


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
    known = TrackState(0.0, 0.0, 0.1, 0.0, *np.zeros(10).tolist())
    got = predict(known, seconds, SETTINGS)
    assert mean(got)[[0, 2]] == pytest.approx(step @ [0, 0.1])
    assert covariance(got)[np.ix_([0, 2], [0, 2])] == pytest.approx(grown, rel=1e-6)
    assert not covariance(got)[np.ix_([0, 2], [1, 3])].any()
    before = moved()
    whole, noise = np.kron(step, np.eye(2)), np.kron(grown, np.eye(2))
    after = predict(before, seconds, SETTINGS)
    assert mean(after) == pytest.approx(whole @ mean(before))
    assert covariance(after) == pytest.approx(
        whole @ covariance(before) @ whole.T + noise, rel=1e-6
    )


def test_speed_does_not_grow_over_a_gap() -> None:
    got = predict(state(), 100.0, SETTINGS)
    assert np.sqrt(got.uu) == pytest.approx(SETTINGS.speed)
    drift = np.array([[-1 / SETTINGS.turning]])
    lasting = solve_continuous_lyapunov(
        drift, -np.array([[2 * SETTINGS.speed**2 / SETTINGS.turning]])
    )
    assert lasting[0, 0] == pytest.approx(SETTINGS.speed**2)


def test_two_short_steps_are_one_long_one() -> None:
    twice = predict(predict(state(), 0.1, SETTINGS), 0.2, SETTINGS)
    once = predict(state(), 0.3, SETTINGS)
    assert twice == pytest.approx(once)


def test_the_update_is_that_of_kalman() -> None:
    before = moved()
    seen = observe(detection(0.03, 0.0, sd_x=0.004, cov_xy=2e-6), SETTINGS)
    after = update(before, seen)
    spread, both = covariance(before), np.array([[seen.xx, seen.xy], [seen.xy, seen.yy]])
    gain = spread[:, :2] @ np.linalg.inv(spread[:2, :2] + both)
    away = np.array([seen.x, seen.y]) - mean(before)[:2]
    assert mean(after) == pytest.approx(mean(before) + gain @ away)
    assert covariance(after) == pytest.approx(spread - gain @ spread[:2], abs=1e-12)
    precision = np.linalg.inv(spread[:2, :2]) + np.linalg.inv(both)
    assert covariance(after)[:2, :2] == pytest.approx(np.linalg.inv(precision))
    assert after.u > 0


def test_distances_are_mahalanobis() -> None:
    before = state()
    for other in (detection(0.03, 0.01, cov_xy=5e-7), detection(0, 0)):
        seen = observe(other, SETTINGS)
        away = np.array([seen.x - before.x, seen.y - before.y])
        spread = covariance(before)[:2, :2] + [[seen.xx, seen.xy], [seen.xy, seen.yy]]
        far, area = distance(before, seen)
        assert far == pytest.approx(away @ np.linalg.solve(spread, away))
        assert area == pytest.approx(np.linalg.det(spread))


def test_no_time_changes_nothing() -> None:
    before = state()
    assert predict(before, 0.0, SETTINGS) is before
