"""``tomoskin calibrate touch`` and ``tomoskin locate``."""

import csv
import json

import numpy as np
import pytest

from tomoskin.model.pattern import Pattern

SKIN = "textile-disc-8"
PATTERN = Pattern.adjacent(8)


def frames(n, seed, xy=None):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.05, 0.05, (n, 2)) if xy is None else xy
    waves = np.random.default_rng(9).normal(scale=30.0, size=(2, PATTERN.n_meas))
    return np.sin(xy @ waves) + 0.02 * rng.normal(size=(n, PATTERN.n_meas)), xy


@pytest.fixture
def presses(tmp_path):
    dv, xy = frames(40, 0)
    dv[7] = dv[2]
    path = tmp_path / "presses.npz"
    np.savez(path, dv=dv, xy_m=xy, drive=PATTERN.drive, measure=PATTERN.measure)
    return path


@pytest.fixture
def touched(tmp_path):
    """Other frames, as voltages, in another order of rows."""
    dv, xy = frames(30, 1)
    order = np.random.default_rng(0).permutation(PATTERN.n_meas)
    path = tmp_path / "touched.npz"
    reference = np.linspace(1, 2, PATTERN.n_meas)
    np.savez(
        path,
        voltages=(reference + dv)[:, order],
        reference=reference[order],
        drive=PATTERN.drive[order],
        measure=PATTERN.measure[order],
    )
    return path, xy


def test_what_is_learnt_is_used(tomoskin, tmp_path, presses, touched):
    calibration, table = tmp_path / "c.npz", tmp_path / "touches.csv"
    code, out, err = tomoskin("calibrate", "touch", presses, "--skin", SKIN, "--out", calibration)
    assert (code, err) == (0, "")
    assert out.startswith("40 presses; each press left out")
    assert "frame    7  uncertain: has the same data as press 2" in out
    assert "next press" in out
    assert "all presses were about equally hard" in out
    path, xy = touched
    code, out, err = tomoskin(
        "locate", path, "--calibration", calibration, "--touches", table, "--skin", SKIN
    )
    assert (code, err) == (0, "")
    assert "10 more touches" in out
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    told = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    assert np.median(np.linalg.norm(told - xy, axis=1)) < 5e-3
    assert all(float(row["sd_x_m"]) > 0 for row in rows)
    _, _, said = out.partition("±")  # nine in ten, as the ellipses on the page
    assert float(said.split()[0]) == pytest.approx(1645 * float(rows[0]["sd_x_m"]), abs=0.06)


def test_rows_that_have_jumped_are_left_out_and_named(tomoskin, tmp_path, presses):
    calibration, path, table = (tmp_path / name for name in ("c.npz", "today.npz", "t.csv"))
    assert tomoskin("calibrate", "touch", presses, "--out", calibration)[0] == 0
    dv, xy = frames(60, 1)
    dv[:, [4, 11]] *= -40
    np.savez(path, dv=dv, drive=PATTERN.drive, measure=PATTERN.measure)
    code, _, err = tomoskin("locate", path, "--calibration", calibration, "--touches", table)
    assert code == 0
    assert "2 rows have jumped" in err
    assert all(PATTERN.row_text(row) in err for row in (4, 11))
    assert "--onto" in err
    with table.open(encoding="utf-8", newline="") as file:
        told = np.array([[float(row["x_m"]), float(row["y_m"])] for row in csv.DictReader(file)])
    assert np.median(np.linalg.norm(told - xy, axis=1)[20:]) < 5e-3


def test_for_programs(tomoskin, tmp_path, presses, touched):
    calibration = tmp_path / "c.npz"
    code, out, _ = tomoskin("calibrate", "touch", presses, "--out", calibration, "--json")
    found = json.loads(out)
    assert code == 0
    assert found["presses"] == 40
    assert found["remarks"][0]["frame"] == 7
    assert found["mean_mm"] >= found["median_mm"] > 0
    assert not found["is_guess"]
    assert 0.8 <= found["held_by_90_percent_ellipses"] <= 1
    code, out, _ = tomoskin("locate", touched[0], "--calibration", calibration, "--json")
    assert code == 0
    assert len(json.loads(out)) == 30


@pytest.mark.parametrize("lag", [11.0, -0.01, np.nan])
def test_a_lag_that_no_sheet_has_is_refused(tomoskin, tmp_path, lag):
    dv, xy = frames(30, 0)
    presses, made = tmp_path / "presses.npz", tmp_path / "c.npz"
    np.savez(presses, dv=dv, xy_m=xy, drive=PATTERN.drive, measure=PATTERN.measure)
    tomoskin("calibrate", "touch", presses, "--out", made)
    np.savez(made, **{**np.load(made), "slide_lag_m": lag})
    code, _, errors = tomoskin("locate", presses, "--calibration", made)
    assert code == 1
    assert f"c.npz: expected a slide_lag from 0 to 0.1 m, got {lag:g}" in errors


def test_frames_without_a_label_are_not_learnt_from(tomoskin, tmp_path):
    dv, xy = frames(30, 0)
    xy[10:20] = np.nan
    path = tmp_path / "some.npz"
    np.savez(path, dv=dv, xy_m=xy, drive=PATTERN.drive, measure=PATTERN.measure)
    code, out, _ = tomoskin("calibrate", "touch", path, "--out", tmp_path / "c.npz")
    assert code == 0
    assert out.startswith("20 presses")


