"""One diagnosis at a time, the likely one, with what to do next."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from files.session.runs import FOLD
from run.sinks.conftest import PATTERN, result_at
from tomoskin.files.session import SessionReader, as_recorded, read_session, replayed
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Cause, Diagnosis, prepare, reconstruct
from tomoskin.run import simulate
from tomoskin.sensing.fit import Deformation, EstimatedNumber
from tomoskin.sensing.signal import ElectrodeHealth, Health
from tomoskin.twin import Script

SKIN = Skin.load("textile-disc-8")
HEAD = 'format = 1\n[script]\nduration = "2200 ms"\nlead_in = "1400 ms"\n'
TIMES = 'start = "100 ms"\nrise = "200 ms"\nhold = "1400 ms"\nfall = "200 ms"\n'
BENT = f'{HEAD}[[bend]]\nlength = "60 mm"\nangle = "20 deg"\n{TIMES}'
STRETCHED = f'{HEAD}[[stretch]]\nstrain = 0.03\naxis = "30 deg"\n{TIMES}'

SUPPLY = Diagnosis(Cause.SUPPLY, "all voltages have changed")
STEP = Diagnosis(Cause.STEP, "all voltages have changed at once")
LIFTED = Diagnosis(Cause.REFERENCE, "the conductivity has risen")
NOISE = Diagnosis(Cause.NOISE, "the voltages change by 7 times the noise")
TAUGHT = Diagnosis(Cause.TAUGHT, "the bend is beyond what was taught")


def health(state: str) -> Health:
    none = np.zeros(PATTERN.n_meas, bool)
    return Health((ElectrodeHealth(4, state, "why", 1.0),), none, none[:8])


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({}, None),
        ({"diagnoses": (NOISE, SUPPLY)}, Cause.SUPPLY),
        ({"diagnoses": (STEP, LIFTED)}, Cause.REFERENCE),
        ({"diagnoses": (NOISE, STEP)}, Cause.STEP),
        ({"diagnoses": (NOISE, SUPPLY), "deformation": FOLD}, Cause.DEFORMATION),
        ({"diagnoses": (NOISE, TAUGHT), "deformation": FOLD}, Cause.TAUGHT),
        ({"health": health("open"), "deformation": FOLD}, Cause.ELECTRODE),
        ({"health": health("noisy"), "deformation": FOLD}, Cause.DEFORMATION),
        ({"health": health("noisy"), "diagnoses": (NOISE,)}, Cause.CONTACT),
        ({"health": health("noisy"), "has_image": False, "deformation": FOLD}, Cause.NO_IMAGE),
        ({"left_out": 3, "diagnoses": (SUPPLY,)}, Cause.MEASUREMENTS),
        ({"left_out": 3, "has_image": False}, Cause.NO_IMAGE),
    ],
    ids=str,
)
def test_the_likeliest_is_told(changes: dict[str, Any], cause: Cause | None) -> None:
    result = result_at(1.0, **changes)
    assert (result.diagnosis and result.diagnosis.cause) == cause
    assert (result.problem is None) == (cause is None)


def test_a_change_of_all_voltages_alike_is_of_the_supply_first() -> None:
    common = Deformation("common", EstimatedNumber(-0.1, -0.12, -0.08), "relative")
    problem = result_at(1.0, deformation=common).problem
    assert problem is not None
    assert problem.index("gain or supply") < problem.index("warmth") < problem.index("stretch")
    assert "check current, supply and cables" in problem


def held(text: str, folder: Path) -> list[str]:
    """What is said of the frames in which a script holds a deformation."""
    simulate(Script.from_toml(text), SKIN, folder / "x.mcap", seed=7)
    with SessionReader(folder / "x.mcap") as session:
        results = list(replayed(as_recorded(session), session))
    said = [str(result.problem) for result in results if 2.0 < result.host_time < 3.0]
    assert len(said) > 12
    return said


def test_on_a_bend_the_words_are_about_the_bend(tmp_path: Path) -> None:
    said = held(BENT, tmp_path)
    assert all("bent along a line at 9" in text or "at 8" in text for text in said)
    assert all("lay it flat" in text for text in said)
    assert not any("supply" in text or "cables" in text for text in said)


def test_on_a_stretch_they_are_about_the_stretch(tmp_path: Path) -> None:
    said = held(STRETCHED, tmp_path)
    assert sum("stretched along 3" in text or "along 2" in text for text in said) > 0.9 * len(said)
    assert not any("cables" in text for text in said)


@pytest.mark.parametrize("gain", [0.9, 1.05, 1.15, 1.5])
def test_of_a_true_gain_they_are_about_the_supply(gain: float, tmp_path: Path) -> None:
    simulate(Script.from_toml(HEAD), SKIN, tmp_path / "x.mcap", seed=7)
    recording = read_session(tmp_path / "x.mcap")
    voltages = recording.voltages.copy()
    voltages[40:] *= gain
    result = reconstruct(prepare(SKIN), replace(recording, voltages=voltages), range(20))
    assert sum(map(len, result.touches)) == 0
    said = [text for text, frames in result.problems.items() if len(frames)]
    assert said
    assert all("check current, supply" in text for text in said)
    assert sum(map(len, result.problems.values())) >= 10
