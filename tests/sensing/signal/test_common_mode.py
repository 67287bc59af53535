"""The common mode is followed by itself: slow drift, jumps that stand, and none that pass."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.sensing.signal import Baseline, Reference

ROWS, DT, NOISE = 40, 0.05, 1e-3
SIZE = np.linspace(1.0, 3.0, ROWS)
NONE = np.zeros(ROWS, bool)


class Skin:
    """An untouched skin whose voltages all have a gain; a baseline follows it."""

    def __init__(self, seed: int) -> None:
        self.random, self.time = np.random.default_rng(seed), 0.0
        frames = np.array([self.read(1.0) for _ in range(20)])
        self.baseline = Baseline(Reference.of(frames))

    def read(self, gain: float) -> np.ndarray:
        return gain * SIZE + NOISE * self.random.standard_normal(ROWS)

    def run(self, frames: int, gain: float, change: np.ndarray | float = 0.0) -> None:
        for _ in range(frames):
            self.time += DT
            self.baseline.push(self.read(gain) + change, NONE, self.time, touched=False)

    def error(self, gain: float) -> np.ndarray:
        """(n_meas,) in deviations of a frame."""
        return (self.baseline.mean - gain * SIZE) / NOISE


@pytest.mark.parametrize("step", [0.003, 0.1, -0.1])
def test_a_step_that_stands_is_the_new_level_in_a_second(step: float) -> None:
    skin = Skin(1)
    skin.run(100, 1.0)
    skin.run(20, 1.0 + step)
    assert np.sqrt(np.mean(skin.error(1.0 + step) ** 2)) < 0.6


def test_a_dip_that_passes_is_none() -> None:
    skin = Skin(2)
    skin.run(100, 1.0)
    before = skin.baseline.mean
    skin.run(5, 0.97)
    skin.run(5, 1.0)
    np.testing.assert_allclose(skin.baseline.mean, before, atol=0.3 * NOISE)


def test_what_changes_beside_it_is_followed_as_slowly_as_before() -> None:
    """A step of one row alone is that row's, however the common mode goes."""
    skin = Skin(3)
    skin.run(100, 1.0)
    change = 30 * NOISE * (np.arange(ROWS) == 7)
    skin.run(20, 1.01, change)
    error = skin.error(1.01)
    assert abs(error[7]) < 3
    assert np.abs(np.delete(error, 7)).max() < 2


def test_with_rows_that_are_lost_it_is_told_by_the_others() -> None:
    skin = Skin(4)
    skin.run(100, 1.0)
    lost = np.arange(ROWS) < 5
    for _ in range(30):
        skin.time += DT
        values = np.where(lost, 0.0, skin.read(1.02))
        skin.baseline.push(values, lost, skin.time, touched=False)
    assert np.abs(skin.error(1.02)).max() < 2
