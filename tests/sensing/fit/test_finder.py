"""Touches from data: unbiased, as sure as they say, as many as there are, and none in noise."""

from __future__ import annotations

from copy import copy
from functools import cache

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise, whitener
from tomoskin.core import Detection, FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import SpotFinder, SpotModel, position_bound, spots_of
from tomoskin.sensing.fit.unexplained import FrameWatch

NOTHING = np.zeros((208, 0))


@cache
def skin(**touch: object) -> Skin:
    """The sheet of the scene, as a skin."""
    return Skin.load("textile-disc-16").altered({"touch": {"method": "fit", **touch}})


@cache
def model(sign: str = "decrease") -> SpotModel:
    s = skin(sign=sign)
    return SpotModel.of(s, ForwardModel(s.mesh(), s.pattern(), s.contact_impedance, s.current))


def finder(**touch: object) -> SpotFinder:
    """One that has seen nothing yet; what it prepares is copied."""
    own = copy(_prepared(**touch))
    own.deforming, own.watch = copy(own.deforming), copy(own.watch)
    return own


@cache
def _prepared(**touch: object) -> SpotFinder:
    pressed = skin(**touch)
    return SpotFinder(model(pressed.touch.sign), pressed, skin().mesh(), covariance())


def data(spots: FloatArray) -> FloatArray:
    return model().response.changes([spots])[0]


def press(x: float, y: float, radius: float = 0.022, depth: float = -0.25) -> FloatArray:
    return spots_of([[x, y]], radius, depth)


def place(detection: Detection) -> FloatArray:
    return np.array([detection.x, detection.y])


def spread(detection: Detection) -> FloatArray:
    xx, yy, xy = detection.sd_x**2, detection.sd_y**2, detection.cov_xy
    return np.array([[xx, xy], [xy, yy]])


@pytest.mark.parametrize("radius", [0.0, 0.05, 0.085])
def test_unbiased_to_the_rim_and_as_good_as_can_be(radius: float) -> None:
    """Over many noises the mean is right to a part of its scatter, and that to the bound.

    The bound knows shape and direction of a touch, which are left open in the fit.
    """
    spot, count = press(radius, 0.01), 60
    clean = data(spot)
    found = [finder().push(clean + n, NOTHING)[0] for n in noise(16, count, 1)]
    errors = np.array([place(detection) - spot[0, :2] for detection in found])
    bound = position_bound(model().response, spot, whitener())[0]
    least = np.sqrt(np.trace(bound))
    assert np.linalg.norm(errors.mean(axis=0)) < 0.45 * least
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 1.5 * least


@pytest.mark.parametrize("uneven", [0.0, 0.15])
def test_ellipses_hold_what_they_say(uneven: float) -> None:
    """Of a sheet as it is modelled; and of one whose rows answer some percent more or less."""
    random, inside = np.random.default_rng(2), []
    for n in noise(16, 80, 3):
        x, y = random.uniform(-0.06, 0.06, 2)
        spot = press(x, y, random.uniform(0.016, 0.03), random.uniform(-0.4, -0.2))
        off = 1 + uneven * random.standard_normal(len(n))
        detection = finder().push(off * data(spot) + n, NOTHING)[0]
        error = place(detection) - [x, y]
        inside.append(error @ np.linalg.solve(spread(detection), error) < 4.605)
    assert 0.8 < np.mean(inside) < 0.99


def test_size_and_strength_come_with_the_place() -> None:
    (detection,) = finder().push(data(press(0.03, 0.04)), NOTHING)
    assert place(detection) == pytest.approx([0.03, 0.04], abs=1e-4)
    assert detection.area == pytest.approx(np.pi * 0.022**2, rel=0.05)
    assert detection.peak == pytest.approx(skin().conductivity * np.expm1(-0.25), rel=0.05)
    centres = skin().mesh().centroids[detection.cells]
    assert np.linalg.norm(centres - place(detection), axis=1).max() < 0.0225
    assert not detection.close


def test_nothing_is_found_in_noise() -> None:
    """At five deviations a false alarm is rare: on an idle sheet each frame begins with nothing."""
    ours = finder()
    assert [found for n in noise(16, 300, 4) if (found := ours.push(n, NOTHING))] == []


def test_a_lower_threshold_lets_noise_through_as_often_as_said() -> None:
    """What must exceed 3 deviations somewhere on the sheet does so in some frames."""
    alarms = [bool(finder(snr=3.0).push(n, NOTHING)) for n in noise(16, 60, 5)]
    assert 0 < np.mean(alarms) < 0.6


@pytest.mark.parametrize(
    "places",
    [
        [(-0.04, 0.0), (0.05, 0.01)],
        [(0.0, 0.05), (0.045, -0.03), (-0.05, -0.02)],
        [(0.06, 0.0), (0.0, 0.06), (-0.06, 0.0), (0.0, -0.06)],
    ],
)
def test_as_many_as_there_are(places: list[tuple[float, float]]) -> None:
    spots = np.concatenate([press(*p, radius=0.018) for p in places])
    found = finder().push(data(spots) + noise(16, 1, 6)[0], NOTHING)
    assert len(found) == len(places)
    apart = np.linalg.norm(spots[:, None, :2] - [place(r) for r in found], axis=2)
    assert apart.min(axis=1).max() < 0.006


