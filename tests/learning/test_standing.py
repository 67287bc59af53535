"""Frames of a touch that stands still count together; those of one that moves do not."""

from __future__ import annotations

import numpy as np
import pytest

from learning.labelled import Floats
from tomoskin.learning.touch.located_touch import Standing

NOISE, ROWS = 0.1, 40


def frames(n: int, step: float = 0.0, seed: int = 1) -> Floats:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=ROWS)
    return rows + step * np.arange(n)[:, None] * rows + NOISE * rng.normal(size=(n, ROWS))


def pushed(dv: Floats) -> tuple[Standing, Floats]:
    standing = Standing()
    return standing, np.array([standing.push(frame) for frame in dv])


def test_the_noise_of_a_touch_that_stands_falls() -> None:
    standing, means = pushed(frames(40))
    late = means[15:] - frames(40).mean(axis=0)
    assert standing.stands
    assert late.std() < 0.5 * NOISE


@pytest.mark.parametrize("step", [0.15, 1.0])
def test_a_touch_that_moves_is_not_told_late(step: float) -> None:
    dv = frames(40, step)
    standing, means = pushed(dv)
    assert not standing.stands
    assert np.abs(means - dv).mean() < 2.5 * NOISE


def test_a_jump_is_told_in_its_first_frame() -> None:
    dv = np.concatenate([frames(20), frames(4) + 1.0])
    standing, means = pushed(dv)
    np.testing.assert_array_equal(means[20], dv[20])
    assert not standing.stands


def test_what_is_missing_all_at_once_begins_anew() -> None:
    dv = frames(30)
    dv[20:, 3] = np.nan
    _, means = pushed(dv)
    np.testing.assert_array_equal(means[20], dv[20])
    assert np.isnan(means[25, 3])
    assert np.isfinite(means[25, 4:]).all()


def test_another_touch_does_not_count_with_the_last() -> None:
    standing, _ = pushed(frames(20))
    standing.clear()
    frame = frames(1)[0]
    np.testing.assert_array_equal(standing.push(frame), frame)
