"""What one frame leaves open, several tell."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from touch.fit.scene import noise
from touch.fit.test_finder import NOTHING, data, press
from touch.fit.test_pace import finder

STRONG = press(0.03, 0.0, depth=-0.5)


def counts(second: FloatArray, seed: int, frames: int = 30) -> list[int]:
    """How many touches a live finder sees in frames of one that stands, and a second one."""
    ours = finder()
    both = np.concatenate([STRONG, second])
    seen = noise(16, 3 + frames, seed)
    for n in seen[:3]:
        assert len(ours.push(data(STRONG) + n, NOTHING)) == 1
    return [len(ours.push(data(both) + n, NOTHING)) for n in seen[3:]]


def test_a_touch_that_no_frame_alone_shows_is_found_after_some() -> None:
    seen = [counts(press(-0.02, 0.0, depth=-0.08), seed) for seed in (1, 2, 3)]
    assert [one[0] for one in seen] == [1, 1, 1]
    assert all(one.count(2) > 5 for one in seen)


def test_noise_beside_a_touch_is_no_rival_for_long() -> None:
    nothing = press(-0.02, 0.0)[:0]
    assert counts(nothing, 4, frames=200) == [1] * 200
