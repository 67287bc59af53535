"""An arm that touches itself, in short: its own touches are marked, and those of others are not."""

from __future__ import annotations

import numpy as np

from examples.conftest import imported
from tomoskin.model.mesh import Pose

__all__ = ["imported"]


def test_own_touches_are_marked_and_others_are_not(imported):
    found = imported("self_contact").main(["--rigs", "1", "--seconds", "30", "--seed", "301"])
    assert found["own"] > 30
    assert found["other"] > 50
    assert found["own, marked"] >= 0.99
    assert found["other, marked"] <= 0.03


def test_the_joints_bring_the_end_where_it_is_but_for_what_is_wrong(imported):
    example = imported("self_contact")
    arm = example.Arm(np.random.default_rng(7), 10.0)
    assert 1e-3 <= np.linalg.norm(arm.wrong) <= 2e-3
    for time in (0.5, 3.0, 7.5):
        joints = arm.joints(time)
        turn = Pose.of((0, 0, 0), (0, joints["elbow"], joints["sway"])).rotation
        end = example.ELBOW + turn @ np.array([joints["reach"], 0, 0]) + arm.wrong
        assert np.abs(end - arm.end(time)).max() < 1e-12
