"""A fold shows as touches in a line across the sheet, and that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import Detection, Touch
from tomoskin.extras.body.body_reader import looks_bent
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


def touches(*places: tuple[float, float]) -> tuple[Touch, ...]:
    return tuple(
        Touch(
            k, "decrease", 0.0, Detection(x, y, 1e-3, 1e-3, 1e-3, -0.1, np.empty(0, np.int64)), ()
        )
        for k, (x, y) in enumerate(places, start=1)
    )


@pytest.fixture(scope="module")
def disc():
    return Skin.load("textile-disc-8").mesh()


@pytest.mark.parametrize("turned", [0.0, 0.4, 1.3])
def test_a_line_across_is_doubted_and_three_fingers_are_not(disc, turned: float) -> None:
    turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])

    def at(*places: tuple[float, float]) -> tuple[Touch, ...]:
        return touches(*(tuple(turn @ np.array(place)) for place in places))

    fold = at((0.004, 0.095), (-0.004, -0.095), (0.0, 0.003))
    assert "bent" in str(looks_bent(fold, disc))
    assert looks_bent(fold[:2], disc) is None
    assert looks_bent(at((0.0, 0.095), (0.05, 0.0), (0.0, -0.095)), disc) is None  # no line
    assert looks_bent(at((0.0, 0.03), (0.0, -0.03), (0.0, 0.0)), disc) is None  # not across


def test_a_bent_sheet_is_not_said_to_be_a_change_of_gain(tmp_path: Path) -> None:
    simulate(Script.from_toml(FOLD), Skin.load("textile-disc-8"), tmp_path / "fold.mcap")
    with SessionReader(tmp_path / "fold.mcap") as session:
        said = [result.problem for result in replayed(as_recorded(session), session)]
    assert sum("bent" in str(problem) for problem in said) > 12
    assert sum("gain" in str(problem) for problem in said) < 6
