"""Rows that jump after the calibration, found without labels."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.labelled import RADIUS, ROWS, Floats, presses
from tomoskin import Locator
from tomoskin.calibration import Watch
from tomoskin.calibration.locator.health import BROKEN, STRANGE
from tomoskin.core import DataError

JUMPED = [3, 8, 21, 30, 35, 38]


@pytest.fixture(scope="module")
def locator() -> Locator:
    return Locator.fit(*presses(120, 0))


def jumped(n: int) -> tuple[Floats, Floats]:
    dv, xy = presses(n, 5)
    dv[:, JUMPED] *= -20
    return dv, xy


def error(told: Floats, xy: Floats) -> float:
    return float(np.linalg.norm(told - xy, axis=1).mean()) / RADIUS


def test_rows_that_jump_are_left_out_and_named(locator: Locator) -> None:
    dv, xy = jumped(120)
    watch = Watch(locator)
    told, covariance = watch(dv)
    assert covariance.shape == (120, 2, 2)
    assert set(watch.jumped.tolist()) == set(JUMPED)
    late = slice(40, None)
    assert error(told[late], xy[late]) < 0.3 * error(locator.predict(dv[late])[0], xy[late])
    assert error(told[late], xy[late]) < 0.06


def test_without_a_jump_the_answers_are_the_locator_s(locator: Locator) -> None:
    dv, _ = presses(200, 5)
    watch = Watch(locator)
    np.testing.assert_allclose(watch(dv)[0], locator.predict(dv)[0], atol=1e-9)
    assert watch.jumped.tolist() == []


def test_an_answer_rests_on_no_frame_to_come(locator: Locator) -> None:
    dv, _ = jumped(40)
    whole, watch = Watch(locator)(dv)[0], Watch(locator)
    one_by_one = np.concatenate([watch(frame)[0] for frame in dv[:25]])
    np.testing.assert_allclose(one_by_one, whole[:25], atol=1e-9)


def test_a_row_that_agrees_again_is_used_again(locator: Locator) -> None:
    watch = Watch(locator)
    watch(jumped(60)[0])
    assert len(watch.jumped)
    watch(presses(60, 7)[0])
    assert watch.jumped.tolist() == []


def test_one_touch_that_is_held_is_one_press(locator: Locator) -> None:
    """However strange a few rows of it are: they may be a firm press."""
    dv, _ = jumped(1)
    watch = Watch(locator)
    watch(np.repeat(dv, 100, axis=0))
    assert watch.jumped.tolist() == []


def test_where_most_rows_are_off_none_is_blamed(locator: Locator) -> None:
    watch = Watch(locator)
    watch(40 * np.random.default_rng(0).normal(size=(60, ROWS)))
    assert watch.jumped.tolist() == []


def test_frames_of_another_pattern_are_refused(locator: Locator) -> None:
    with pytest.raises(DataError, match="shape"):
        Watch(locator)(np.ones((2, ROWS + 1)))


def test_live_rows_are_left_out_only_where_frames_do_not_fit_with_them(locator: Locator) -> None:
    """What a sheet remembers doubles a row here and there; a broken wire does more."""
    for times, excluded in ((2, []), (-20, [3, 8])):
        dv, _ = presses(60, 5)
        dv[:, [3, 8]] *= times
        watch = Watch(locator, BROKEN)
        watch(dv)
        assert watch.jumped.tolist() == excluded
        assert watch.health.broken is bool(excluded)
    assert "2 rows have jumped" in watch.health.findings[0]
    assert watch.health.strangeness < STRANGE, "without them the frames fit again"


def test_a_touch_that_comes_or_goes_says_nothing_of_the_calibration(locator: Locator) -> None:
    watch = Watch(locator)
    dv, _ = jumped(60)
    np.testing.assert_allclose(watch(dv, settled=False)[0], locator.predict(dv)[0])
    assert watch.health.presses == 0
    assert "touch 5 spots" in watch.health.findings[0]


def test_another_gain_of_every_channel_is_said(locator: Locator) -> None:
    dv, _ = presses(60, 5)
    gains = np.exp(1.2 * np.random.default_rng(4).normal(size=dv.shape[1]))
    watch = Watch(locator, BROKEN)
    watch(dv * gains)
    assert not watch.health.well
    assert any("times worse than its own presses" in text for text in watch.health.findings)
