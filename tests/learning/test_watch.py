"""Rows that jump after the calibration, found without labels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from learning.labelled import RADIUS, ROWS, Floats, held, presses
from tomoskin import Locator, Pattern
from tomoskin.core import DataError
from tomoskin.learning import Watch
from tomoskin.learning.touch.calibration_health import STRANGE
from tomoskin.learning.touch.watch import LIVE, LostRows, without

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
    assert error(told[late], xy[late]) < 1.05 * error(locator.predict(dv[late])[0], xy[late])
    assert error(told[late], xy[late]) < 0.045


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


@pytest.mark.parametrize("times", [2, -20])
def test_a_row_of_another_gain_is_left_out_too(locator: Locator, times: float) -> None:
    dv, _ = presses(60, 5)
    dv[:, [3, 8]] *= times
    watch = Watch(locator, LIVE)
    watch(dv)
    assert watch.jumped.tolist() == [3, 8]
    assert "2 rows have jumped" in watch.health.findings[0]
    assert not watch.health.well
    assert not watch.health.broken, "without them the frames fit again, and most rows are left"
    assert watch.health.strangeness < STRANGE


def test_where_all_rows_are_off_by_as_much_none_is_blamed(locator: Locator) -> None:
    """Then it is the sheet, which remembers, or the press."""
    dv, _ = presses(60, 5, noise=0.25)
    watch = Watch(locator, LIVE)
    watch(dv)
    assert watch.jumped.tolist() == []


LOST = slice(0, 16)


def test_rows_that_are_missing_for_good_are_learnt_without(locator: Locator) -> None:
    dv, xy = presses(200, 5)
    dv[:, LOST] = np.nan
    watch = Watch(locator)
    told, covariance = watch(dv)
    np.testing.assert_allclose(told[2:], without(locator, np.arange(16)).predict(dv[2:])[0])
    assert held(told - xy, covariance) > 0.8


def test_a_live_run_goes_on_while_it_learns_without_rows(locator: Locator) -> None:
    """From which frame on is counted, so that a replay says the same."""
    dv, _ = presses(12, 5)
    dv[:, LOST] = np.nan
    reduced = LostRows(locator, (2, 8))
    assert all(reduced(frame) is locator for frame in dv[:9])
    later = reduced(dv[9])
    assert later is not locator
    assert not np.isin(later.features.rows, np.arange(16)).any()
    assert reduced(presses(1, 5)[0][0]) is locator, "all rows are back"
    dv[:, :36] = np.nan
    assert all(reduced(frame) is locator for frame in dv), "too few are left"


def test_a_frame_that_lacks_rows_is_less_sure(locator: Locator) -> None:
    dv, xy = presses(200, 5)
    whole = np.linalg.det(locator.predict(dv)[1])
    dv[:, LOST] = np.nan
    told, covariance = locator.predict(dv)
    assert np.median(np.linalg.det(covariance) / whole) > 2
    assert held(told - xy, covariance) > 0.8


def test_a_touch_that_comes_or_goes_says_nothing_of_the_calibration(locator: Locator) -> None:
    watch = Watch(locator)
    dv, _ = jumped(60)
    np.testing.assert_allclose(watch(dv, settled=False)[0], locator.predict(dv)[0])
    assert watch.health.presses == 0
    assert "touch 5 spots" in watch.health.findings[0]


def test_another_gain_of_every_channel_is_said(locator: Locator) -> None:
    dv, _ = presses(60, 5)
    gains = np.exp(1.2 * np.random.default_rng(4).normal(size=dv.shape[1]))
    watch = Watch(locator, LIVE)
    watch(dv * gains)
    assert not watch.health.well
    assert any("times worse than its own presses" in text for text in watch.health.findings)


@pytest.mark.data
def test_rows_that_jump_cost_a_hydrogel_little_though_nobody_watches(data_dir: Path) -> None:
    """A fifth of the rows is thirty times as large at once: maps of single rows count still."""
    with np.load(data_dir / "eskin_hydrogel_round" / "round16_single550.npz") as kept:
        dv, xy = kept["v_down"].astype(float) - kept["v_up"], 1e-3 * kept["xy_mm"].astype(float)
        pattern = Pattern.from_tables(kept["inj"], kept["meas"])
    calibrated = Locator.fit(dv[:300], xy[:300], pattern=pattern)
    dv[:, np.random.default_rng(5).permutation(dv.shape[1])[:38]] *= 30
    told = calibrated.predict(dv[350:450])[0]
    assert np.linalg.norm(told - xy[350:450], axis=1).mean() < 0.009
