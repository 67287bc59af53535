"""What idle frames scatter by."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.sensing.signal import Reference, Scatter
from tomoskin.sensing.signal.baseline import MEMORY

LIVING = np.zeros(3, bool)


def noise(count, seed, sd=1.0):
    return sd * np.random.default_rng(seed).standard_normal((count, 3))


def test_a_reference_has_that_of_its_frames_and_its_own_error():
    values = noise(30, 1)
    scatter = Reference.of(values).scatter
    assert scatter is not None
    assert scatter.frames == 29
    np.testing.assert_allclose(scatter.matrix, np.cov(values.T) * 31 / 30)
    assert Reference.of(values[:1]).scatter is None


def test_it_follows_noise_that_becomes_louder():
    scatter = Scatter.of(noise(30, 2))
    for seed in range(40):
        scatter = scatter.after(noise(32, seed, 5.0), LIVING)
    assert scatter.frames == MEMORY
    assert np.diag(scatter.matrix) == pytest.approx(25.0, rel=0.25)


def test_a_knock_is_not_the_noise_of_all_times():
    scatter, wild = Scatter.of(noise(30, 3)), noise(32, 4)
    wild[5, 1] = 1e6
    quiet = scatter.after(noise(32, 4), LIVING)
    after = scatter.after(wild, LIVING)
    assert after.matrix[1, 1] < 2.5 * quiet.matrix[1, 1]
    assert after.matrix[0, 0] == pytest.approx(quiet.matrix[0, 0])


def test_lost_rows_stay_as_they_were():
    scatter = Scatter.of(noise(30, 5))
    lost = np.array([False, True, False])
    after = scatter.after(noise(32, 6, 3.0), lost)
    np.testing.assert_array_equal(after.matrix[1], scatter.matrix[1])
    assert after.matrix[0, 0] > 2 * scatter.matrix[0, 0]
