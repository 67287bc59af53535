"""Frames as they should not be: said in words, and no touch invented."""

from __future__ import annotations

import re

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame, ModelError
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.sensing.fit import SpotFinder

NEEDED = 30
PERIOD = 0.05


@pytest.fixture(scope="module", params=["textile-disc-8", "textile-disc-16"])
def fitted(request):
    return prepare(Skin.load(request.param).altered({"touch": {"method": "fit"}}))


class Run:
    """A pipeline that is shown samples, a little noisy, after a reference of ``rest``."""

    def __init__(self, prepared, rest, seed=21, needed=NEEDED):
        self.pipeline = Pipeline(prepared, reference_frames=NEEDED)
        self.random = np.random.default_rng(seed)
        self.prepared, self.number = prepared, 0
        self.show(rest, needed)

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
    assert "the conductivity has risen near" in said(results)
    assert "take a new one while nothing touches" in said(results)


def test_a_reference_under_a_faint_press_follows_in_the_end(fitted):
    run = Run(fitted, samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.1)))
    results = run.show(samples_of(fitted), 1300)
    assert seen(results) == []
    assert "the conductivity has risen near" in said(results[:20])
    assert "the conductivity has risen near" in said(results[400:500])
    assert said(results[-20:]) == ""


@pytest.mark.parametrize(
    ("modes", "seed"), [("projected", 21), ("projected", 22), ("projected", 28), ("kept", 21)]
)
def test_a_gain_that_doubles_is_no_touch(fitted, modes, seed):
    skin = fitted.skin.altered({"signal": {"common_modes": modes}})
    prepared = prepare(skin, fitted)
    half = samples_of(prepared) / 2
    run = Run(prepared, half, seed)
    run.show(half, 20)
    results = run.show(2 * half, 100)
    assert seen(results) == []
    assert "all voltages are 2.0 times those of the reference" in said(results)


@pytest.mark.parametrize("part", [0.001, 0.002, 0.003, 0.005, 0.01, 0.1, -0.003, -0.01, -0.1])
def test_a_step_of_all_voltages_is_no_touch_and_is_named(fitted, part):
    usual = 0.8 * samples_of(fitted)
    run = Run(fitted, usual)
    run.show(usual, 20)
    step = run.show((1 + part) * usual, 80)
    assert seen(step + run.show(usual, 60)) == []
    if abs(part) > 0.004:
        told = re.search(
            r"all voltages have changed by (\S+) % at once: gain or", said(step[-80:-70])
        )
        assert told is not None
        assert float(told[1]) == pytest.approx(100 * part, rel=0.3)
        assert "press" not in said(step)
    touched = 0.8 * samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4))
    assert len(run.show(touched, 5)[-1].touches) == 1


@pytest.mark.parametrize("ripple", [0.001, 0.004])
def test_a_supply_that_wavers_is_learnt_and_no_touch(fitted, ripple):
    usual, random = 0.8 * samples_of(fitted), np.random.default_rng(22)
    wavers = 1 + ripple * random.standard_normal(NEEDED + 300)
    run = Run(fitted, wavers[0] * usual, needed=1)
    results = [run.show(gain * usual)[0] for gain in wavers[1:]]
    assert seen(results[NEEDED:]) == []
    assert sum("gain or supply" in (r.problem or "") for r in results) < 0.02 * len(results)
    touched = 0.8 * samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4))
    found = [run.show(gain * touched)[0] for gain in wavers[:5]]
    assert len(found[-1].touches) == 1


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
    assert "no image" in said(results) or "too few rows are left" in said(results)


def test_a_frame_that_the_model_fails_for_is_said_and_the_next_one_is_tried(fitted, monkeypatch):
    run = Run(fitted, samples_of(fitted))
    touched = samples_of(fitted, pressed(fitted, 0.03, 0.02, loss=0.4))
    (before,) = run.show(touched, 5)[-1].touches

    def fails(*_):
        raise ModelError("expected a conductivity above 0, got -1")

    with monkeypatch.context() as patched:
        patched.setattr(SpotFinder, "push", fails)
        (failed,) = run.show(touched)
    assert not failed.has_image
    assert "no touch can be found in this frame: expected a conductivity above" in said([failed])
    (after,) = run.show(touched)
    assert after.has_image
    assert [touch.id for touch in after.touches] == [before.id]
    assert said([after]) == ""


@pytest.mark.parametrize("angle", [0.7, 2.4])
def test_a_press_and_a_rise_at_once_are_one_touch(fitted, angle):
    """The stronger the press, the more touches seemed to be round the rise."""
    press = 0.05 * np.exp(1j * angle)
    mesh, loss = fitted.mesh, 0.35
    x, y = mesh.centroids.T
    sigma = np.full(len(x), fitted.skin.conductivity)
    for place, change in ((press, -loss), (-press * np.exp(0.3j), loss)):
        away = np.abs(x + 1j * y - place) / 0.015
        sigma *= np.exp(change * np.exp(-(away**2)))
    run = Run(fitted, samples_of(fitted))
    run.show(samples_of(fitted), 20)
    results = run.show(samples_of(fitted, sigma), 12)
    assert all(len(result.touches) <= 1 for result in results)
    (touch,) = results[-1].touches
    assert np.hypot(touch.detection.x - press.real, touch.detection.y - press.imag) < 0.008
    assert "the conductivity has risen near" in said(results)


def test_nothing_is_left_where_a_rise_has_been(fitted):
    """The reference does not follow it: else a touch would seem to be there once it ends."""
    x, y = fitted.mesh.centroids.T
    risen = np.exp(0.35 * np.exp(-((x - 0.03) ** 2 + (y - 0.02) ** 2) / 0.015**2))
    run = Run(fitted, samples_of(fitted))
    run.show(samples_of(fitted, pressed(fitted, -0.03, 0.02, loss=0.4)), 10)
    run.show(samples_of(fitted), 20)  # what a release leaves fades within a second
    results = run.show(samples_of(fitted, fitted.skin.conductivity * risen), 60)
    results += run.show(samples_of(fitted), 40)
    assert seen(results) == []
    assert "the conductivity has risen near" in said(results[:60])
    assert said(results[-10:]) == ""
