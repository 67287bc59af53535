"""Sick electrodes, drift and common modes in the running pipeline, and the same off-line."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest

from golden import mismatch
from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare, reconstruct
from tomoskin.sensing.signal import Recording, nuisance_directions

NEEDED = 20
PLACE = (0.03, 0.02)
CUT = 3
RAIL = 16 * 1023


@pytest.fixture(scope="module")
def sixteen():
    return prepare(Skin.load("textile-disc-16").altered({"mesh": {"cells": 600}}))


@pytest.fixture(scope="module")
def resting(sixteen):
    return samples_of(sixteen)


@pytest.fixture(scope="module")
def touched(sixteen):
    return samples_of(sixteen, pressed(sixteen, *PLACE))


class Feed:
    """A pipeline, and frames for it at ten a second with two counts of noise."""

    def __init__(self, prepared):
        self.prepared, self.pipeline = prepared, Pipeline(prepared, reference_frames=NEEDED)
        self.random, self.number = np.random.default_rng(4), count()

    def __call__(self, samples, times=1):
        for _ in range(times):
            n = next(self.number)
            noisy = np.clip(samples + 2 * self.random.standard_normal(len(samples)), 0, RAIL)
            fixed = np.where((samples <= 0) | (samples >= RAIL), samples, np.round(noisy))
            ticks = round(0.1 * n * self.pipeline.tick_rate)
            result = self.pipeline.push(Frame(n, ticks, 0.1 * n, 1, 0, 0, fixed.astype(np.uint16)))
        return result


@pytest.fixture
def feed(sixteen, resting):
    feed = Feed(sixteen)
    feed(resting, NEEDED + 5)
    return feed


def without(prepared, samples, *electrodes):
    """Counts with these electrodes cut off."""
    scan, found = prepared.scan, samples.copy()
    off = np.isin(scan.drives, electrodes).any(axis=1)[scan.sample_drive]
    found[off] = 0
    found[np.isin(scan.sample_electrode, electrodes)] = RAIL
    return found


def away(touch):
    return np.hypot(touch.detection.x - PLACE[0], touch.detection.y - PLACE[1])


@pytest.mark.parametrize("cut", [(CUT,), (CUT, 11)])
def test_a_touch_goes_on_when_electrodes_are_cut_off(feed, sixteen, resting, touched, cut):
    feed(touched, 10)
    results = [feed(without(sixteen, touched, *cut)) for _ in range(12)]
    assert all(result.has_image for result in results)
    assert not results[0].health.sick
    assert {e.electrode: e.state for e in results[1].health.sick} == dict.fromkeys(cut, "open")
    assert all(len(result.touches) == 1 and away(result.touches[0]) < 0.012 for result in results)
    assert len({result.touches[0].id for result in results}) == 1
    assert f"E{CUT + 1} is open: no current" in results[-1].problem
    assert "image is made without" in results[-1].problem
    quiet = [feed(without(sixteen, resting, *cut)) for _ in range(20)]
    assert not any(result.touches for result in quiet[8:])
    assert feed(resting, 30).problem is None


def test_when_too_many_electrodes_are_gone_it_says_so(feed, sixteen, touched):
    feed(touched, 3)
    result = feed(without(sixteen, touched, 0, 3, 6, 9, 12), 3)
    assert not result.has_image
    assert not result.touches
    assert "too few rows are left for an image" in result.problem


def test_a_change_of_all_voltages_alike_is_no_touch(feed, sixteen, resting):
    warmer = samples_of(sixteen, np.full(len(sixteen.mesh.cells), 0.97 * sixteen.skin.conductivity))
    plain = Feed(prepare(sixteen.skin.altered({"signal": {"common_modes": "kept"}}), sixteen))
    plain(resting, NEEDED + 5)
    shown = [np.abs(f(warmer).image.values).max() for f in (feed, plain)]
    assert shown[0] < 0.5 * shown[1]
    assert not feed(warmer, 20).touches


def test_a_prior_that_leaves_the_constant_free_makes_none_of_the_gain(sixteen, resting, touched):
    """Laplace's constant is what all voltages in proportion tell, which is taken out."""
    laplace = Feed(prepare(sixteen.skin.altered({"inverse": {"prior": "laplace"}}), sixteen))
    laplace(resting, NEEDED + 5)
    result = laplace(touched, 6)
    values = np.abs(result.image.values)
    assert abs(result.image.values.mean()) < 1e-3 * values.max()
    assert values.max() < sixteen.skin.conductivity, "no more than there is"
    (touch,) = result.touches
    assert away(touch) < 0.012
    assert not laplace(np.round(0.98 * resting), 6).touches


def test_the_reference_follows_the_idle_skin_and_holds_under_a_touch(feed, resting, touched):
    start = feed(resting).reference
    drifted = resting + 3.0
    drifted[::2] += 3.0
    end = feed(drifted, 250).reference
    moved = np.abs(end - start).mean()
    assert moved > 1e-5
    feed(touched, 5)
    held = feed(touched).reference
    assert np.array_equal(feed(touched, 50).reference, held)
    assert feed.pipeline.reference_state.baseline.held > 4


def test_off_line_it_is_the_same(sixteen, resting, touched):
    fresh = Feed(sixteen)
    results = [fresh(resting) for _ in range(NEEDED)]
    results += [fresh(resting) for _ in range(60)]
    results += [fresh(touched) for _ in range(5)]
    volts = np.array([result.voltages for result in results])
    pattern = sixteen.pattern
    recording = Recording(
        voltages=volts[NEEDED:],
        drive=pattern.drive,
        measure=pattern.measure,
        time=0.1 * np.arange(NEEDED, len(volts)),
        reference=None,
        labels=None,
        is_change=False,
        source="the same frames",
    )
    found = reconstruct(sixteen, recording, volts[:NEEDED])
    assert mismatch(found.images[-1], results[-1].image.values) < 1e-3
    assert found.touches[-1]
    assert not any(found.touches[:60])


def test_the_prior_knows_which_electrodes_are_gone(sixteen):
    pattern = sixteen.pattern
    floating = np.arange(16) == CUT
    directions = nuisance_directions(pattern, (pattern.drive == CUT).any(axis=1), floating)
    left = sixteen.without_directions(directions)
    beside = np.argmin(
        np.linalg.norm(sixteen.mesh.centroids - sixteen.skin.electrode_centres[CUT], axis=1)
    )
    penalty = [p.operator.matrix[beside] for p in (sixteen, left)]
    assert np.linalg.norm(penalty[1]) > np.linalg.norm(penalty[0])


def test_the_prior_stays_where_nothing_is_left(sixteen):
    everything = np.eye(sixteen.pattern.n_meas)
    assert sixteen.without_directions(everything) is sixteen
