"""What one frame leaves open, several tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sensing.fit.scene import noise
from sensing.fit.test_finder import NOTHING, data, model, press
from sensing.fit.test_pace import finder
from sensing.fit.test_table import expected, problem
from tomoskin.core import FloatArray
from tomoskin.sensing.fit import LIVE
from tomoskin.sensing.fit.expectation import Expectation
from tomoskin.sensing.fit.hypotheses import challenged
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.selection import ForwardSelection, judged
from tomoskin.sensing.fit.spot_fit import Deficit

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


def test_what_a_wrong_profile_may_leave_goes_on_but_does_not_begin() -> None:
    """Beside a heavy press; the same alone may begin."""
    heavy, spots = press(0.05, 0.0, depth=-1.5), press(-0.04, 0.0, depth=-0.3)
    light, ours, alone = press(-0.04, 0.0, depth=-0.06), finder(), finder()
    for n in noise(16, 3, 5):
        found = ours.push(data(np.concatenate([heavy, spots])) + n, NOTHING)
        assert [detection.weak for detection in found] == [False, False]
    for n in noise(16, 3, 6):
        found = ours.push(data(np.concatenate([heavy, light])) + n, NOTHING)
        assert [detection.weak for detection in found] == [False, True]
        assert not alone.push(data(light) + n, NOTHING)[0].weak


def test_noise_beside_a_touch_is_no_rival_for_long() -> None:
    nothing = press(-0.02, 0.0)[:0]
    assert counts(nothing, 4, frames=200) == [1] * 200


def test_a_touch_that_left_its_place_in_vain_goes_back_and_another_has_begun() -> None:
    faint = np.concatenate([press(-0.04, 0.02, 0.018, -0.06), press(0.0, -0.02, 0.018, -0.06)])
    freely = problem(model().solver, faint, 0.01)
    frame = replace(freely, expected=expected(faint[:1]))
    deficit = Deficit.none(len(model().solver.table.basis))
    matched = model().candidates.matched(frame.seen)
    selection = ForwardSelection(frame, matched, DetectionPolicy(5.0, "decrease", 5, LIVE), deficit)
    between = freely.refined(faint.mean(axis=0)[None], deficit, 12).spots
    moved = judged(selection, frame.refined(between, deficit, 0, (0,)))
    assert selection.proposed(moved.fit) is None
    both, _ = challenged(selection, moved, None, lambda _: Expectation.none())
    away = np.linalg.norm(both.fit.spots[:, None, :2] - faint[:, :2], axis=2).min(axis=0)
    assert len(both.fit.spots) == 2
    assert away.max() < 0.015
