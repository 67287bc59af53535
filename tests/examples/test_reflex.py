"""The arm that draws back: its kinematics, and a few presses on the twin."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

PRESSES = 3


@pytest.fixture
def reflex(imported: Callable[[str], ModuleType]) -> ModuleType:
    return imported("reflex")


def point(links: tuple[float, float], angles: np.ndarray, along: float) -> np.ndarray:
    fore = angles.sum()
    upper = links[0] * np.array([np.cos(angles[0]), np.sin(angles[0])])
    return np.asarray(upper + along * np.array([np.cos(fore), np.sin(fore)]))


def test_the_jacobian_is_the_derivative(reflex: ModuleType) -> None:
    arm, along, step = reflex.Arm(), 0.17, 1e-6
    for joint in range(2):
        moved = step * np.eye(2)[joint]
        there = point(reflex.LINKS, arm.angles + moved, along)
        back = point(reflex.LINKS, arm.angles - moved, along)
        assert arm.jacobian(along)[:, joint] == pytest.approx((there - back) / (2 * step))


@pytest.mark.parametrize("along", [0.05, 0.125, 0.2])
def test_the_touched_point_goes_against_the_normal(reflex: ModuleType, along: float) -> None:
    arm = reflex.Arm()
    speed = arm.jacobian(along) @ arm.retreat(along)
    assert speed @ arm.normal() == pytest.approx(-reflex.SPEED)


def test_each_press_is_answered(reflex: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    found = reflex.main(["--presses", str(PRESSES)])
    assert found["answered"] == found["presses"] == PRESSES
    assert 0 < found["contact to command, ms"] <= found["the slowest, ms"]
    assert "contact to command" in capsys.readouterr().out
