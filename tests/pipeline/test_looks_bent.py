"""A sheet that is bent is told as bent, though nothing was taught."""

from __future__ import annotations

from pathlib import Path

from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

FOLD = """format = 1
[script]
duration = "1600 ms"
[[bend]]
length = "30 mm"
angle = "40 deg"
start = "100 ms"
rise = "200 ms"
hold = "1200 ms"
fall = "100 ms"
"""


def test_a_bent_sheet_is_not_said_to_be_a_change_of_gain(tmp_path: Path) -> None:
    simulate(Script.from_toml(FOLD), Skin.load("textile-disc-8"), tmp_path / "fold.mcap")
    with SessionReader(tmp_path / "fold.mcap") as session:
        said = [result.problem for result in replayed(as_recorded(session), session)]
    assert sum("bent" in str(problem) for problem in said) > 12
    assert sum("gain" in str(problem) for problem in said) < 6
