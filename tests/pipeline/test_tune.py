"""alpha = "auto": predicted by the read-out, then by the reference's noise, without a halt."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest

from golden import mismatch
from run.board import AS_TAKEN, pressed, samples_of
from tomoskin.core import Frame, ModelError
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Setting, prepare
from tomoskin.pipeline.rest import tune, tuned, tuned_by_rule
from tomoskin.sensing.signal import Reference

NEEDED = 20
LOUD = 5.0
"""Noise in parts of what the read-out predicts."""


def skin(alpha):
    return Skin.load("textile-disc-8").altered({"inverse": {"alpha": alpha}, "signal": AS_TAKEN})


@pytest.fixture(scope="module")
def auto():
    return prepare(skin("auto"))


@pytest.fixture(scope="module")
def idle_samples(auto):
    return samples_of(auto)


def reference(prepared, factor):
    """Idle frames whose noise is that factor of the predicted one."""
    rng = np.random.default_rng(1)
    noise = factor * prepared.readout.noise
    frames = prepared.operator.reference + noise * rng.standard_normal((NEEDED, 40))
    return Reference.of(frames)


def frames(prepared, samples, factor):
    """Endless noisy frames of these samples; a row's noise is that of two samples."""
    sd = factor * prepared.readout.noise / prepared.readout.volts_per_count / np.sqrt(2)
    rng = np.random.default_rng(2)
    for n in count():
        noisy = np.round(samples + sd * rng.standard_normal(len(samples)))
        yield Frame(n, 0, 0.01 * n, 1, 0, 0, noisy.astype(np.uint16))


def test_a_skin_without_alpha_has_it_chosen_by_the_noise_that_its_read_out_predicts(auto):
    assert auto.choice.rule == "light-touch"
    assert "as its read-out predicts it" in auto.choice.reason
    assert mismatch(auto.operator.matrix, auto.problem.operator(auto.choice.alpha).matrix) < 1e-9


def test_alpha_by_hand_stays(auto):
    by_hand = prepare(skin(0.05))
    assert (by_hand.choice.alpha, by_hand.choice.rule) == (0.05, "hand")
    assert tuned(by_hand, reference(by_hand, LOUD)) is by_hand
    assert mismatch(by_hand.operator.matrix, auto.problem.operator(0.05).matrix) < 1e-12


def test_measured_noise_chooses_again(auto):
    quiet, loud = (tuned(auto, reference(auto, f)) for f in (1 / LOUD, LOUD))
    assert quiet.choice.alpha < 0.6 * auto.choice.alpha < auto.choice.alpha
    assert loud.choice.alpha > 1.6 * auto.choice.alpha
    assert "measured on 20 idle frames" in loud.choice.reason
    expected = auto.problem.operator(loud.choice.alpha)
    assert mismatch(loud.operator.matrix, expected.matrix) < 1e-9
    assert mismatch(loud.operator.precision, expected.precision) < 1e-9


@pytest.mark.parametrize(
    "still",
    [
        lambda p: reference(p, 1.0),
        lambda p: Reference.of(p.operator.reference[None]),
        lambda p: Reference.of(np.tile(p.operator.reference, (5, 1))),
    ],
    ids=["as predicted", "one frame", "no noise at all"],
)
def test_nothing_changes_where_there_is_no_reason(auto, still):
    assert tuned(auto, still(auto)) is auto


def test_steps_are_small(auto):
    skin_16 = Skin.load("textile-disc-16").altered({"inverse": {"alpha": "auto"}})
    large = prepare(skin_16)
    noise = LOUD * large.readout.noise * np.random.default_rng(3).standard_normal((NEEDED, 208))
    steps = list(tune(large, Reference.of(large.operator.reference + noise)))
    alpha = next(number for number, better in enumerate(steps) if better is not None)
    assert 5 < alpha < 20
    assert 200 < len(steps) < 270  # the sheet's too, one a frame
    assert [better is not None for better in tune(auto, reference(auto, LOUD))].index(True) < 4


def test_the_pipeline_goes_on_while_its_operator_changes(auto, idle_samples):
    pipeline = Pipeline(auto, reference_frames=NEEDED)
    source = frames(auto, idle_samples, LOUD)
    for _ in range(NEEDED):
        pipeline.push(next(source))
    assert pipeline.choice is auto.choice
    touched = frames(auto, samples_of(auto, pressed(auto, 0.03, 0.02)), LOUD)
    results = [pipeline.push(next(touched)) for _ in range(10)]
    assert all(result.ready and result.has_image for result in results)
    assert pipeline.choice.alpha > 1.6 * auto.choice.alpha
    [touch] = results[-1].touches
    assert np.hypot(touch.detection.x - 0.03, touch.detection.y - 0.02) < 0.015
    assert len({t.id for result in results for t in result.touches}) == 1


def test_the_deviation_of_a_touch_is_that_of_the_operator_in_use(auto, idle_samples, monkeypatch):
    """What noise adds to it: an image's bias does not differ between frames, each of which is alone
    here, since the mean of a touch that stands has less of it."""
    monkeypatch.setattr("tomoskin.sensing.segment.segment._BIAS", 0.0)
    setting = Setting(scan=auto.scan, alone=True)
    pipeline = Pipeline(auto, reference_frames=NEEDED, setting=setting)
    source = frames(auto, idle_samples, LOUD)
    for _ in range(NEEDED):
        pipeline.push(next(source))
    touched = frames(auto, samples_of(auto, pressed(auto, 0.03, 0.02)), LOUD)
    found = [pipeline.push(next(touched)).touches for _ in range(60)][20:]
    readings = [t.detection for touches in found for t in touches]
    spread = np.std([(r.x, r.y) for r in readings], axis=0)
    told = np.mean([(r.sd_x, r.sd_y) for r in readings], axis=0)
    assert 0.5 < np.hypot(*spread) / np.hypot(*told) < 2.0


def test_a_new_reference_begins_the_choice_anew(auto, idle_samples):
    pipeline = Pipeline(auto, reference_frames=NEEDED)
    loud, quiet = (frames(auto, idle_samples, f) for f in (LOUD, 1.0))
    for _ in range(NEEDED + 1):
        pipeline.push(next(loud))
    pipeline.take_reference()
    for _ in range(NEEDED + 10):
        pipeline.push(next(quiet))
    assert pipeline.choice.alpha == pytest.approx(auto.choice.alpha, rel=0.15)


def test_the_same_frames_give_the_same_pictures(auto, idle_samples):
    def run():
        pipeline = Pipeline(auto, reference_frames=NEEDED)
        source = frames(auto, idle_samples, LOUD)
        return [pipeline.push(next(source)).image.values for _ in range(NEEDED + 10)]

    assert all(np.array_equal(a, b) for a, b in zip(run(), run(), strict=True))


def test_by_rule(auto):
    noise = auto.predicted_noise()
    assert tuned_by_rule(auto, "noise-figure", noise).choice.rule == "noise-figure"
    with pytest.raises(ModelError, match="expected a rule among"):
        tuned_by_rule(auto, "best", noise)
