"""Frames as they should not be: said in words, and no touch invented."""

from __future__ import annotations

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.skin import Skin

NEEDED = 30
PERIOD = 0.05


@pytest.fixture(scope="module", params=["textile-disc-8", "textile-disc-16"])
def fitted(request):
    return prepare(Skin.load(request.param).altered({"touch": {"method": "fit"}}))


class Run:
    """A pipeline that is shown samples, a little noisy, after a reference of ``rest``."""

    def __init__(self, prepared, rest, seed=21):
        self.pipeline = Pipeline(prepared, reference_frames=NEEDED)
        self.random = np.random.default_rng(seed)
        self.prepared, self.number = prepared, 0
        self.show(rest, NEEDED)

    def show(self, samples, count=1):
        """Results of so many frames."""
        return [self._one(samples) for _ in range(count)]

    def _one(self, samples):
        skin, time = self.prepared.skin, PERIOD * self.number
        noisy = np.round(samples + self.random.normal(0, 3, len(samples)))
        noisy = np.clip(noisy, 0, 65535).astype(np.uint16)
        ticks = round(time * skin.readout.tick_rate)
        frame = Frame(self.number, ticks, time, 1, 0, 0, noisy)
        self.number += 1
        return self.pipeline.push(frame)


def seen(results):
    return [touch for result in results for touch in result.touches]


def said(results):
    return " / ".join(sorted({result.problem for result in results if result.problem}))


@pytest.mark.parametrize("seed", range(4))
def test_a_frame_of_absurd_values_is_no_touch(fitted, seed):
    run = Run(fitted, samples_of(fitted))
    run.show(samples_of(fitted), 10)
    settings = fitted.skin.readout
    full = settings.oversampling * (2**settings.adc_bits - 1)
    absurd = np.random.default_rng(seed).uniform(0.05, 0.95, fitted.scan.n_samples) * full
    results = run.show(absurd) + run.show(samples_of(fitted), 60)
    assert seen(results) == []
    assert said(results[:1])
    assert said(results[40:]) == ""
    touched = samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4))
    assert len(run.show(touched, 5)[-1].touches) == 1


def test_a_reference_under_a_press_is_said_once_it_is_lifted(fitted):
    run = Run(fitted, samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4)))
    results = run.show(samples_of(fitted), 100)
    assert seen(results) == []
    assert "a press had been lifted" in said(results)
    assert "take a new one" in said(results)


@pytest.mark.parametrize("modes", ["projected", "kept"])
def test_a_gain_that_doubles_is_no_touch(fitted, modes):
    skin = fitted.skin.altered({"signal": {"common_modes": modes}})
    prepared = prepare(skin, fitted)
    half = samples_of(prepared) / 2
    run = Run(prepared, half)
    run.show(half, 20)
    results = run.show(2 * half, 100)
    assert seen(results) == []
    assert "all voltages are 2.0 times those of the reference" in said(results)


def test_ten_measurements_make_no_touch(fitted):
    run = Run(fitted, samples_of(fitted))
    run.show(samples_of(fitted), 20)
    scan, samples = fitted.scan, samples_of(fitted, pressed(fitted, 0.03, 0.02)).copy()
    kept = np.unique(np.concatenate([scan.plus[:10], scan.minus[:10]]))
    railed = np.setdiff1d(np.arange(scan.n_samples), kept)
    samples[railed] = 65535
    results = run.show(samples, 20)
    assert seen(results) == []
    assert not any(result.has_image for result in results)
    assert "no picture" in said(results) or "too little is left" in said(results)
