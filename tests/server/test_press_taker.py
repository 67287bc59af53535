"""Presses taken from a stream of voltages, clear ones and faint ones, and what is said else."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tomoskin.server.guided_flow import GuidedPress
from tomoskin.server.press_flow import estimate_touch
from tomoskin.server.press_taker import PressTaker

Floats = NDArray[np.float64]

ROWS, NOISE, PERIOD = 60, 1e-5, 0.05
SHAPE = np.random.default_rng(3).normal(0.5, 1, size=ROWS)
SHAPE /= np.sqrt((SHAPE**2).mean())


class Skin:
    """Frames of a skin, noise and all; a press is as many noises as it is deep."""

    def __init__(self, seed: int = 0) -> None:
        self.taker = PressTaker(0.1 * NOISE)
        self._rng, self._time = np.random.default_rng(seed), 0.0

    def frames(
        self, count: int, noises: float = 0.0, shape: Floats = SHAPE, *, touched: bool = False
    ) -> list[Floats]:
        """What was taken in the next frames."""
        found = (self._frame(noises * shape, touched=touched) for _ in range(count))
        return [dv for dv in found if dv is not None]

    @property
    def phase(self) -> str:
        """What whoever presses is to do."""
        return self.taker.phase

    def _frame(self, noises: Floats, *, touched: bool) -> Floats | None:
        self._time += PERIOD
        volts = 1 + NOISE * (noises + self._rng.normal(size=ROWS))
        return self.taker.push(self._time, volts, touched=touched)


@pytest.fixture(params=range(5))
def skin(request: pytest.FixtureRequest) -> Skin:
    skin = Skin(request.param)
    skin.frames(60)
    return skin


def amplitude(dv: Floats) -> float:
    return float(dv @ SHAPE / ROWS / NOISE)


def test_a_clear_press_is_taken_soon(skin: Skin) -> None:
    (dv,) = skin.frames(12, 20)
    assert amplitude(dv) == pytest.approx(20, abs=0.5)
    assert skin.phase == "release"
    assert skin.frames(40, 20) == []
    skin.frames(30)
    assert skin.phase == "press"


@pytest.mark.parametrize("noises", [0.7, 1.2, 2.0])
def test_a_faint_press_is_averaged_for_longer(skin: Skin, noises: float) -> None:
    """One frame of it does not stand out, and 0.7 noises are four in the mean of forty frames."""
    (dv,) = skin.frames(70, noises)
    assert amplitude(dv) == pytest.approx(noises, abs=0.15)
    skin.frames(60)
    assert skin.phase == "press", "it was seen to end"


def test_the_end_of_a_press_that_was_not_seen_is_none(skin: Skin) -> None:
    """It has passed for the untouched skin: what comes then has the other sign."""
    skin.taker = PressTaker(0.1 * NOISE, sign=1)
    skin.frames(60, 20)
    assert skin.frames(60) == []
    assert skin.phase == "press"
    assert "too faint to be seen" in skin.taker.hint
    assert len(skin.frames(12, 20)) == 1


def test_a_touch_that_shows_does_not_pass_for_the_untouched_skin(skin: Skin) -> None:
    """Who holds on when the flow begins, or presses again too soon, is asked to let go."""
    skin.taker = PressTaker(0.1 * NOISE, sign=1)
    skin.frames(100, 20, touched=True)
    assert skin.phase == "rest"
    assert "Let go" in skin.taker.hint
    skin.frames(30)
    assert skin.phase == "press"
    assert not skin.taker.hint
    assert len(skin.frames(12, 20, touched=True)) == 1


def test_a_touch_that_never_ends_may_be_none(skin: Skin) -> None:
    skin.taker = PressTaker(0.1 * NOISE, sign=1)
    skin.frames(300, 20, touched=True)
    assert skin.phase == "press"
    assert "take the reference again" in skin.taker.hint
    assert len(skin.frames(12, 40, touched=True)) == 1, "a press beside it"
    skin.taker = PressTaker(0.1 * NOISE, sign=1)
    skin.frames(300, 20, touched=True)
    skin.frames(30)
    assert skin.phase == "press"
    assert "faint" not in skin.taker.hint, "it was a touch, and has ended"


def test_nothing_is_taken_of_an_untouched_skin(skin: Skin) -> None:
    assert skin.frames(1000) == []


def test_a_press_that_shows_nothing_is_said(skin: Skin) -> None:
    assert skin.frames(150, 0.1) == []
    assert "then press a little harder" in skin.taker.hint


def test_a_press_that_moves_is_said(skin: Skin) -> None:
    """A finger that slides: each row of the skin has its turn."""
    for k in range(120):
        assert skin.frames(1, 20, np.roll(SHAPE, k // 2)) == []
    assert "still change" in skin.taker.hint


def test_a_press_that_ends_too_early_is_said_and_the_next_one_is_taken(skin: Skin) -> None:
    assert skin.frames(4, 20) == []
    skin.frames(30)
    assert skin.phase == "press"
    assert "too early" in skin.taker.hint
    assert len(skin.frames(12, 20)) == 1
    assert not skin.taker.hint


def test_a_skin_that_does_not_come_back_is_said_and_can_be_begun_anew(skin: Skin) -> None:
    """As after a faint press that had passed for the untouched skin."""
    assert len(skin.frames(12, 20)) == 1
    skin.frames(150, 15)
    assert "undo this press" in skin.taker.hint
    skin.taker.restart()
    skin.frames(30, 15)
    assert skin.phase == "press"


def test_it_is_said_when_newer_presses_do_not_fit_with_the_older_ones(prepared):
    """Each of the newer ones was made on the dot before."""
    mesh, sheet = prepared.mesh, -0.1 * prepared.skin.conductivity
    random = np.random.default_rng(1)
    away, turn = 0.08 * np.sqrt(random.uniform(size=40)), random.uniform(0, 2 * np.pi, 40)
    dots = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
    far = np.linalg.norm(mesh.centroids - dots[:, None], axis=-1)
    dv = sheet * np.exp(-((far / 0.015) ** 2)) @ prepared.problem.jacobian.T
    right = [GuidedPress((x, y), one) for (x, y), one in zip(dots.tolist(), dv, strict=True)]
    assert "do not fit" not in estimate_touch(prepared, right).text
    late = np.vstack([dv[:20], np.roll(dv[20:], 1, axis=0)])
    wrong = [GuidedPress((x, y), one) for (x, y), one in zip(dots.tolist(), late, strict=True)]
    assert "the newer ones do not fit with them. Take back" in estimate_touch(prepared, wrong).text
