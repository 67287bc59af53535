"""``tomoskin calibrate force`` and ``tomoskin image --calibration``."""

import csv
import json
import re

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin

SKIN = Skin.load("textile-disc-8").altered({"mesh": {"cells": 400}})
WEIGHTS = (100.0, 200.0, 400.0, 800.0, 1500.0, 300.0, 600.0, 1000.0, 250.0, 500.0)
STAGES = 3


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A skin, and ten presses by weights in grams, two untouched frames before each."""
    folder = tmp_path_factory.mktemp("weights")
    rng, pattern = np.random.default_rng(3), SKIN.pattern()
    model = ForwardModel(SKIN.mesh(), pattern, SKIN.contact_impedance, SKIN.current)
    state = model.at(SKIN.conductivity)
    values, grams = [state.voltages] * 4, [np.nan] * 4
    for number, weight in enumerate(WEIGHTS):
        turn = 2.4 * number
        place = (
            0.05 * np.sqrt((number + 0.5) / len(WEIGHTS)) * np.array([np.cos(turn), np.sin(turn)])
        )
        near = np.flatnonzero(np.linalg.norm(model.mesh.centroids - place, axis=1) < 0.02)
        depth = 0.8 * weight / (weight + 500.0)
        change = np.full(len(near), np.exp(-depth) * SKIN.conductivity)
        (pressed,) = state.local.voltages_of([(near, change)])
        values += [pressed] * STAGES + [state.voltages] * 2
        grams += [weight] * STAGES + [np.nan] * 2
    data = np.array(values) + rng.normal(0.0, 5e-6, (len(values), pattern.n_meas))
    path, skin = folder / "weights.npz", folder / "skin.toml"
    np.savez(
        path, voltages=data, reference=state.voltages, drive=pattern.drive,
        measure=pattern.measure, force_n=np.array(grams), time_s=0.1 * np.arange(len(values)),
    )  # fmt: skip
    skin.write_text(SKIN.to_toml())
    return path, skin


def test_weights_in_grams_become_newtons_in_the_table(tomoskin, tmp_path, files):
    path, skin = files
    out, table = tmp_path / "force.npz", tmp_path / "touches.csv"
    code, said, err = tomoskin(
        "calibrate", "force", path, "--skin", skin, "--unit", "g", "--out", out
    )
    assert (code, err) == (0, "")
    assert "10 presses, 0.981 to 14.7 N" in said
    assert "the tip that pressed" in said
    code, said, err = tomoskin(
        "image", path, "--skin", skin, "--calibration", out, "--touches", table
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert re.search(r"^forces from [\d.]+ to [\d.]+ N$", said, re.MULTILINE)
    with path.open("rb") as file, np.load(file) as kept:
        true = 9.80665e-3 * kept["force_n"]
    with table.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if np.isfinite(true[int(row["frame"])])]
    ratio = np.array([float(row["force_n"]) / true[int(row["frame"])] for row in rows])
    assert len(rows) >= 20
    assert np.abs(ratio - 1).mean() < 0.25
    assert {row["force_state"] for row in rows} == {"calibrated"}
    code, said, _ = tomoskin("image", path, "--skin", skin, "--calibration", out, "--json")
    touch = json.loads(said)["touches"][-1]
    assert touch["force_n"]["low"] < touch["force_n"]["value"] < touch["force_n"]["high"]


def test_depths_in_millimetres_become_columns_of_the_table(tomoskin, tmp_path, files):
    path, skin = files
    out, table = tmp_path / "depth.npz", tmp_path / "touches.csv"
    command = ("calibrate", "depth", path, "--skin", skin, "--out", out)
    code, _, err = tomoskin(*command)
    assert code == 1
    assert "holds no depths: expected depth_m" in err
    spans = [
        word
        for number, weight in enumerate(WEIGHTS)
        for word in ("--depth", f"{weight / 1000}={4 + 5 * number}:{7 + 5 * number}")
    ]
    code, said, err = tomoskin(*command, *spans)
    assert (code, err) == (0, "")
    assert "10 presses, 0.1 to 1.5 mm" in said
    code, _, err = tomoskin(*command, *spans, "--unit", "m", "--force")
    assert code == 1
    assert "expected depths up to 100 mm, got 100 to 1500 mm" in err
    assert "the unit is probably another (name it: --unit mm" in err
    code, _, err = tomoskin(
        "image", path, "--skin", skin, "--calibration", out, "--touches", table
    )  # fmt: skip
    assert (code, err) == (0, "")
    with table.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["depth_m"]]
    ratio = [float(row["depth_m"]) / (1e-6 * pressed(int(row["frame"]))) for row in rows]
    assert np.abs(np.array(ratio) - 1).mean() < 0.3
    assert {row["depth_state"] for row in rows} == {"calibrated"}
    assert all(float(row["depth_low_m"]) < float(row["depth_high_m"]) for row in rows)


def pressed(frame):
    """The weight in that frame, g, or the depth, µm."""
    return WEIGHTS[min((frame - 4) // 5, len(WEIGHTS) - 1)]


def test_simulated_presses_teach_forces(tomoskin, tmp_path):
    made, out = tmp_path / "set.npz", tmp_path / "force.npz"
    simulate = ("simulate", "--presses", 12, "--seed", 1, "--processes", 1, "--out", made)
    assert tomoskin(*simulate)[0] == 0
    calibrate = ("calibrate", "force", "--skin", "textile-disc-8", "--out", out, "--force")
    code, said, _ = tomoskin(*calibrate, made)
    assert code == 0
    assert " touches of " in said
    with made.open("rb") as file, np.load(file) as kept:
        arrays = dict(kept)
    assert arrays["force_n"] == pytest.approx(arrays["press_force_n"][:, 0])
    assert arrays["depth_m"] == pytest.approx(arrays["press_depth_m"][:, 0])
    assert ((arrays["depth_m"] > 0) & (arrays["depth_m"] < 1.2e-3)).all()  # where the foam locks
    older = tmp_path / "older.npz"  # sets of before had a column for the only press
    np.savez(older, **arrays | {"force_n": arrays["press_force_n"]})
    assert tomoskin(*calibrate, older)[0] == 0
    np.savez(older, **arrays | {"force_n": np.ones((12, 2))})
    code, _, error = tomoskin(*calibrate, older)
    assert code == 1
    assert "expected force_n of shape (12,)" in error
    assert "got (12, 2)" in error


def test_grams_read_as_newtons_are_noticed(tomoskin, tmp_path, files):
    path, skin = files
    code, _, err = tomoskin("calibrate", "force", path, "--skin", skin, "--out", tmp_path / "f.npz")
    assert code == 1
    assert "expected forces up to 100 N, got 100 to 1500 N" in err
    assert "1 N is the weight of 102 g, so the unit is probably another" in err


def test_labels_by_hand(tomoskin, tmp_path, files):
    path, skin = files
    line = ("calibrate", "force", path, "--skin", skin, "--out", tmp_path / "f.npz", "--json")
    spans = [
        word
        for number, weight in enumerate(WEIGHTS)
        for word in ("--weight", f"{weight / 1e3}={4 + 5 * number}:{7 + 5 * number}")
    ]
    code, said, _ = tomoskin(*line, "--unit", "kg", *spans)
    assert code == 0
    facts = json.loads(said)
    assert facts["presses"] == len(WEIGHTS)
    assert facts["to_n"] == pytest.approx(14.7, abs=0.1)
    code, _, err = tomoskin(*line, "--weight", "5=4:7", "--weight", "6=6:9", "--force")
    assert code == 1
    assert "already have the label" in err
    code, _, err = tomoskin(*line, "--weight", "heavy=4:7", "--force")
    assert code == 2
    assert "expected a number as FORCE" in err


def test_the_calibration_of_another_skin_is_refused(tomoskin, tmp_path, files):
    path, skin = files
    out = tmp_path / "force.npz"
    assert tomoskin("calibrate", "force", path, "--skin", skin, "--unit", "g", "--out", out)[0] == 0
    other = tmp_path / "other.toml"
    other.write_text(SKIN.altered({"material": {"sheet_resistance": "7 ohm/sq"}}).to_toml())
    code, _, err = tomoskin("image", path, "--skin", other, "--calibration", out)
    assert code == 1
    assert "to another sheet" in err
