"""tomoskin calibrate body, and images of a skin on a body that moves."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tomoskin.cli import main
from tomoskin.core import DataError
from tomoskin.extras.body import BODY
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare

SCRIPT = """format = 1
[script]
duration = "{duration}"
lead_in = "1.2 s"
seed = {seed}
preset = "ideal"
[[bend]]
length = "80 mm"
start = "0 s"
profile = {profile}
"""
ROUGH = 8
"""Degrees: learnt from 35 moving frames of 8 electrodes; measured up to 7.4 on seeds 5 to 8."""

PRESS = """[[press]]
id = "a"
radius = "12 mm"
at = ["30 mm", "20 mm"]
start = "500 ms"
force = "3 N"
rise = "100 ms"
fall = "100 ms"
hold = "500 ms"
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A session of known bends, and one with a press while it bends; a calibration."""
    folder = tmp_path_factory.mktemp("bends")
    skin = ("--skin", "textile-disc-8")
    known = '[["600 ms", "50 deg"], ["1.2 s", "0 deg"], ["1.6 s", "30 deg"], ["1.9 s", "0 deg"]]'
    for name, duration, profile, more in (
        ("known", "2 s", known, ""),
        ("used", "1.6 s", '[["800 ms", "40 deg"], ["1.5 s", "0 deg"]]', PRESS),
    ):
        script = folder / f"{name}.toml"
        script.write_text(SCRIPT.format(duration=duration, seed=len(name), profile=profile) + more)
        out = folder / f"{name}.mcap"
        _done("simulate", *skin, "--script", str(script), "--out", str(out))
    _done("calibrate", "body", str(folder / "known.mcap"), "--out", str(folder / "c.npz"))
    return folder


def _done(*arguments):
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    assert not end.value.code


def test_angles_and_touches_of_a_session_that_bends(recorded, tomoskin):
    model = BODY.read(recorded / "c.npz").model
    assert np.degrees(model.error[0]) < 2.0
    code, out, err = tomoskin(
        "image", recorded / "used.mcap", "--calibration", recorded / "c.npz", "--json"
    )
    assert code == 0, err
    found = json.loads(out)
    angle = np.degrees([bend["angle_rad"] for bend in found["bends"]])
    assert angle.max() == pytest.approx(40, abs=ROUGH)
    states = {bend["state"] for bend in found["bends"]}
    assert states >= {"idle", "bend", "bend and touch"}
    places = np.array([(t["x_m"], t["y_m"]) for t in found["touches"]])
    assert len(places) >= 5
    assert np.median(np.linalg.norm(places - (0.03, 0.02), axis=1)) < 0.008


def test_a_recording_that_lacks_rows_keeps_its_bends(recorded, tomoskin):
    """Five rows of a pair that was not read: imaged, and the bend read, without them."""
    whole = read_recording(recorded / "used.mcap")
    lost = whole.measure[:, 0] == 2
    assert np.count_nonzero(lost) == 5
    np.savez(
        recorded / "less.npz",
        voltages=np.where(lost, np.nan, whole.voltages),
        drive=whole.drive,
        measure=whole.measure,
        time_s=whole.time,
    )
    code, out, err = tomoskin(
        "image", recorded / "less.npz", "--skin", "textile-disc-8",
        "--calibration", recorded / "c.npz", "--json",
    )  # fmt: skip
    assert code == 0, err
    found = json.loads(out)
    assert len(found["rows_left_out"]) == 5
    angle = np.degrees([bend["angle_rad"] for bend in found["bends"]])
    assert len(angle) == found["frames"] - 1  # the first one is the reference
    assert angle.max() == pytest.approx(40, abs=ROUGH)
    assert {bend["state"] for bend in found["bends"]} >= {"idle", "bend", "bend and touch"}


def test_options_say_the_angles_where_the_file_does_not(recorded, tomoskin):
    bends = ("--bend", "0=0:18", "--bend", "25@90=24:28", "--bend", "50=31:34")
    code, out, err = tomoskin(
        "calibrate", "body", recorded / "known.mcap", "--out", recorded / "d.npz", *bends
    )
    assert code == 0, err
    assert "25 frames" in out


@pytest.mark.parametrize(
    ("bend", "message"),
    [
        ("much=0:9", "expected DEG=A:B"),
        ("30=0:9999", "within 0:"),
        ("30=0:9", "two or more values"),
    ],
)
def test_angles_that_cannot_be_are_refused(recorded, tomoskin, bend, message):
    known, out = recorded / "known.mcap", recorded / "e.npz"
    code, _, err = tomoskin("calibrate", "body", known, "--out", out, "--bend", bend)
    assert code in (1, 2)
    assert message in err


@pytest.mark.parametrize("lost", ["kind", "covariance"])
def test_a_file_that_is_no_calibration_is_refused(recorded, tomoskin, lost):
    with np.load(recorded / "c.npz") as arrays:
        cut = {key: arrays[key] for key in arrays.files if key != lost}
    np.savez(recorded / f"{lost}.npz", **cut)
    code, _, err = tomoskin(
        "image", recorded / "used.mcap", "--calibration", recorded / f"{lost}.npz"
    )
    assert code == 1
    assert "is not a calibration" in err


def test_a_calibration_of_another_scan_is_refused(recorded):
    calibration = BODY.read(recorded / "c.npz")
    with pytest.raises(DataError, match="another scan"):
        calibration.check(Skin.load("textile-disc-16"))


def test_the_live_pipeline_reads_the_bend_and_sees_no_touch_in_it(recorded):
    with SessionReader(recorded / "used.mcap") as session:
        frames = [item.frame for item in session.frames()]
        prepared = prepare(session.skin).calibrated(BODY.read(recorded / "c.npz"))
    pipeline = Pipeline(prepared)
    results = [result for frame in frames if (result := pipeline.push(frame)) is not None]
    bends = [result.readings["body"] for result in results if "body" in result.readings]
    assert len(bends) >= 20
    assert np.degrees(max(bend.angle for bend in bends)) == pytest.approx(40, abs=ROUGH)
    late = results[-4:]
    assert not any(result.touches for result in late)
    assert any(result.touches for result in results)


@pytest.fixture
def bare(recorded):
    """The known bends as voltages alone."""
    known = read_recording(recorded / "known.mcap")
    path = recorded / "bare.npz"
    np.savez(
        path, voltages=known.voltages, drive=known.drive, measure=known.measure, time_s=known.time
    )
    return path


def test_without_states_the_body_has_none_with_a_unit(bare, recorded, tomoskin):
    code, out, err = tomoskin(
        "calibrate", "body", bare, "--skin", "textile-disc-8", "--out", recorded / "latent.npz"
    )
    assert code == 0, err
    assert "no unit" in out
    assert BODY.read(recorded / "latent.npz").model.body.names[0] == "latent 1"


def test_states_come_from_a_table_of_an_encoder(bare, recorded, tomoskin):
    model = BODY.read(recorded / "c.npz").model
    table, out = recorded / "encoder.csv", recorded / "encoder.npz"
    frames = np.searchsorted(read_recording(bare).time, model.body.time)
    lines = [
        f"{k},{np.degrees(a):.3f}" for k, a in zip(frames, model.body.state[:, 0], strict=True)
    ]
    table.write_text("\n".join(["frame,angle_deg", *lines]))
    given = ("--skin", "textile-disc-8", "--states", table, "--out", out)
    code, _, err = tomoskin("calibrate", "body", bare, *given)
    assert code == 0, err
    assert BODY.read(out).model.body.size == pytest.approx(model.body.size, abs=1e-3)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "angle_deg\n3",
        "frame,angle_deg\n9999,3",
        "frame,a\n1,2,3",
        "frame,a\n1,x",
        "frame;a\n1;2",
        "frame,angle_deg\n1,\n2,3",
    ],
)
def test_a_table_that_holds_no_states_is_refused(bare, recorded, tomoskin, text):
    table = recorded / "wrong.csv"
    table.write_text(text)
    given = ("--skin", "textile-disc-8", "--states", table, "--out", recorded / "w.npz")
    code, _, err = tomoskin("calibrate", "body", bare, *given)
    assert code == 1
    assert "expected" in err


def test_degrees_that_would_be_taken_for_rad_are_refused(bare, recorded, tomoskin):
    table = recorded / "degrees.csv"
    table.write_text("frame,angle\n" + "\n".join(f"{k},{2 * k}" for k in range(40)) + "\n")
    given = ("--skin", "textile-disc-8", "--states", table, "--out", recorded / "rad.npz")
    code, _, err = tomoskin("calibrate", "body", bare, *given)
    assert code == 1
    assert "expected angle in rad, up to 6.28, got 78" in err
    assert "name the column angle_deg" in err
