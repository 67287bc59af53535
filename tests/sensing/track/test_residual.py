"""What a press leaves behind is no touch; a light second press is."""

from __future__ import annotations

import numpy as np
import pytest

from sensing.track.detections import Run, detection
from tomoskin.core import Detection

LEFT = 0.15


def fading(seconds: float, rate: float, top: float = LEFT, x: float = 0.0) -> list[list[Detection]]:
    """What is left of a press of size 1: a part fades, a part stays."""
    times = np.arange(0, seconds, 1 / rate)
    return [[sized(top * (0.5 + 0.5 * np.exp(-t)), x)] for t in times]


def sized(size: float, x: float = 0.0) -> Detection:
    """A detection with the noise that a press of size 1 shows 100 times above."""
    return detection(x, peak=-size, snr=100 * size)


def lifted(rate: float) -> Run:
    """A press of two seconds, lifted over a tenth of a second."""
    fall = [[sized(s)] for s in np.linspace(1, LEFT, max(int(0.1 * rate), 2))]
    return Run(rate)([[sized(1)]] * int(2 * rate) + fall)


@pytest.mark.parametrize("rate", [10, 40, 200])
def test_a_press_ends_although_something_is_left(rate: float) -> None:
    run = lifted(rate)([*fading(20, rate)])
    assert run.happened == [("onset", 1), ("release", 1)]
    ended = next(k for k, ids in enumerate(run.shown) if not ids)
    assert ended / rate < 0.25


def test_a_press_that_a_fit_cuts_in_two_goes_on() -> None:
    """Its parts overlap: each stands out little where the other is given, but changes as much."""
    parts = [detection(0.0, peak=-0.9, snr=10.0), detection(0.012, peak=-0.1, snr=9.0)]
    run = Run(10)([[sized(1)]] * 20 + [parts] * 2 + [[sized(1)]] * 10)
    assert run.happened == [("onset", 1)]


def test_a_press_ends_though_a_fit_takes_what_is_left_for_much() -> None:
    """It is wide and stands out little: alone, how far it stands out is known better."""
    left = detection(0.0, peak=-0.6, snr=15.0)
    run = Run(10)([[sized(1)]] * 20 + [[left]] * 10)
    assert run.happened == [("onset", 1), ("release", 1)]


def test_what_is_left_may_come_and_go() -> None:
    """At the edge of the noise; outshone by another; after a second of nothing."""
    run = lifted(40)(fading(2, 40))
    run([[detection(0.08)]] * 40)
    run([[sized(0.08)], []] * 40)
    assert run.happened == [("onset", 1), ("release", 1), ("onset", 2), ("release", 2)]


@pytest.mark.parametrize("rate", [10, 40, 200])
def test_what_is_left_is_known_again_after_a_few_frames_without_it(rate: float) -> None:
    """A finder loses what is faint, and finds it as it was."""
    run = lifted(rate)(fading(1, rate))
    run([*[[]] * round(0.2 * rate), *fading(2, rate, top=LEFT / 2)] * 3)
    assert run.happened == [("onset", 1), ("release", 1)]


@pytest.mark.parametrize("press", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("after", [0.3, 5.0])
def test_a_second_press_at_the_same_place_is_found(press: float, after: float) -> None:
    run = lifted(40)(fading(after, 40))
    rise = [[sized(LEFT / 2 + s)] for s in np.linspace(0, press, 8)]
    run(rise + [[sized(LEFT / 2 + press)]] * 40)
    assert run.happened == [("onset", 1), ("release", 1), ("onset", 2)]


def test_a_light_press_where_nothing_was_left_is_found() -> None:
    run = lifted(40)([[]] * 40 + [[sized(0.1)]] * 20)
    assert run.happened[-1] == ("onset", 2)


def test_a_light_press_elsewhere_is_found() -> None:
    run = lifted(40)([[sized(LEFT), sized(0.1, 0.06)]] * 20)
    assert ("onset", 2) in run.happened


def test_a_change_of_the_other_sign_is_found() -> None:
    run = lifted(40)([[]] * 10 + [[detection(0, peak=0.15)]] * 20)
    assert run.happened[-1] == ("onset", 2)


def test_a_hand_that_grows_light_slowly_is_still_there() -> None:
    slow = [[sized(s)] for s in np.linspace(1, 0.2, 400)]
    run = Run(40)([[sized(1)]] * 40 + slow + [[sized(0.2)]] * 400)
    assert run.happened == [("onset", 1)]


def test_a_press_that_creeps_in_is_drift_of_what_was_left() -> None:
    run = lifted(10)(fading(5, 10))
    run([[sized(0.075 + 0.02 * t / 60)] for t in np.arange(0, 300, 0.1)])
    assert run.happened == [("onset", 1), ("release", 1)]


def test_a_slide_leaves_a_trail() -> None:
    way = np.linspace(0, 0.1, 80)
    run = Run(40)([[sized(1, x)] for x in way] + [[sized(0.15, 0.1)]] * 4)
    for x in (0.1, 0.05, 0.01):
        run([[sized(0.15, x)]] * 8)
    assert run.happened == [("onset", 1), ("release", 1)]


def test_a_reset_forgets_what_was_left() -> None:
    run = lifted(40)(fading(1, 40))
    run.tracker.reset()
    run([[sized(LEFT)]] * 4)
    assert run.happened[-1] == ("onset", 2)


def test_what_a_press_leaves_while_it_still_slides_is_no_touch() -> None:
    """As a fit sees it: its depth is anyone's guess, how far it stands out is not."""
    way = np.linspace(0, 0.1, 80)
    trail = detection(0.0, peak=-0.8, snr=8.0)
    run = Run(40)([[sized(1, x), trail] if x > 0.04 else [sized(1, x)] for x in way])
    assert run.happened == [("onset", 1)]
    run([[sized(1, 0.1), detection(0.0, peak=-0.3, snr=40.0)]] * 8)
    assert run.happened == [("onset", 1), ("onset", 2)]


def test_what_shrinks_to_a_remainder_before_it_is_reported_is_no_touch() -> None:
    """A fit may take what a slide leaves for more than it is in a single frame."""
    run = Run(20)([[sized(1, 0.012 * k)] for k in range(6)])
    run([[sized(1, 0.07), sized(0.5)], [sized(1, 0.07), sized(LEFT)], [sized(1, 0.07)]] * 4)
    assert run.happened == [("onset", 1)]
