"""States that were learnt are told frame by frame: live, in a recording of it, and off-line."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from run.board import pressed, samples_of
from run.test_replay import Recorded, noisy
from tomoskin.cli import main
from tomoskin.core import DataError, Frame
from tomoskin.extras.classes import CLASSES, Classifier, ClassReading
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.files.session.session_reader import tick_rate
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare, reconstruct

NAMES = ("idle", "left", "right")
EACH = 12
FIRST = 20
"""Frames of the reference."""


def volts(prepared, samples, count, seed):
    """(count, n_meas) V of noisy frames."""
    frames = [Frame(0, 0, 0.0, 1, 0, 0, noisy(samples, seed + k)) for k in range(count)]
    return np.array([prepared.readout(frame).values for frame in frames])


@pytest.fixture(scope="module")
def classes(prepared):
    """Idle, and a press on either side, as the runs of this module show them."""
    idle = samples_of(prepared)
    sides = [samples_of(prepared, pressed(prepared, x, 0.01)) for x in (-0.03, 0.03)]
    rest = volts(prepared, idle, 40, 5000).mean(axis=0)
    dv = [volts(prepared, s, EACH, 6000 + 100 * k) - rest for k, s in enumerate([idle, *sides])]
    labels = [name for name in NAMES for _ in range(EACH)]
    known = Classifier.fit(
        np.concatenate(dv), labels, pattern=prepared.pattern, skin_id=prepared.skin.identity
    )
    return CLASSES.of(known, prepared.pattern, prepared.skin)


@pytest.fixture(scope="module")
def run(prepared, classes, tmp_path_factory):
    """A recorded run of all three classes, and its status at the end."""
    taught = prepared.calibrated(classes)
    with Recorded(taught, tmp_path_factory.mktemp("run") / "run.mcap") as recorded:
        recorded.idle(FIRST + 5)
        for side in (0, 1):
            recorded.touch(side, 6)
            recorded.idle(6)
        recorded.touch(1, 6)
        status = recorded.runner.status()
    return recorded.path, taught, status


def test_a_run_says_which_class_it_shows(run):
    _, _, status = run
    shown = status.readings["class"]
    assert shown == ClassReading("right", shown.probability, False)
    assert status.text.endswith(f", right {100 * shown.probability:.0f} %")
    assert shown.now == {"name": "right", "probability": shown.probability, "unknown": False}
    assert shown.shown.words == f"Class: right, {100 * shown.probability:.0f} %"
    assert shown.shown.place == "touches"
    unknown = replace(shown, unknown=True)
    assert (unknown.word, unknown.shown.words) == ("unknown", "Class unknown (nearest: right)")


def test_a_replay_tells_the_same_classes_to_the_bit(run):
    path, taught, status = run
    with SessionReader(path) as session:
        again = [result.readings.get("class") for result in replayed(as_recorded(session), session)]
        frames = [item.frame for item in session.frames()]
        pipeline = Pipeline(taught)
        pipeline.tick_rate = tick_rate(session)
    here = [pipeline.push(frame).readings.get("class") for frame in frames]
    assert again == here
    assert again[-1] == status.readings["class"]
    assert again[: FIRST - 1] == [None] * (FIRST - 1), "no reference yet"
    names = [state.name for state in again[FIRST:]]
    assert (
        names
        == ["idle"] * 5 + ["left"] * 6 + ["idle"] * 6 + ["right"] * 6 + ["idle"] * 6 + ["right"] * 6
    )
    assert sum(state.unknown for state in again[FIRST:]) <= 2, "one frame in a hundred is"


def test_a_recording_says_the_same_off_line(run):
    path, taught, _ = run
    recording = read_recording(path).in_order_of(taught.pattern)
    found = reconstruct(taught, recording, recording.voltages[:FIRST])
    assert [s.name for s in found.readings["class"]][-12:] == ["idle"] * 6 + ["right"] * 6
    untaught = taught.uncalibrated(CLASSES)
    assert CLASSES.name not in reconstruct(untaught, recording, recording.voltages[:5]).readings


def test_what_was_not_learnt_is_unknown(prepared, classes):
    classifier = classes.model
    rng = np.random.default_rng(1)
    strange = classifier.read(rng.normal(size=prepared.pattern.n_meas))
    assert strange.unknown
    assert strange.text == f"unknown class (nearest: {strange.name})"
    assert classifier.read(np.full(prepared.pattern.n_meas, np.nan)).unknown, "nothing was read"


def test_rows_that_are_lost_or_left_out_do_not_count(prepared, classes):
    classifier, n = classes.model, prepared.pattern.n_meas
    sample = classes.model.examples.dv[EACH + 1]
    assert classifier.read(sample).name == "left"
    lost = np.where(np.arange(n) % 5 == 0, np.nan, sample)
    out = np.arange(0, n, 5)
    assert classifier.read(lost) == classifier.without(out).read(np.delete(sample, out))
    assert classifier.read(lost).name == "left"
    assert (
        prepared.calibrated(classes).without(out).calibrations[CLASSES.name].model.rows.tolist()
        == np.delete(np.arange(n), out).tolist()
    )


def test_states_of_another_skin_are_refused(classes):
    with pytest.raises(DataError, match="belongs to another scan: it was learnt on"):
        prepare(Skin.load("textile-disc-16")).calibrated(classes)


def test_on_the_command_line_states_of_another_skin_are_refused(run, classes, tmp_path, capfd):
    other = replace(classes.model, skin_id="another")
    classes.with_model(other).write(tmp_path / "c.npz")
    with pytest.raises(SystemExit) as end:
        main(["image", str(run[0]), "--calibration", str(tmp_path / "c.npz")])
    assert end.value.code == 1
    err = capfd.readouterr().err
    assert "the calibration of classes belongs to another skin: it was learnt on" in err


def test_the_command_line_tells_them(run, classes, tmp_path, capfd):
    path, c = run[0], tmp_path / "c.npz"
    classes.write(c)
    assert CLASSES.read(c).model.right == classes.model.right
    said = []
    for more in ([], ["--json", "--alpha", "0.1"]):
        with pytest.raises(SystemExit) as end:
            main(["image", str(path), "--calibration", str(c), *more])
        assert not end.value.code
        said.append(capfd.readouterr().out)
    told = json.loads(said[1])["classes"]
    assert (told[-1]["name"], told[-1]["unknown"]) == ("right", False)
    assert 0.5 < told[-1]["probability"] <= 1
    assert "right: 12 frames" in said[0]
