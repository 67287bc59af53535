"""The reference follows the untouched skin, holds under a touch, and learns noise and drift."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.sensing.signal import Baseline, Reference
from tomoskin.sensing.signal.idle import BLOCK, Idle

ROWS, DT = 60, 0.05
SIZE = np.linspace(1.0, 3.0, ROWS)
NOISE = 1e-3
NONE = np.zeros(ROWS, bool)


class Skin:
    """An untouched skin that drifts by ``rate`` of its voltages per second."""

    def __init__(self, rate=0.0, noise=NOISE, seed=0):
        self.random, self.rate, self.noise, self.time = (
            np.random.default_rng(seed),
            rate,
            noise,
            0.0,
        )

    def read(self):
        self.time += DT
        return self.true() + self.noise * self.random.standard_normal(ROWS)

    def true(self):
        return SIZE * (1 + self.rate * self.time)


def begun(skin, **settings):
    return Baseline(Reference.of(np.array([skin.read() for _ in range(20)])), **settings)


def run(baseline, skin, seconds, change=0.0, *, touched=False):
    for _ in range(round(seconds / DT)):
        baseline.push(skin.read() + change, NONE, skin.time, touched=touched)


def error(baseline, skin):
    """In deviations of a frame, rms of the rows."""
    return float(np.sqrt(np.mean((baseline.mean - skin.true()) ** 2))) / NOISE


def test_it_follows_drift_while_nothing_touches():
    skin = Skin(rate=2e-5)
    baseline = begun(skin)
    run(baseline, skin, 200)
    held = np.sqrt(np.mean((SIZE * skin.rate * skin.time) ** 2)) / NOISE
    assert held > 7
    assert error(baseline, skin) < 1
    assert baseline.state.drift == pytest.approx(skin.rate * skin.time, rel=0.2)


def test_without_drift_it_gets_better_than_the_frames_that_began_it():
    skin = Skin()
    baseline = begun(skin)
    first = error(baseline, skin)
    run(baseline, skin, 120)
    assert error(baseline, skin) < 0.5 * first


def test_it_holds_under_a_touch_of_ten_minutes_and_says_that_it_may_be_stale():
    skin = Skin(rate=2e-5)
    baseline = begun(skin)
    run(baseline, skin, 60)
    before, touch = baseline.mean, 20 * NOISE * np.sin(np.arange(ROWS))
    assert baseline.state.stale is None
    run(baseline, skin, 600, touch, touched=True)
    np.testing.assert_array_equal(baseline.mean, before)
    state = baseline.state
    assert state.held == pytest.approx(600, rel=1e-6)
    assert "600 s" in state.stale
    assert "take a new reference" in state.stale


def test_what_a_touch_leaves_fades_into_it_within_seconds_of_the_release():
    skin = Skin()
    baseline = begun(skin)
    run(baseline, skin, 5, 20 * NOISE, touched=True)
    run(baseline, skin, 8, 2 * NOISE)
    assert np.median(baseline.mean - SIZE) == pytest.approx(2 * NOISE, rel=0.2)
    assert baseline.state.held == 0


def test_frames_right_after_a_touch_are_not_learnt():
    skin = Skin()
    baseline = begun(skin)
    run(baseline, skin, 1, touched=True)
    before = baseline.mean
    run(baseline, skin, 0.5, 50 * NOISE)
    np.testing.assert_array_equal(baseline.mean, before)


def test_rows_that_are_lost_go_with_the_common_mode_of_the_others():
    skin = Skin(rate=1e-4)
    baseline = begun(skin)
    before, lost = baseline.mean, np.arange(ROWS) < 3
    for _ in range(400):
        values = np.where(lost, 99.0, skin.read())
        baseline.push(values, lost, skin.time, touched=False)
    ratio = baseline.mean[lost] / before[lost]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)
    assert ratio[0] == pytest.approx(1 + skin.rate * 20, abs=2e-4)
    assert np.abs(baseline.mean - before)[~lost].min() > 0


def test_a_skin_that_is_to_hold_keeps_its_reference_but_learns_its_noise():
    skin = Skin(rate=1e-4)
    baseline = begun(skin, follows=False)
    before, skin.noise = baseline.mean, 3 * NOISE
    run(baseline, skin, 120)
    np.testing.assert_array_equal(baseline.mean, before)
    assert np.median(baseline.idle.noise) == pytest.approx(3 * NOISE, rel=0.1)


@pytest.mark.parametrize("count", [1, 20])
def test_without_noise_it_does_not_follow(count):
    baseline = Baseline(Reference.of(np.tile(SIZE, (count, 1))))
    for frame in range(100):
        baseline.push(SIZE + 1, NONE, DT * frame, touched=False)
    np.testing.assert_allclose(baseline.mean, SIZE, rtol=1e-12)


def test_times_that_go_back_do_no_harm():
    skin = Skin()
    baseline = begun(skin)
    for time in (5.0, 1.0, np.float64(1e9), 0.0):
        baseline.push(skin.read(), NONE, float(time), touched=False)
    assert np.isfinite(baseline.mean).all()
    assert error(baseline, skin) < 3


def fed(idle, skin, blocks, change=None):
    for number in range(blocks * BLOCK):
        extra = 0.0 if change is None else change(number)
        idle.push(skin.read() + extra, skin.time, NONE)


def test_noise_is_told_from_drift():
    skin = Skin(rate=1e-3)
    idle = Idle(np.full(ROWS, 2 * NOISE), 20, 60.0)
    fed(idle, skin, 20)
    assert np.median(idle.noise) == pytest.approx(NOISE, rel=0.1)
    assert np.median(idle.drift) > 10 * NOISE**2 * idle.interval / 60**2


def test_rare_wild_values_are_not_noise():
    skin, wild = Skin(), np.random.default_rng(1)
    idle = Idle(np.full(ROWS, NOISE), 20, 60.0)
    fed(idle, skin, 20, lambda _: 1.0 * (wild.random(ROWS) < 0.002))
    assert np.median(idle.noise) < 1.5 * NOISE


def test_a_direction_of_drift_is_learnt_and_noise_is_none():
    way = np.cos(np.arange(ROWS) * 0.7)
    unlike = np.random.default_rng(2).standard_normal((ROWS, 50))
    still, drifting = Idle(np.full(ROWS, NOISE), 20, 60.0), Idle(np.full(ROWS, NOISE), 20, 60.0)
    fed(still, Skin(), 40)
    assert still.modes(lambda: unlike).shape[1] == 0
    fed(drifting, Skin(), 40, lambda n: 5 * NOISE * n / 1280 * way)
    found = drifting.modes(lambda: unlike)
    assert found.shape[1] == 1
    cosine = found[:, 0] @ way / np.linalg.norm(found) / np.linalg.norm(way)
    assert abs(cosine) > 0.97
    touchlike = np.column_stack([unlike, way])
    assert drifting.modes(lambda: touchlike).shape[1] == 0


def test_what_touches_leave_behind_is_no_direction_of_drift():
    way, skin = np.cos(np.arange(ROWS) * 0.7), Skin()
    idle = Idle(np.full(ROWS, NOISE), 20, 60.0)
    for press in range(12):
        fed(idle, skin, 3, lambda _, step=press: 2 * NOISE * step * way)
        idle.interrupt()
    some = np.random.default_rng(2).standard_normal((ROWS, 50))
    assert idle.modes(lambda: some).shape[1] == 0


def test_frames_that_are_all_the_same_waver_by_what_rounding_leaves():
    """However many: noise does not wane to nothing."""
    reference = Reference.of(np.ones((20, ROWS)), NOISE)
    baseline = Baseline(reference)
    for n in range(20 * BLOCK):
        baseline.push(np.ones(ROWS), np.zeros(ROWS, bool), 0.1 * n, touched=False)
    np.testing.assert_allclose(baseline.idle.noise, NOISE)
    np.testing.assert_allclose(reference.noise, NOISE)
