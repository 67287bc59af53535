"""Touches by the method that the skin names: from the picture, or fitted to the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare, reconstruct
from tomoskin.pipeline.finding import InData, InImage, finding
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
    assert isinstance(finding(by_image, None), InImage)
    assert isinstance(finding(fitted, None), InData)


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


def test_noise_that_is_not_known_is_the_read_outs(fitted):
    """One idle frame, or none, tells no noise."""
    values = np.array([fitted.problem.reference])
    for reference in (None, Reference.of(values)):
        finder = finding(fitted, reference)
        assert isinstance(finder, InData)
    louder = replace(fitted, readout=replace(fitted.readout, noise=3 * fitted.readout.noise))
    quiet, loud = (finding(p, None)._spots._sight._noise for p in (fitted, louder))
    assert np.linalg.norm(loud) == pytest.approx(9 * np.linalg.norm(quiet), rel=0.1)
