"""Frames without any noise: a simulated board, or a converter that never flickers."""

from __future__ import annotations

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare, reconstruct
from tomoskin.sensing.signal import Recording

KINDS = [
    {},
    {"touch": {"method": "fit"}},
    {"inverse": {"difference": "normalised"}},
    {"inverse": {"time_constant": "0.1 s"}},
]
X, Y = 0.03, 0.02
IDLE, TOUCHED = 200, 12


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_board_without_noise_runs_and_finds_the_touch(kind: dict[str, dict[str, str]]) -> None:
    """Six idle blocks in which nothing wavers: their noise is that of rounding."""
    prepared = prepare(Skin.load("textile-disc-8").altered(kind))
    idle, touched = samples_of(prepared), samples_of(prepared, pressed(prepared, X, Y))
    pipeline = Pipeline(prepared)
    found = []
    for n in range(IDLE + TOUCHED):
        ticks = round(0.1 * n * pipeline.tick_rate)
        samples = touched if n >= IDLE else idle
        result = pipeline.push(Frame(n, ticks, 0.1 * n, 1, 0, 0, samples))
        assert result is not None
        assert result.health is None or not result.health.sick
        assert n >= IDLE or not result.touches
        found = [np.hypot(t.detection.x - X, t.detection.y - Y) for t in result.touches]
    assert len(found) == 1
    assert found[0] < 0.015
    noise = pipeline.reference_state.noise
    assert noise is not None
    assert noise >= prepared.readout.rounding


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_a_recording_without_noise_is_reconstructed(
    kind: dict[str, dict[str, str]], scale: float
) -> None:
    prepared = prepare(Skin.load("textile-disc-8").altered(kind))
    model = prepared.operator.reference
    after = prepared.model.solve(pressed(prepared, X, Y)).voltages
    recording = Recording(
        voltages=scale * np.concatenate([np.tile(model, (60, 1)), np.tile(after, (4, 1))]),
        drive=prepared.pattern.drive,
        measure=prepared.pattern.measure,
        time=np.arange(64) / 10,
        reference=None,
        labels=None,
        is_change=False,
        source="a simulation",
    )
    found = reconstruct(prepared, recording, recording.voltages[:20])
    assert not any(found.touches[:60])
    assert [len(touches) for touches in found.touches[60:]] == [1] * 4
    reading = found.touches[-1][0].detection
    assert np.hypot(reading.x - X, reading.y - Y) < 0.015


def test_rows_that_waver_keep_their_own_noise() -> None:
    """Whatever the skin's own read-out would round: a recording may come from a finer one."""
    prepared = prepare(Skin.load("textile-disc-8"))
    model = prepared.operator.reference
    rng = np.random.default_rng(0)
    fine = 0.01 * prepared.readout.rounding
    idle = model + fine * rng.standard_normal((30, len(model)))
    change = 1e-3 * model * rng.standard_normal(len(model))
    recording = Recording(
        voltages=idle + change,
        drive=prepared.pattern.drive,
        measure=prepared.pattern.measure,
        time=np.arange(30) / 10,
        reference=None,
        labels=None,
        is_change=False,
        source="a fine instrument",
    )
    auto = prepare(Skin.load("textile-disc-8").altered({"inverse": {"alpha": "auto"}}))
    still = reconstruct(auto, recording, np.tile(model, (30, 1)))
    found = reconstruct(auto, recording, idle)
    assert found.choice.alpha < 0.1 * still.choice.alpha
