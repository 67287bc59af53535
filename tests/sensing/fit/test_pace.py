"""Live: what moves is one touch, what it leaves behind is none, and a frame's work is bounded."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise
from sensing.fit.test_finder import NOTHING, data, model, place, press, skin, spread
from tomoskin.core import Detection, FloatArray
from tomoskin.sensing.fit import EXHAUSTIVE, LIVE, Pace, SpotFinder
from tomoskin.sensing.fit.expectation import Known
from tomoskin.sensing.fit.problem import Limits, Matched, Problem, Solver
from tomoskin.sensing.fit.spot_fit import Deficit, Fit

SCAN = 0.1
"""Seconds of a scan."""

STANDING = press(0.05, 0.0, depth=-0.5)
LEFT = 0.12
"""Part of a press that stays behind."""


def finder(pace: Pace = LIVE, scan_time: float = SCAN) -> SpotFinder:
    return SpotFinder(
        model(),
        skin(),
        skin().mesh(),
        covariance(),
        pace=replace(pace, scan_time=scan_time, interval=SCAN),
    )


def is_at(detection: Detection, x: float, y: float) -> bool:
    """Within three deviations, which are a few millimetres."""
    away = place(detection) - [x, y]
    return bool(away @ np.linalg.solve(spread(detection), away) < 9 and detection.sd_x < 5e-3)


def is_near(detection: Detection, spots: FloatArray) -> bool:
    """Within a radius."""
    return bool(np.linalg.norm(place(detection) - spots[0, :2]) < 0.012)


def moving(begin: FloatArray, end: FloatArray) -> FloatArray:
    """Rows of a press that goes from one place to the other while they are read."""
    response, pattern = model().response, model().response.state.model.pattern
    way = (response.times + 0.5)[:, None, None]
    each = response.changes(list(begin + np.unique(way, axis=0) * (end - begin)))
    return np.asarray(each[pattern.drive_index, np.arange(pattern.n_meas)])


def test_a_press_that_moves_during_a_scan_is_one_touch_in_the_middle_of_its_way() -> None:
    begin, end = (press(x, 0.03, depth=-0.6) for x in (0.015, 0.04))
    smeared = moving(begin, end) + noise(16, 1, 3)[0]
    (detection,) = finder().push(smeared, NOTHING)
    assert is_at(detection, 0.0275, 0.03)
    at_once = finder(EXHAUSTIVE).push(smeared, NOTHING)
    assert len(at_once) > 1 or not is_at(at_once[0], 0.0275, 0.03), "time tells"


def test_a_press_that_begins_during_a_scan_is_where_it_is() -> None:
    rising = model().response.times + 0.5
    grown = data(press(-0.03, 0.04)) * rising + noise(16, 1, 4)[0]
    (detection,) = finder().push(grown, NOTHING)
    assert is_at(detection, -0.03, 0.04)


def test_a_faint_press_that_goes_on_is_nearer_than_one_frame_tells() -> None:
    live, alone = finder(scan_time=0.02), finder(EXHAUSTIVE)
    missed: dict[SpotFinder, list[float]] = {live: [], alone: []}
    for step, n in enumerate(noise(16, 25, 9)):
        x = 0.001 * step - 0.05
        for ours, away in missed.items():
            (detection,) = ours.push(data(press(x, 0.0, depth=-0.12)) + n, NOTHING)
            away.append(float(np.hypot(detection.x - x, detection.y)))
    rms = {ours: float(np.sqrt(np.mean(np.square(away[5:])))) for ours, away in missed.items()}
    assert rms[live] < 0.8 * rms[alone]
    assert rms[alone] > 1e-3


def test_a_press_elsewhere_after_a_press_is_where_it_is() -> None:
    ours = finder()
    for n in noise(16, 3, 10):
        ours.push(data(STANDING) + n, NOTHING)
    (detection,) = ours.push(data(press(-0.05, 0.02)) + noise(16, 1, 11)[0], NOTHING)
    assert is_at(detection, -0.05, 0.02)


def test_presses_that_begin_together_are_told_apart_at_once() -> None:
    ours = finder()
    three = np.concatenate([press(-0.05, 0.0), press(0.05, 0.02), press(0.0, -0.06)])
    counts = [len(ours.push(data(three) + n, NOTHING)) for n in noise(16, 5, 5)]
    assert counts == [3, 3, 3, 3, 3]
    assert len(finder(EXHAUSTIVE).push(data(three), NOTHING)) == 3


class Counting:
    """A solver that counts its steps."""

    def __init__(self, solver: Solver) -> None:
        self._solver, self.table, self.steps = solver, solver.table, 0

    def keep(self, *matrices: FloatArray) -> Any:
        return self._solver.keep(*matrices)

    def expanded(self, spots: FloatArray) -> FloatArray:
        return self._solver.expanded(spots)

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        return self._solver.standing(left, fit)

    def standing_out(
        self, matched: Matched, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        return self._solver.standing_out(matched, fit, limits)

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        return self._solver.judged(problem, fit, uneven)

    def searched(self, *question: Any) -> None:
        """The search goes step by step, which comes to the same."""

    def settled(
        self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()
    ) -> Fit:
        self.steps += 1 + most
        return self._solver.settled(problem, spots, deficit, most, known)


def test_a_frame_has_a_bounded_number_of_steps() -> None:
    counting = Counting(model().solver)
    counted = replace(model())
    vars(counted)["solver"] = counting
    ours = SpotFinder(
        counted,
        skin(),
        skin().mesh(),
        covariance(),
        pace=replace(LIVE, scan_time=SCAN, interval=SCAN),
    )
    three = np.concatenate([press(-0.05, 0.0), press(0.05, 0.02), press(0.0, -0.06)])
    frames = [*[three] * 4, np.add(three, [0.01, 0.0, 0.0, 0.0]), STANDING, three]
    steps = []
    for spots, n in zip(frames, noise(16, len(frames), 6), strict=True):
        counting.steps = 0
        ours.push(data(spots) + n, NOTHING)
        steps.append(counting.steps)
    # the touches of before, less up to two, some more from two starts each, once more from nothing;
    # and with both signs, one more than that, since several begin at once
    exact = 1 + 2
    one = 1 + LIVE.warm + exact
    more = 2 * (1 + LIVE.glance) + 1 + LIVE.cold + exact
    search = 3 * one + (3 * LIVE.tries + 1) * more + 3
    # of the flat sheet, and beside up to three deformations that may explain it
    assert 0 < max(steps) <= (1 + 3) * search


def rested(ours: SpotFinder, left: FloatArray, count: int, seed: int) -> int:
    """How many of so many frames show a touch, in which this is left; the others are idle."""
    found = 0
    for n in noise(16, count, seed):
        touched = bool(ours.push(left + n, NOTHING))
        ours.learn(touched=touched)
        found += touched
    return found


def after_a_slide(pace: Pace) -> tuple[SpotFinder, list[Detection], FloatArray]:
    """A finder, what it finds of a press that has left a part of itself behind, and that part."""
    ours = finder(pace)
    here = data(STANDING)
    rested(ours, here, 3, 7)
    there = data(press(-0.04, 0.0)) + LEFT * here
    rested(ours, there, 2, 8)
    return ours, ours.push(there + noise(16, 1, 6)[0], NOTHING), LEFT * here


def test_what_is_left_behind_is_no_touch_beside_one() -> None:
    _, (detection,), _ = after_a_slide(LIVE)
    assert is_at(detection, -0.04, 0.0)
    _, alone, _ = after_a_slide(EXHAUSTIVE)
    assert len(alone) == 2, "frames by themselves show what there is"


def test_how_far_a_touch_stands_out_is_told_by_the_noise_alone() -> None:
    clean = data(STANDING)
    first, later = finder(), finder()
    (fresh,) = first.push(clean, NOTHING)
    for _ in range(3):
        (known,) = later.push(clean, NOTHING)
    assert known.snr == pytest.approx(fresh.snr, rel=0.05)


def test_what_is_left_is_no_touch_however_long_it_stays() -> None:
    ours, _, left = after_a_slide(LIVE)
    assert not rested(ours, left, 150, 9)


def test_what_is_left_beside_its_press_and_narrower_is_no_touch() -> None:
    ours, _, _ = after_a_slide(LIVE)
    elsewhere = LEFT * data(press(0.046, 0.004, depth=-0.5, radius=0.009))
    assert not rested(ours, elsewhere, 150, 9)


def test_what_is_left_may_fade() -> None:
    ours, _, left = after_a_slide(LIVE)
    for part in np.exp(-np.arange(40) * SCAN):
        assert not rested(ours, part * left, 1, round(1e3 * part))
    assert not ours.push(noise(16, 1, 11)[0], NOTHING)


def test_a_light_press_on_what_is_left_of_a_heavy_one_is_found() -> None:
    ours, _, left = after_a_slide(LIVE)
    rested(ours, left, 8, 9)
    light = left + 0.15 * data(STANDING)
    (detection,) = ours.push(light + noise(16, 1, 10)[0], NOTHING)
    assert is_near(detection, STANDING)
    assert not detection.weak


def test_a_press_that_comes_down_slowly_is_not_taken_for_what_is_left() -> None:
    ours, _, left = after_a_slide(LIVE)
    rested(ours, left, 8, 9)
    found = [
        rested(ours, left + part * data(STANDING), 1, 20 + k)
        for k, part in enumerate(np.linspace(0, 0.3, 30))
    ]
    assert all(found[15:])


def test_a_new_press_where_one_was_is_found() -> None:
    ours, _, left = after_a_slide(LIVE)
    frames = [left, left, 0.6 * data(STANDING), 0.6 * data(STANDING)]
    assert [rested(ours, dv, 1, 10 + k) for k, dv in enumerate(frames)] == [0, 0, 1, 1]


def test_a_press_on_what_is_left_is_told_against_the_untouched_skin() -> None:
    ours, _, left = after_a_slide(LIVE)
    rested(ours, left, 8, 9)
    (again,) = ours.push(data(STANDING) + noise(16, 1, 10)[0], NOTHING)
    (fresh,) = finder().push(data(STANDING) + noise(16, 1, 10)[0], NOTHING)
    content = [np.log1p(d.peak / skin().conductivity) * d.area for d in (again, fresh)]
    assert content[0] == pytest.approx(content[1], rel=0.01)
