"""All skins of a robot file, as a program opens them."""

from __future__ import annotations

import math

import pytest

from run.test_live_skin import force_file, until
from tomoskin.extras.robot import open_robot
from tomoskin.learning import FORCE

__all__ = ["force_file"]


def test_the_skins_of_a_robot_file_each_with_its_calibrations(tmp_path, force_file):
    robot = tmp_path / "robot.toml"
    robot.write_text(
        "format = 1\n"
        f'[[skin]]\nname = "palm"\nskin = "textile-disc-8"\ncalibration = "{force_file}"\n'
        '[[skin]]\nname = "back"\nskin = "textile-disc-8"\n'
    )
    with open_robot(robot) as run:
        for name, skin in run.skins.items():
            contacts = until(skin, lambda c: c.valid)
            assert contacts.skin == name
            assert contacts.force == pytest.approx(0.0 if name == "palm" else math.nan, nan_ok=True)
        assert FORCE.name in run.runners["palm"].prepared.calibrations
        assert not run.runners["back"].prepared.calibrations
