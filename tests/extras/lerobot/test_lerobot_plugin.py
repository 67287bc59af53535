"""``lerobot-record`` records a skin beside the robot that wears it, by LeRobot's own package."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from claims import ROOT
from tomoskin.extras.lerobot import FIELDS
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

PLUGIN = ROOT / "examples" / "lerobot_robot_tomoskin"

ARM = '''
"""An arm of two joints, and what leads it."""

from dataclasses import dataclass
from lerobot.robots import Robot, RobotConfig
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

JOINTS = {"shoulder.pos": float, "elbow.pos": float}

@RobotConfig.register_subclass("arm")
@dataclass
class ArmConfig(RobotConfig):
    pass

@TeleoperatorConfig.register_subclass("leader")
@dataclass
class LeaderConfig(TeleoperatorConfig):
    pass

class Device:
    is_calibrated = True
    is_connected = False
    def __init__(self, config):
        super().__init__(config)
    def connect(self, calibrate=True):
        self.is_connected = True
    def disconnect(self):
        self.is_connected = False
    def calibrate(self): ...
    def configure(self): ...

class Arm(Device, Robot):
    config_class, name = ArmConfig, "arm"
    observation_features = action_features = JOINTS
    def get_observation(self):
        return {"shoulder.pos": 1.0, "elbow.pos": 2.0}
    def send_action(self, action):
        return action

class Leader(Device, Teleoperator):
    config_class, name = LeaderConfig, "leader"
    action_features, feedback_features = JOINTS, {}
    def get_action(self):
        return {"shoulder.pos": 3.0, "elbow.pos": 4.0}
    def send_feedback(self, feedback): ...
'''

PRESS = """format = 1
[script]
duration = "5 s"
[[press]]
id = "finger"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "200 ms"
force = "3 N"
hold = "4400 ms"
"""


def installed(folder: Path, name: str) -> None:
    """Make a package of that name known, as pip does."""
    about = folder / f"{name}-0.1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")


@pytest.mark.slow
@pytest.mark.parametrize("source", ["twin", "recording"])
def test_lerobot_records_touch(tmp_path: Path, source: str) -> None:
    reason = "lerobot is not installed: pip install 'lerobot[dataset,hardware,viz]'"
    library = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason=reason)
    packages, root = tmp_path / "packages", tmp_path / "dataset"
    installed(packages, PLUGIN.name)
    installed(packages, "lerobot_robot_arm")
    (packages / "lerobot_robot_arm.py").write_text(ARM, encoding="utf-8")
    if source == "recording":
        press, skin = tmp_path / "press.mcap", Skin.load("textile-disc-8")
        simulate(Script.from_toml(PRESS), skin, press, advance=lambda *_: None)
        source = f"replay:{press},loop"
    paths = [str(packages), str(PLUGIN), *sys.path]
    subprocess.run(
        [sys.executable, "-m", "lerobot.scripts.lerobot_record",
         "--robot.type=tomoskin", f"--robot.source={source}", "--robot.window=3",
         "--robot.wearer={type: arm}", "--teleop.type=leader", "--dataset.repo_id=me/touch",
         f"--dataset.root={root}", "--dataset.num_episodes=2", "--dataset.episode_time_s=4",
         "--dataset.reset_time_s=0.1", "--dataset.fps=10", "--dataset.push_to_hub=false",
         "--dataset.no_stamp=true", "--dataset.single_task=touch", "--play_sounds=false"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "HF_HUB_OFFLINE": "1"},
        check=True, timeout=500,
    )  # fmt: skip
    found = library.LeRobotDataset("me/touch", root=root)
    assert found.num_episodes == 2
    feature = found.meta.features["observation.state"]
    names = feature["names"]
    assert names[:3] == ["shoulder.pos", "elbow.pos", "tactile.valid"]
    assert len(names) == 3 + 5 * len(FIELDS) + 3 * 40 + 3
    (file,) = (root / "data").rglob("*.parquet")
    rows = np.array(pq.read_table(file)["observation.state"].to_pylist())
    assert len(rows) > 20
    assert (rows[:, :2] == [1, 2]).all()
    assert {*rows[:, 2]} == ({1} if source == "twin" else {0, 1})  # each loop takes a reference
    assert rows[:, names.index("tactile.frame_0.E2-E1 E4-E5")].any()
    touched = rows[rows[:, names.index("tactile.touch_0.present")] > 0]
    if source == "twin":
        assert len(touched) == 0
    else:
        assert len(touched) > 5
        place = [names.index(f"tactile.touch_0.{axis}") for axis in "xy"]
        assert np.median(touched[:, place], axis=0) == pytest.approx([0.02, -0.03], abs=0.006)
