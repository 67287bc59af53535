"""``tomoskin calibrate layer``: the thickness of the foam under the twin, from ten presses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tomoskin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SEED = 7601
"""Nothing was chosen on it."""


def recorded(path, foam, count=10):
    """Single frames of presses on springs ``foam`` m long, after idle ones."""
    skin = Skin.load("textile-disc-8")
    given = TwinSettings.preset("textile", SEED)
    soft = {k: replace(getattr(given, k), thickness=foam) for k in ("contact", "material")}
    twin = SteppedSkin(prepare(skin), replace(given, **soft), with_touches=False)
    random, pattern = np.random.default_rng(SEED), skin.pattern()
    idle = [twin.step(()).voltages for _ in range(20)]
    frames = []
    for k in range(count):
        away, turn = 0.075 * np.sqrt((k + 0.5) / count), 2.4 * k
        force, radius = random.uniform(2, 4), random.uniform(0.008, 0.015)
        x, y = away * np.cos(turn), away * np.sin(turn)
        for part in (0.3, 0.6, 1.0, 1.0):
            step = twin.step((Press(x, y, part * force, radius),))
        frames += [step.voltages, *(twin.step(()).voltages for _ in range(8))]
    np.savez(path, voltages=[*idle, *frames], drive=pattern.drive, measure=pattern.measure)


@pytest.mark.parametrize("foam", [3e-3, 15e-3, 30e-3])
def test_the_layer_is_found_and_written_into_the_skin_file(tomoskin, tmp_path, foam):
    recorded(tmp_path / "presses.npz", foam)
    command = "calibrate", "layer", tmp_path / "presses.npz", "--skin", "textile-disc-8"
    code, out, err = tomoskin(
        *command, "--out", tmp_path / "soft.toml", "--reference", "first:20", "--json"
    )
    assert code == 0, err
    found = json.loads(out)
    assert found["presses"] >= 9
    assert foam / 1.5 < 1e-3 * found["layer_mm"] < 1.5 * foam
    assert found["low_mm"] < found["layer_mm"] < found["high_mm"]
    written = Skin.load(tmp_path / "soft.toml").layer
    assert written == pytest.approx(1e-3 * found["layer_mm"])


def test_too_few_presses_are_refused(tomoskin, tmp_path):
    recorded(tmp_path / "presses.npz", 15e-3, count=3)
    command = "calibrate", "layer", tmp_path / "presses.npz", "--skin", "textile-disc-8"
    code, _, err = tomoskin(*command, "--out", tmp_path / "soft.toml", "--reference", "first:20")
    assert code == 1
    assert "expected at least 5 presses with one touch, got 3" in err
    assert not (tmp_path / "soft.toml").exists()
