"""Touches by the method that the skin names: from the picture, or fitted to the data."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare, reconstruct
from tomoskin.pipeline.finding import FitConditions, FitFinder, RegionFinder, finder_of
from tomoskin.sensing.fit import EXHAUSTIVE, LIVE
from tomoskin.sensing.signal import Recording, Reference

NEEDED = 10


@pytest.fixture(scope="module", params=["plain", "normalised"])
def fitted(request):
    """The skin of the room, its touches fitted."""
    changes = {"touch": {"method": "fit"}, "inverse": {"difference": request.param}}
    return prepare(Skin.load("textile-disc-8").altered(changes))


def frames(skin, samples, count, first=0, seed=0):
    """Frames of a board whose conversions are a little noisy."""
    random = np.random.default_rng(seed + first)
    for number in range(first, first + count):
        noisy = samples + np.round(random.normal(0, 3, len(samples)))
        ticks = round(0.05 * number * skin.readout.tick_rate)
        yield Frame(number, ticks, 0.05 * number, 1, 0, 0, noisy.astype(np.uint16))


def test_the_skin_file_chooses(fitted):
    by_image = prepare(fitted.skin.altered({"touch": {"method": "image"}}))
    assert isinstance(finder_of(by_image, None), RegionFinder)
    assert isinstance(finder_of(fitted, None), FitFinder)


def test_live_touches_are_where_the_skin_is_pressed(fitted):
    pipeline = Pipeline(fitted, reference_frames=NEEDED)
    for frame in frames(fitted.skin, samples_of(fitted), 2 * NEEDED):
        assert pipeline.push(frame).touches == ()
    touched = samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4))
    for frame in frames(fitted.skin, touched, 5, first=2 * NEEDED):
        result = pipeline.push(frame)
    (touch,) = result.touches
    assert [touch.detection.x, touch.detection.y] == pytest.approx([0.03, 0.02], abs=0.006)
    assert 0.0002 < touch.detection.sd_x < 0.006
    assert touch.detection.snr > 10
    assert touch.kind == "decrease"


def test_a_recording_gives_the_same_as_live(fitted):
    readout, pattern = fitted.readout, fitted.pattern
    idle = [readout(f).values for f in frames(fitted.skin, samples_of(fitted), NEEDED)]
    touched = samples_of(fitted, pressed(fitted, -0.02, 0.04, loss=0.4))
    values = [readout(f).values for f in frames(fitted.skin, touched, 3, first=NEEDED)]
    values[1][5] = np.nan
    recording = Recording(
        voltages=np.array(values),
        drive=pattern.drive,
        measure=pattern.measure,
        time=0.05 * np.arange(3.0),
        reference=None,
        labels=None,
        is_change=False,
        source="bench",
    )
    found = reconstruct(fitted, recording, np.array(idle))
    for (touch,) in found.touches:
        assert [touch.detection.x, touch.detection.y] == pytest.approx([-0.02, 0.04], abs=0.006)


def test_what_moves_in_a_scan_follows_the_pace_of_the_board(fitted):
    """A Pico scans in a fortieth of the Mega's time, whatever the skin file says."""
    values = np.array([fitted.problem.reference])
    reference = Reference.of(values)
    reach = {}
    for interval in (np.nan, 0.2, 1.4e-3):
        finder = finder_of(fitted, reference, LIVE, interval)
        beside = FitConditions(fitted, reference, fitted=False, interval=interval).touch_fit()
        assert isinstance(finder, FitFinder)
        assert beside is not None
        reach[interval] = finder.spots._reach
        other = inspect.getclosurevars(beside.detect).nonlocals["finder"]
        assert other.spots._reach == pytest.approx(EXHAUSTIVE.speed / LIVE.speed * reach[interval])
    assert reach[1.4e-3] == pytest.approx(1.4e-3 * LIVE.speed)
    assert reach[0.2] == reach[np.nan] == pytest.approx(0.055 * LIVE.speed, rel=0.1)


def test_noise_that_is_not_known_is_the_read_outs(fitted):
    """One idle frame, or none, tells no noise."""
    values = np.array([fitted.problem.reference])
    for reference in (None, Reference.of(values)):
        finder = finder_of(fitted, reference)
        assert isinstance(finder, FitFinder)
    louder = replace(fitted, readout=replace(fitted.readout, noise=3 * fitted.readout.noise))
    quiet, loud = (finder_of(p, None).spots._sight._noise for p in (fitted, louder))
    assert np.linalg.norm(loud) == pytest.approx(9 * np.linalg.norm(quiet), rel=0.1)