def test_presses_that_look_like_a_rise_between_them_are_presses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    two = np.concatenate([press(-0.04, 0.0), press(0.05, 0.01)])
    dv = data(two) + noise(16, 1, 6)[0]
    expected = [place(detection) for detection in finder().push(dv, NOTHING)]
    monkeypatch.setattr(FrameWatch, "sign", lambda *_: "both")
    found = [place(detection) for detection in finder().push(dv, NOTHING)]
    assert len(found) == 2
    assert np.array(found) == pytest.approx(np.array(expected), abs=1e-6)


def test_one_strong_press_is_one() -> None:
    """What is left beside a press of hundreds of deviations is no second touch."""
    for n in noise(16, 4, 7):
        assert len(finder().push(data(press(0.07, 0.01, depth=-1.5)) + n, NOTHING)) == 1


def test_a_faint_press_far_from_strong_ones_is_found() -> None:
    """A wrong profile of the strong ones is no explanation of what is far from them."""
    strong = [press(x, y, depth=-0.8) for x, y in ((-0.06, 0.0), (0.06, 0.01))]
    both = np.concatenate([*strong, press(0.0, 0.05, radius=0.018, depth=-0.1)])
    for n in noise(16, 4, 3):
        assert len(finder().push(data(both) + n, NOTHING)) == 3


def test_two_at_one_place_are_one_or_said_to_be_close() -> None:
    spots = np.concatenate([press(0.0, 0.012, 0.012), press(0.0, -0.012, 0.012)])
    for n in noise(16, 4, 8):
        found = finder().push(data(spots) + n, NOTHING)
        assert len(found) == 1 or all(detection.close for detection in found)
        assert np.hypot(found[0].x, found[0].y) < 0.015


def test_only_the_sign_that_counts() -> None:
    rise = data(press(0.03, 0.0, depth=0.3))
    assert finder().push(rise, NOTHING) == []
    (detection,) = finder(sign="both").push(rise, NOTHING)
    assert detection.peak > 0


@pytest.mark.parametrize("first", [0, 6])
def test_a_rise_beside_a_press_is_no_touch(first: int) -> None:
    """Both at once, and the rise when the press has stood for so many frames."""
    ours, pressed = finder(), press(-0.04, 0.02)
    risen = np.concatenate([pressed, press(0.045, -0.01, depth=0.3)])
    n = noise(16, first + 6, 12)
    for k in range(first):
        assert len(ours.push(data(pressed) + n[k], NOTHING)) == 1
    for k in range(first, first + 6):
        (detection,) = ours.push(data(risen) + n[k], NOTHING)
        assert place(detection) == pytest.approx([-0.04, 0.02], abs=4e-3)
        assert "near 4" in (ours.watch.lifted_problem or "")
    assert ours.watch.rises
    assert len(ours.push(data(pressed) + n[0], NOTHING)) == 1
    assert not ours.watch.rises


def test_no_more_than_asked_for() -> None:
    spots = np.concatenate([press(-0.05, 0.0), press(0.05, 0.0)])
    assert len(finder(max_touches=1).push(data(spots), NOTHING)) == 1


def test_frames_follow_each_other() -> None:
    """A touch that moves, one more, one less: the same as each frame alone."""
    ours = finder()
    path = [
        *(press(-0.05 + 0.004 * step, 0.02) for step in range(6)),
        *(np.concatenate([press(-0.03, 0.02), press(0.05, -0.02)]) for _ in range(2)),
        press(0.05, -0.02),
        press(-0.06, -0.03),
    ]
    for spots, n in zip(path, noise(16, len(path), 9), strict=True):
        found = sorted((r.x, r.y) for r in ours.push(data(spots) + n, NOTHING))
        alone = sorted((r.x, r.y) for r in finder().push(data(spots) + n, NOTHING))
        assert np.array(found) == pytest.approx(np.array(alone), abs=1e-3)
    assert ours.push(noise(16, 1, 10)[0], NOTHING) == []


def test_rows_that_say_nothing_do_not_count() -> None:
    clean = data(press(0.03, 0.04))
    lost = np.arange(0, 208, 7)
    spoiled = clean.copy()
    spoiled[lost] = 1.0
    (detection,) = finder().push(spoiled, np.eye(208)[:, lost])
    assert place(detection) == pytest.approx([0.03, 0.04], abs=2e-4)
    (whole,) = finder().push(clean, NOTHING)
    assert detection.sd_x > whole.sd_x


def test_a_drift_along_a_known_direction_does_not_count() -> None:
    drift = model().response.reference[:, None]
    clean = data(press(0.03, 0.04))
    (detection,) = finder().push(clean + 0.01 * drift[:, 0], drift)
    assert place(detection) == pytest.approx([0.03, 0.04], abs=2e-4)


def test_a_skin_that_reads_more_is_the_same_skin() -> None:
    """Data and noise in proportion: the same place, size and strength."""
    clean = data(press(0.03, 0.04))
    louder = SpotFinder(model(), skin(), skin().mesh(), 9 * covariance(), gain=3.0)
    (one,), (other,) = finder().push(clean, NOTHING), louder.push(3 * clean, NOTHING)
    assert [other.x, other.y, other.sd_x, other.peak] == pytest.approx(
        [one.x, one.y, one.sd_x, one.peak], rel=1e-6
    )
