"""Noise that was not there before is seen at once, and a touch is no noise."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import finished
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.fit import row_covariance
from tomoskin.sensing.fit.excess import Channels, Excess, Gauge

PATTERN = Pattern.adjacent(16)
SCAN = Scan.of(PATTERN)
NOISE = row_covariance(SCAN, 1.0) / 2
CHANNELS = Channels.of(PATTERN)
NOTHING = np.zeros((PATTERN.n_meas, 0))
GAUGE = finished(Gauge.making(CHANNELS, NOISE, NOTHING))


def frames(count, seed, times=1.0, electrode=None):
    sd = np.full(SCAN.n_samples, times / np.sqrt(2))
    if electrode is not None:
        sd = np.where(SCAN.sample_electrode == electrode, times, 1.0) / np.sqrt(2)
    samples = sd * np.random.default_rng(seed).standard_normal((count, SCAN.n_samples))
    return samples[:, SCAN.plus] - samples[:, SCAN.minus]


def followed(excess, data, noise=NOISE):
    last = data[0]
    for dv in data:
        gauge = finished(Gauge.making(CHANNELS, excess.added(noise, CHANNELS), NOTHING))
        excess = excess.after(gauge.squares(dv, dv - last), gauge)
        last = dv
    return excess


def test_idle_frames_show_none():
    squares = [GAUGE.squares(dv, 0 * dv) for dv in frames(400, 1)]
    assert np.mean(squares) == pytest.approx(1.0, abs=0.02)
    assert not followed(Excess.none(CHANNELS), frames(40, 2)).any


@pytest.mark.parametrize("electrode", [0, 7])
def test_an_electrode_that_turns_noisy_is_seen_in_its_first_frame(electrode):
    excess = followed(Excess.none(CHANNELS), frames(1, 3, 10.0, electrode))
    assert int(excess.variance[:16].argmax()) == electrode
    assert 25 < excess.variance[electrode] < 400
    assert f"E{electrode + 1}" in (excess.text(CHANNELS, GAUGE.variance) or "")


def test_noise_everywhere_is_a_level():
    excess = followed(Excess.none(CHANNELS), frames(1, 4, 3.0))
    assert 5 < excess.level < 40


def test_it_goes_with_the_noise():
    excess = followed(Excess.none(CHANNELS), frames(1, 5, 100.0))
    assert excess.level > 1000
    assert "no touch explains" in (excess.text(CHANNELS, GAUGE.variance) or "")
    assert not followed(excess, frames(40, 6)).any


def test_what_one_frame_alone_shows_is_forgotten_in_the_next():
    """A finger that comes down within a scan looks like noise, in that scan only."""
    excess = followed(Excess.none(CHANNELS), frames(1, 9, 10.0, electrode=3))
    assert excess.variance[3] > 25
    after = followed(excess, frames(1, 10))
    assert not after.variance.any()
    assert after.level < 2


def test_noise_that_stays_is_believed_all_the_time():
    excess = Excess.none(CHANNELS)
    for number in range(20):
        excess = followed(excess, frames(1, 20 + number, 10.0, electrode=3))
        assert 25 < excess.variance[3] < 600


def test_what_a_touch_changes_is_no_noise():
    pairs, change = CHANNELS.pairs, np.zeros(CHANNELS.apart.shape[1])
    change[pairs.first] = np.random.default_rng(7).standard_normal(len(pairs.first))
    change[pairs.second] = pairs.sign * change[pairs.first]
    change *= 200 / np.linalg.norm(change)
    idle = frames(30, 8)
    touched = idle + np.where(np.arange(30)[:, None] >= 10, change, 0.0)
    assert not followed(Excess.none(CHANNELS), touched).any


def test_rows_without_a_reciprocal_say_nothing():
    alone = Pattern.from_tables(np.tile([0, 1], (3, 1)), np.array([[2, 3], [3, 4], [4, 5]]), 6)
    channels = Channels.of(alone)
    gauge = finished(Gauge.making(channels, np.eye(3), np.zeros((3, 0))))
    wild = np.full(3, 1e6)
    assert not Excess.none(channels).after(gauge.squares(wild, wild), gauge).any
