"""Touches that come too close to separate, and come apart again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from sensing.track.detections import AREA, Run, detection
from tomoskin.core import Detection

LIMIT = 0.03
"""Closer than that, two regions are one."""


def seen(a: tuple[float, float], b: tuple[float, float]) -> list[Detection]:
    """What a blurred picture shows of two presses."""
    if np.hypot(a[0] - b[0], a[1] - b[1]) > LIMIT:
        return [detection(*a), detection(*b)]
    middle = 0.5 * (np.array(a) + b)
    return [detection(*middle, peak=-1.4, area=1.7 * AREA)]


def slide(run: Run, half: Callable[[float], float], seconds: float, lateral: float = 0.0) -> Run:
    """Two presses at ∓``half`` of the time along x, ``lateral`` apart along y."""
    times = np.arange(0, seconds, 1 / run.rate)
    ways = [(half(t), lateral / 2) for t in times]
    return run([seen((-x, -y), (x, y)) for x, y in ways])


@pytest.mark.parametrize("rate", [10, 40, 400])
def test_together_and_apart_again_are_the_same_two(rate: float) -> None:
    run = Run(rate)
    slide(run, lambda t: 0.04 - 0.03 * min(t, 1), 1.5)
    (touch,) = run.touches[-1]
    assert (touch.id, touch.merged, touch.said) == (1, (1, 2), "merged 1+2")
    slide(run, lambda t: 0.01 + 0.03 * min(t, 1), 1.5)
    assert [(t.id, t.merged) for t in run.touches[-1]] == [(1, ()), (2, ())]
    assert all(t.possible == (1, 2) for t in run.touches[-1]), "they are alike, and have rested"
    assert {t.said for t in run.touches[-1]} == {"1 or 2"}
    assert run.happened == [
        *(("onset", 1), ("onset", 2), ("merge", 1)),
        *(("split", 1), ("split", 2)),
    ]


def test_a_merge_says_whom() -> None:
    run = slide(Run(), lambda t: 0.04 - 0.03 * min(t, 1), 1.5)
    (merge,) = [e for e in run.events if e.kind == "merge"]
    assert merge.text == "touch 1: and 2 are too close to separate, at 0, 0 mm"


@pytest.mark.parametrize("rate", [10, 40])
def test_two_that_pass_each_other_swiftly_go_on_where_they_went(rate: float) -> None:
    run = slide(Run(rate), lambda t: 0.08 - 0.1 * t, 1.5, lateral=0.01)
    assert [(t.id, t.detection.x > 0) for t in run.touches[-1]] == [(1, True), (2, False)]


@pytest.mark.parametrize("rate", [10, 40])
def test_strengths_say_who_is_who(rate: float) -> None:
    """One is twice as strong: it is known again wherever it comes out."""
    for side in (1, -1):
        run, strong = Run(rate), 2.0
        times = np.arange(0, 1, 1 / rate)
        apart = [0.05 - 0.04 * t for t in times]
        run([[detection(-x, peak=-strong), detection(x)] for x in apart])
        run([[detection(-0.003, peak=-1 - strong)]] * round(0.4 * rate))
        back = [0.04 + 0.01 * t for t in times]
        run([[detection(-side * x, peak=-strong), detection(side * x)] for x in back])
        touches = sorted(run.touches[-1], key=lambda touch: touch.detection.peak)
        assert [(t.id, t.possible) for t in touches] == [(1, ()), (2, ())]


def test_a_touch_that_is_lifted_near_another_has_not_merged() -> None:
    run = Run()([[detection(-0.016), detection(0.016)]] * 10 + [[detection(-0.016)]] * 10)
    assert run.happened == [("onset", 1), ("onset", 2), ("release", 2)]


def test_both_end_when_the_merged_one_is_lifted() -> None:
    run = slide(Run(), lambda t: 0.04 - 0.03 * min(t, 1), 1.5)
    run([[]] * 5)
    assert run.shown[-1] == []
    assert run.happened[-2:] == [("release", 1), ("release", 2)]


def test_a_press_far_away_is_not_one_that_splits_off() -> None:
    run = slide(Run(), lambda t: 0.04 - 0.03 * min(t, 1), 1.5)
    run([[*seen((-0.01, 0), (0.01, 0)), detection(0, 0.09)]] * 4)
    assert [(t.id, t.merged) for t in run.touches[-1]] == [(1, (1, 2)), (3, ())]


def test_a_reading_that_may_be_several_is_said_to_be() -> None:
    run = Run()([[detection(0, close=True)]] * 3)
    assert run.touches[-1][0].said == "too close"


def test_three_become_one_and_three_again() -> None:
    def three(spread: float) -> list[Detection]:
        places = [(spread * np.cos(a), spread * np.sin(a)) for a in (0.5, 2.6, 4.7)]
        if spread > 0.02:
            return [detection(*place) for place in places]
        return [detection(0, 0, peak=-1.8, area=2.2 * AREA)]

    spreads = [*np.linspace(0.045, 0.01, 40), *[0.01] * 10, *np.linspace(0.01, 0.045, 40)]
    run = Run()([three(s) for s in spreads])
    assert any(t.merged == (1, 2, 3) for touches in run.touches for t in touches)
    assert [(t.id, t.merged) for t in run.touches[-1]] == [(1, ()), (2, ()), (3, ())]
    assert all(t.possible == (1, 2, 3) for t in run.touches[-1]), "they are alike"


def test_a_merged_touch_that_jumps_is_the_same() -> None:
    """What is seen of two that part may be either of them, far from their middle."""
    run = slide(Run(10), lambda t: 0.04 - 0.03 * min(t, 1), 1.5)
    run([[detection(-0.035), detection(0.035)]] * 4)
    assert [t.id for t in run.touches[-1]] == [1, 2]