@pytest.mark.parametrize("n", [10, 30])
def test_presses_that_do_not_show_in_the_data_are_said(tomoskin, tmp_path, n):
    random = np.random.default_rng(n)
    path = tmp_path / "noise.npz"
    np.savez(
        path,
        dv=random.normal(size=(n, PATTERN.n_meas)),
        xy_m=random.uniform(-0.07, 0.07, (n, 2)),
        drive=PATTERN.drive,
        measure=PATTERN.measure,
    )
    code, out, err = tomoskin("calibrate", "touch", path, "--out", tmp_path / "c.npz", "--json")
    assert code == 0
    assert "the data hardly depend on the position" in err
    assert json.loads(out)["is_guess"]


def test_presses_are_added_to_an_older_calibration(tomoskin, tmp_path, presses):
    old, new = tmp_path / "old.npz", tmp_path / "new.npz"
    assert tomoskin("calibrate", "touch", presses, "--skin", SKIN, "--out", old)[0] == 0
    dv, xy = frames(3, 5)
    few = tmp_path / "few.npz"
    np.savez(few, dv=dv, xy_m=xy, drive=PATTERN.drive, measure=PATTERN.measure)
    code, out, err = tomoskin("calibrate", "touch", few, "--onto", old, "--out", new)
    assert (code, err) == (0, "")
    assert out.startswith("43 presses")
    assert "an older press  uncertain: has the same data as press 2" in out
    code, _, err = tomoskin(
        *("calibrate", "touch", few, "--onto", old, "--out", tmp_path / "other.npz"),
        *("--skin", "textile-square-16"),
    )
    assert code == 1
    assert 'it was learnt on "textile-disc-8" and is used on "textile-' in err


def test_a_calibration_of_another_skin_is_refused(tomoskin, tmp_path, presses, touched):
    calibration = tmp_path / "c.npz"
    assert tomoskin("calibrate", "touch", presses, "--skin", SKIN, "--out", calibration)[0] == 0
    code, _, err = tomoskin(
        "locate", touched[0], "--calibration", calibration, "--skin", "textile-disc-16"
    )
    assert code == 1
    assert 'it was learnt on "textile-disc-8" and is used on "textile-' in err
    more = tmp_path / "sixteen.npz"
    wide = Pattern.adjacent(16)
    np.savez(more, dv=np.ones((3, wide.n_meas)), drive=wide.drive, measure=wide.measure)
    code, _, err = tomoskin("locate", more, "--calibration", calibration)
    assert code == 1
    assert "E1 to E16" in err


def test_what_holds_no_labels_or_wrong_ones_is_refused(tomoskin, tmp_path, presses, touched):
    out = tmp_path / "c.npz"
    code, _, err = tomoskin("calibrate", "touch", touched[0], "--out", out)
    assert code == 1
    assert "no labels" in err
    with np.load(presses) as kept:
        arrays = dict(kept)
    np.savez(presses, **(arrays | {"xy_m": 1e3 * arrays["xy_m"]}))
    for skin in ((), ("--skin", SKIN)):
        code, _, err = tomoskin("calibrate", "touch", presses, *skin, "--out", out)
        assert code == 1
        assert "no label within 10 m (give labels in metres)" in err
        assert not out.exists()
    code, _, err = tomoskin("locate", presses, "--calibration", presses)
    assert code == 1
    assert "not a calibration" in err


def test_measurements_that_never_have_a_value_are_named(tomoskin, tmp_path, presses):
    out = tmp_path / "c.npz"
    with np.load(presses) as kept:
        arrays = dict(kept)
    arrays["dv"][:, [3, 17]] = np.nan
    np.savez(presses, **arrays)
    code, said, _ = tomoskin("calibrate", "touch", presses, "--skin", SKIN, "--out", out)
    assert code == 0
    assert "measurements without a value in any press: 3, 17\n" in said


def test_presses_without_times_are_located_each_by_itself(tomoskin, tmp_path):
    """A mean over frames of different presses was off by 40 mm, without a word."""
    paths = [tmp_path / f"{name}.npz" for name in ("made", "asked", "touch")]
    common = ("simulate", "--skin", "textile-disc-16", "--processes", 1)
    for n, seed, path in ((50, 1, paths[0]), (30, 2, paths[1])):
        code, _, error = tomoskin(*common, "--presses", n, "--seed", seed, "--out", path)
        assert code == 0, error
    words = ("--skin", "textile-disc-16")
    code, _, error = tomoskin("calibrate", "touch", paths[0], *words, "--out", paths[2])
    assert code == 0, error
    table = tmp_path / "touches.csv"
    image = ("image", paths[1], *words, "--calibration", paths[2], "--touches", table)
    code, _, error = tomoskin(*image)
    assert code == 0, error
    with np.load(paths[1]) as kept:
        places = kept["xy_m"]
    with table.open() as file:
        rows = [(int(r["frame"]), float(r["x_m"]), float(r["y_m"])) for r in csv.DictReader(file)]
    missed = np.array([np.hypot(x - places[k][0], y - places[k][1]) for k, x, y in rows])
    assert len(missed) >= 27
    assert missed.mean() < 0.005
    assert missed.max() < 0.03
