"""The contact servo in short: what a policy learns of a few episodes it can do on other sheets."""

from __future__ import annotations

import numpy as np
import pytest

from examples.conftest import imported

__all__ = ["imported"]


@pytest.mark.slow
def test_a_policy_follows_a_finger_by_touch_alone(imported):
    servo = imported("servo")
    found = servo.main(["--demonstrations", "12", "--episodes", "5"])
    assert found["rows"] > 800
    assert found["expert"] == 1
    assert found["touch"] >= 0.8
    assert found["masked"] <= 0.4


def test_rows_of_a_demonstration_hold_what_was_felt_and_done(imported, tmp_path):
    servo = imported("servo")
    prepared = servo.prepare(servo.Skin.load(servo.SKIN))
    dataset = servo.demonstrated(prepared, tmp_path, seed=5, count=1)
    rows, actions = servo.examples(dataset)
    assert len(rows) == len(actions) > 50
    (path,) = (dataset / "data").rglob("*.parquet")
    slots = np.array(servo.pq.read_table(path)[f"{servo.PREFIX}.touches"].to_pylist())
    x, y = (servo.FIELDS.index(axis) for axis in "xy")
    expected = servo.GOAL + actions[:, :2] / servo.GAIN  # the expert knows where it is
    assert np.median(np.abs(slots[:, [x, y]] - expected)) < 0.004
