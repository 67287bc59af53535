"""Touches that slide: moved ahead while they go on, left alone where they stand."""

import numpy as np
import pytest

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track import SlideCorrection, likeliest_lag

LAG, SPEED = 0.011, 0.06


def touch(x, y=0.0, number=1):
    detection = Detection(x, y, 1e-3, 1e-3, 1e-3, -0.1, np.empty(0, np.int64), snr=40.0)
    return Touch(number, "decrease", 0.0, detection)


def found(places, interval=0.1, lag=LAG):
    """What each of ``places`` (n, 2) is reported as."""
    slides, reported = SlideCorrection(lag), []
    for k, (x, y) in enumerate(places):
        one = touch(x, y)
        slides = slides.after([one], k * interval)
        reported.append(slides.of_finger(one).detection)
    return reported


def followed(places, interval=0.1, lag=LAG):
    """How far (n, 2) each of ``places`` (n, 2) is moved."""
    return np.array([[one.x, one.y] for one in found(places, interval, lag)]) - places


def there_and_back(lag, strokes=12, interval=0.056):
    """Times (n,) s and responses (n, 2) m, with noise, of a finger that rubs to and fro."""
    turns = np.random.default_rng(2).uniform(0, 2 * np.pi, strokes)
    ways = np.repeat(np.column_stack([np.cos(turns), np.sin(turns)]), 293, axis=0)
    finger = np.cumsum(SPEED * interval / 10 * ways, axis=0)
    seen = (finger - lag * ways)[::10]  # it turns between two frames
    times = interval * np.arange(len(seen))
    return times, seen + 1e-3 * np.random.default_rng(3).normal(size=seen.shape)


@pytest.mark.parametrize("interval", [0.1, 0.025, 0.005])
@pytest.mark.parametrize("angle", [0.0, 2.1])
def test_a_touch_that_slides_is_moved_by_the_lag_along_its_way(interval, angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    steps = np.arange(round(1.5 / interval))[:, None]
    moved = followed(SPEED * interval * steps * along, interval)
    assert moved[0] == pytest.approx([0, 0])
    assert moved[-1] == pytest.approx(LAG * along, abs=8e-4)  # 16 directions


def test_what_the_sheet_does_as_a_finger_begins_and_stops():
    """It falls back by the lag as the finger begins to slide, and catches up as it stops."""
    finger = np.clip(SPEED * (0.05 * np.arange(54) - 0.575), 0.0, 0.09)
    sliding = (finger > 0.0) & (finger < 0.09)
    seen = finger - LAG * sliding
    moved = followed(np.column_stack([seen, np.zeros_like(seen)]), 0.05)[:, 0]
    error = np.abs(seen + moved - finger)
    assert (error[sliding][8:] < 1e-3).all()
    assert (error < LAG + 1e-9).all()
    assert (error[~sliding][:12] == 0).all()
    assert (error[~sliding][13:] == 0).all()  # one frame late


def test_a_turn_is_seen_at_once_and_widens_what_is_said():
    """The response jumps across by twice the lag as the finger turns back."""
    way = np.repeat([1.0, -1.0], 30)
    finger = np.cumsum(SPEED * 0.05 * way)
    places = np.column_stack([finger - LAG * way, np.zeros(60)])
    reported = found(places, 0.05)
    error = np.abs([one.x for one in reported] - finger)
    assert (error[34:] < 1e-3).all()
    deviation = np.array([one.sd_x for one in reported])
    assert deviation[30:33].max() > 1.1 * deviation[29]
    assert deviation[29] > 1e-3


@pytest.mark.parametrize("interval", [0.1, 0.05, 0.02])
def test_a_touch_that_stops_without_a_jump_is_let_go(interval):
    """As that of a sheet which has not lagged does, or of one that stays where it was dragged."""
    way = SPEED * interval * np.arange(round(1.0 / interval))
    places = np.column_stack(
        [np.append(way, np.full(round(0.5 / interval), way[-1])), np.zeros(round(1.5 / interval))]
    )
    moved = followed(places, interval)
    assert np.linalg.norm(moved[len(way) - 1]) > 0.8 * LAG
    assert not moved[len(way) + round(0.2 / interval) :].any()


def test_a_touch_that_stands_is_left_alone():
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((1000, 2))
    assert not followed(0.5e-3 * noise).any()
    assert np.sqrt(np.mean(followed(1e-3 * noise) ** 2)) < 0.3e-3
    slow = np.column_stack([0.01 * 0.1 * np.arange(50), np.zeros(50)])
    assert not followed(slow).any()
    assert not followed(np.column_stack([SPEED * 0.1 * np.arange(20), np.zeros(20)]), lag=0.0).any()


@pytest.mark.parametrize("lag", [0.008, 0.015])
def test_a_course_with_turns_tells_the_lag(lag):
    assert likeliest_lag(*there_and_back(lag)) == pytest.approx(lag, abs=2e-3)


def test_a_sheet_that_does_not_lag_has_none():
    assert likeliest_lag(*there_and_back(0.0)) < 1e-3


def test_touches_here_and_there_tell_no_lag():
    """Presses in no order, and frames whose times say nothing."""
    places = np.random.default_rng(5).uniform(-0.08, 0.08, (600, 2))
    assert likeliest_lag(0.05 * np.arange(600), places) == 0.0
    assert likeliest_lag(1.0 * np.arange(600), places) == 0.0


def test_touches_are_followed_by_their_identity_and_forgotten():
    slides = SlideCorrection(LAG)
    for k in range(15):
        slides = slides.after([touch(0.006 * k, 0.0, 1), touch(0.03, 0.03, 2)], 0.1 * k)
    assert slides.of_finger(touch(0.084, 0.0, 1)).detection.x == pytest.approx(
        0.084 + LAG, abs=1e-3
    )
    assert slides.of_finger(touch(0.03, 0.03, 2)).detection.x == 0.03
    assert set(slides.after([touch(0.03, 0.03, 2)], 1.5).fingers) == {2}
    assert not slides.after([], 1.5).fingers


@pytest.mark.parametrize("time", [5.0, 0.2])
def test_a_pause_or_another_clock_begins_anew(time):
    slides = SlideCorrection(LAG)
    for k in range(10):
        slides = slides.after([touch(0.006 * k)], 0.1 * k)
    slides = slides.after([touch(0.06)], time)
    assert slides.of_finger(touch(0.06)).detection.x == pytest.approx(0.06)
