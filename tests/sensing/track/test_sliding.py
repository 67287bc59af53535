"""Touches that slide: moved ahead while they go on, left alone where they stand."""

import numpy as np
import pytest

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track import SlideCorrection

LAG, SPEED = 0.011, 0.06


def touch(x, y=0.0, number=1):
    detection = Detection(x, y, 1e-3, 1e-3, 1e-3, -0.1, np.empty(0, np.int64), snr=40.0)
    return Touch(number, "decrease", 0.0, detection)


def followed(places, interval=0.1, lag=LAG):
    """How far (n, 2) each of ``places`` (n, 2) is moved."""
    slides, moved = SlideCorrection(lag), []
    for k, (x, y) in enumerate(places):
        one = touch(x, y)
        slides = slides.after([one], k * interval)
        found = slides.of_finger(one).detection
        moved.append((found.x - x, found.y - y))
    return np.array(moved)


@pytest.mark.parametrize("interval", [0.1, 0.025, 0.005])
@pytest.mark.parametrize("angle", [0.0, 2.1])
def test_a_touch_that_slides_is_moved_by_the_lag_along_its_way(interval, angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    steps = np.arange(round(1.5 / interval))[:, None]
    moved = followed(SPEED * interval * steps * along, interval)
    assert moved[0] == pytest.approx([0, 0])
    assert moved[-1] == pytest.approx(LAG * along, abs=1e-9)


def test_what_the_sheet_does_as_a_finger_begins_and_stops():
    """It falls back by the lag as the finger begins to slide, and catches up as it stops."""
    finger = np.concatenate([np.zeros(6), SPEED * 0.1 * np.arange(1, 16), np.full(6, 0.09)])
    sliding = np.diff(finger, prepend=0.0) > 0
    seen = finger - LAG * sliding
    moved = followed(np.column_stack([seen, np.zeros_like(seen)]))[:, 0]
    error = np.abs(seen + moved - finger)
    assert (error[sliding][4:] < 1e-9).all()
    assert (error[sliding] < LAG + 1e-9).all()
    assert (error[~sliding][:6] == 0).all()
    assert (error[~sliding][7:] < 1e-9).all()  # one frame late


def test_a_touch_that_stands_is_left_alone():
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((1000, 2))
    assert not followed(0.5e-3 * noise).any()
    assert np.sqrt(np.mean(followed(1e-3 * noise) ** 2)) < 0.3e-3
    slow = np.column_stack([0.01 * 0.1 * np.arange(50), np.zeros(50)])
    assert not followed(slow).any()
    assert not followed(np.column_stack([SPEED * 0.1 * np.arange(20), np.zeros(20)]), lag=0.0).any()


def test_touches_are_followed_by_their_identity_and_forgotten():
    slides = SlideCorrection(LAG)
    for k in range(10):
        slides = slides.after([touch(0.006 * k, 0.0, 1), touch(0.03, 0.03, 2)], 0.1 * k)
    assert slides.of_finger(touch(0.054, 0.0, 1)).detection.x == pytest.approx(0.054 + LAG)
    assert slides.of_finger(touch(0.03, 0.03, 2)).detection.x == 0.03
    assert set(slides.after([touch(0.03, 0.03, 2)], 1.0).courses) == {2}
    assert not slides.after([], 1.0).courses


@pytest.mark.parametrize("time", [5.0, 0.2])
def test_a_pause_or_another_clock_begins_anew(time):
    slides = SlideCorrection(LAG)
    for k in range(10):
        slides = slides.after([touch(0.006 * k)], 0.1 * k)
    slides = slides.after([touch(0.06)], time)
    assert len(slides.courses[1]) == 1
    assert slides.of_finger(touch(0.06)).detection.x == 0.06
