"""The contact servo in short: what a policy learns of a few episodes it can do on other sheets."""

from __future__ import annotations

import pytest


@pytest.mark.slow
def test_a_policy_follows_a_finger_by_touch_alone(imported):
    servo = imported("servo")
    found = servo.main(["--demonstrations", "8", "--episodes", "5"])
    assert found["rows"] > 400
    assert found["expert"] == 1
    assert found["touch"] >= 0.8
    assert found["masked"] <= 0.4


def test_an_episode_is_learnt_from_its_dataset(imported, tmp_path):
    servo = imported("servo")
    prepared = servo.prepare(servo.Skin.load(servo.SKIN))
    rows, actions = servo.examples(servo.demonstrated(prepared, tmp_path, seed=5, count=2))
    assert len(rows) == len(actions) > 100
    matrix = servo.fitted(rows[:-40], actions[:-40])
    error = rows[-40:] @ matrix - actions[-40:]
    assert (error.std(axis=0)[:2] < 0.5 * actions[-40:].std(axis=0)[:2]).all()
