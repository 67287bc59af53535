"""What a touch is held to be while it is lifted, while it slides, and where it is faint."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from sensing.track.detections import Run, detection
from tomoskin.core import Amount, Detection

COVARIANCE = ("sd_x", "sd_y", "cov_xy", "bias", "lasting")
"""What is told of a touch otherwise than of its detection."""


@pytest.mark.parametrize("rate", [10, 40])
def test_a_release_does_not_throw_the_touch_across_the_skin(rate: float) -> None:
    """What is left is the sheet's own and then noise: 57 mm away at 14 deviations, once."""
    run = Run(rate)([[detection(0.0, snr=40.0)]] * 20)
    before = run.touches[-1][0].detection
    fading = ((0.004, 24), (0.012, 12), (0.02, 8), (0.03, 3.4))
    run([[detection(x, snr=snr, peak=-snr / 40)] for x, snr in fading])
    shown = [touches[0].detection for touches in run.touches]
    deviations = [d.sd_x for d in shown]
    assert all(abs(d.x) < min(0.01, 3 * d.sd_x) for d in shown)
    assert [before.sd_x, *deviations] == sorted([before.sd_x, *deviations])
    assert [e.kind for e in run.events] == ["onset"], "no move is told of a release"


@pytest.mark.parametrize("rate", [10, 40])
def test_a_strong_touch_is_where_its_detection_is(rate: float) -> None:
    """Nothing is filtered: it is as prompt as the finder."""
    path = 0.1 / rate * np.arange(30)
    run = Run(rate)([[detection(x, x / 2)] for x in path])
    got = [(t.detection.x, t.detection.y) for touches in run.touches for t in touches]
    assert got == [(x, x / 2) for x in path]


def test_a_slide_is_uncertain_by_how_far_the_sheet_is_dragged() -> None:
    """By 12 mm in the plane, not quite along its course. So it stays."""
    run = Run()([[detection(0.001 * k)] for k in range(40)] + [[detection(0.039)]] * 80)
    for touches in (run.touches[39], run.touches[-1]):
        shown = touches[0].detection
        assert math.hypot(shown.sd_x, shown.sd_y) == pytest.approx(
            math.hypot(0.012, 2**0.5 * 1e-3), rel=0.05
        )
        assert shown.sd_x == pytest.approx(shown.sd_y)
    resting = Run()([[detection(0.0)]] * 40).touches[-1][0].detection
    assert (resting.sd_x, resting.sd_y) == pytest.approx((0.001, 0.001), rel=0.01)


def test_a_slide_that_jumps_back_and_passes_its_beginning_is_still_a_slide() -> None:
    course = [0.0] * 20 + [-0.012 + 0.003 * k for k in range(10)]
    run = Run()([[detection(x)] for x in course])
    assert all(touches[0].detection.sd_x > 0.007 for touches in run.touches[20:])


def test_a_press_that_is_first_seen_faintly_has_not_slid() -> None:
    """It comes down, and is known better with each frame: where that began says nothing more."""
    course = [(0.009, 0.010), (0.004, 0.005)] + [(0.0, 0.002)] * 40
    run = Run()([[detection(x, sd_x=sd, sd_y=sd)] for x, sd in course])
    shown = run.touches[-1][0].detection
    assert (shown.sd_x, shown.sd_y) == pytest.approx((0.002, 0.002), rel=0.01)
    away = run([[detection(0.002 * k, sd_x=0.002, sd_y=0.002)] for k in range(15)])
    assert away.touches[-1][0].detection.sd_x > 0.008, "what comes later is a slide"


def test_a_faint_detection_far_off_is_noise() -> None:
    vague = {"sd_x": 0.005, "sd_y": 0.005}
    run = Run()([[detection(0.0, snr=5.5, **vague)]] * 20 + [[detection(0.045, snr=4.0, **vague)]])
    ((touch,),) = run.touches[-1:]
    assert touch.detection.x < 0.01


def test_a_press_that_stays_lighter_is_followed_again() -> None:
    """After about a second, in which a sheet recovers."""
    lighter = detection(0.01, snr=25.0, peak=-0.5)
    run = Run()([[detection(0.0, snr=50.0)]] * 20 + [[lighter]] * 60)
    assert run.touches[20][0].detection.x < 0.005
    assert run.touches[-1][0].detection.x == pytest.approx(0.01, abs=0.0015)


def test_a_touch_that_stands_out_less_beside_others_is_where_its_detection_is() -> None:
    """Others take up a part of what it does to the voltages, and it presses as before."""
    alone, beside = detection(0.0, snr=50.0), detection(0.01, snr=15.0)
    run = Run()([[alone]] * 20 + [[beside, detection(0.08)]] * 3)
    assert [touches[0].detection.x for touches in run.touches[20:]] == [0.01] * 3


def test_what_is_off_without_noise_is_told() -> None:
    shown = Run()([[detection(0.0, sd_x=0.003, bias=0.004)]] * 3).touches[-1][0].detection
    assert shown.sd_x == pytest.approx(0.005, rel=0.01)
    assert shown.bias == 0.0


NOISE, LASTING = 0.002, 0.001
"""Deviations along an axis, m, of what differs between frames and of what does not."""


def standing(
    rate: float, seconds: float, noise: float, seed: int, way: float = 0.0
) -> list[Detection]:
    """Where a finger is shown that stands at 0, and ``way`` m along x in the second half."""
    rng = np.random.default_rng(seed)
    whole, lasting = math.hypot(noise, LASTING), (LASTING**2, 0.0, LASTING**2)
    frames = []
    for number in range(round(seconds * rate)):
        x, y = noise * rng.standard_normal(2) + (way * (number >= seconds * rate / 2), 0.0)
        d = detection(float(x), float(y), sd_x=whole, sd_y=whole, snr=60.0, lasting=lasting)
        frames.append([d])
    return [touches[0].detection for touches in Run(rate)(frames).touches]


@pytest.mark.parametrize("rate", [5, 20, 100])
@pytest.mark.parametrize("noise", [3e-4, NOISE, 6e-3])
def test_what_noise_makes_unsure_of_a_finger_that_stands_falls_with_time(
    rate: float, noise: float
) -> None:
    shown = standing(rate, 20.0, noise, seed=1)
    late = shown[len(shown) // 2 :]
    off = np.array([math.hypot(d.x, d.y) for d in late])
    assert np.sqrt(np.mean(off**2)) < max(0.45 * math.hypot(noise, noise), 1.5e-4)
    usual = float(np.median([d.sd_x for d in late]))
    assert LASTING < usual < math.hypot(LASTING, 0.45 * noise + 1.5e-4), "what lasts stays"


@pytest.mark.parametrize("rate", [5, 20, 100])
@pytest.mark.parametrize("noise", [3e-4, NOISE, 6e-3])
def test_noise_of_a_finger_that_stands_is_no_slide(rate: float, noise: float) -> None:
    """A slide would be remembered for a second: 8.5 mm along each axis."""
    for seed in range(2, 5):
        shown = standing(rate, 60.0, noise, seed=seed)
        high = np.array([d.sd_x for d in shown]) > 0.007 + noise
        assert not np.any(high[2:] & high[1:-1] & high[:-2]), "a frame at a time may be in doubt"


@pytest.mark.parametrize("rate", [10, 20, 100])
@pytest.mark.parametrize("way", [0.004, 0.006, 0.008])
def test_a_short_slide_that_one_frame_cannot_tell_from_noise_is_held_and_told(
    rate: float, way: float
) -> None:
    """Frames that agree on where it ends tell it, and ± is wide until they do."""
    inside, late = [], []
    for seed in range(5, 10):
        shown = standing(rate, 6.0, NOISE, seed=seed, way=way)[round(3 * rate) :]
        inside += [_in_ellipse(d, way) for d in shown]
        late.append(np.mean([d.x for d in shown[-round(rate) :]]))
    assert np.mean(inside) > 0.84
    assert np.median(late) == pytest.approx(way, abs=1.2e-3), "it stands where it has come to"


def _in_ellipse(d: Detection, x: float) -> bool:
    """Whether the ellipse of 90 % holds (x, 0)."""
    covariance = [[d.sd_x**2, d.cov_xy], [d.cov_xy, d.sd_y**2]]
    off = np.array([d.x - x, d.y])
    return bool(off @ np.linalg.solve(covariance, off) < 4.605)


@pytest.mark.parametrize("rate", [10, 40])
def test_a_finger_that_has_stood_for_long_and_slides_is_followed_at_once(rate: float) -> None:
    """Neither its mean of many frames nor its small covariance hold it back."""
    lasting = (LASTING**2, 0.0, LASTING**2)
    still, path = [0.0] * 200, 0.01 + 0.06 / rate * np.arange(20)
    course = [[detection(x, sd_x=NOISE, sd_y=NOISE, lasting=lasting)] for x in (*still, *path)]
    shown = [touches[0].detection for touches in Run(rate)(course).touches]
    assert abs(shown[200].x - path[0]) < 0.003
    assert shown[200].sd_x > 0.005
    assert [d.x for d in shown[203:]] == pytest.approx(list(path[3:]), abs=1e-6)
    assert all(d.sd_x > 0.008 for d in shown[203:])


def test_all_else_of_a_detection_is_kept() -> None:
    """Field by field, those of a later version too: a new one is missed here."""
    amounts = {"force": Amount(2.0, 1.0, 3.0), "depth": Amount(1e-3, 0.5e-3, 2e-3)}
    given = detection(0.0, close=True, weak=False, cov_xy=1e-7, **amounts)
    shown = Run()([[given]] * 3).touches[-1][0].detection
    assert shown is not given
    for name in {f.name for f in fields(given)} - {"x", "y", *COVARIANCE}:
        assert getattr(shown, name) is getattr(given, name), name
