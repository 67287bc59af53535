"""``tomoskin calibrate rub``, and ``calibrate touch --unlabelled``."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from cli.test_calibrate import frames
from extras.alignment.rubbed import PATTERN, SKIN, rubbed_with_a_lag
from tomoskin import ForwardModel
from tomoskin.learning import TOUCH
from tomoskin.model.skin import Skin


def everywhere(n, seed):
    """Places all over the skin."""
    rim = Skin.load(SKIN).mesh().points.max()
    rng = np.random.default_rng(seed)
    radius, angle = rim * np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@pytest.mark.parametrize("lag", [0.012, 0.0])
def test_a_rub_tells_how_far_the_sheet_lags(tomoskin, tmp_path, lag):
    path, made = tmp_path / "rubbed.npz", tmp_path / "c.npz"
    dv, time = rubbed_with_a_lag(lag)
    np.savez(path, dv=dv, time_s=time, drive=PATTERN.drive, measure=PATTERN.measure)
    code, out, _ = tomoskin("calibrate", "rub", path, "--skin", SKIN, "--out", made)
    said = re.search(r"the sheet lags (\d+) mm behind a finger that slides", out)
    assert code == 0
    assert float(said[1] if said else 0) == pytest.approx(1e3 * lag, abs=3)
    kept = TOUCH.read(made).model
    assert kept.presses.slide_lag == pytest.approx(lag, abs=3e-3)
    assert kept.updated(dv[:1], [[0.0, 0.0]]).presses.slide_lag == kept.presses.slide_lag


def test_faint_touches_of_a_rub_are_found_as_the_pipeline_finds_them(tomoskin, tmp_path):
    """None stands out of the noise of a frame by itself; untouched frames are left out."""
    rng, skin = np.random.default_rng(8), Skin.load(SKIN)
    model = ForwardModel(skin.mesh(), PATTERN, contact_impedance=skin.contact_impedance)
    rest = skin.current * model.solve(skin.conductivity).voltages
    dv, _ = rubbed_with_a_lag(0.0)
    dv *= 0.03 * rest.mean() / np.abs(dv).max()
    noise = np.sqrt(np.mean(dv**2)) / 3
    frames = np.vstack([np.zeros((60, PATTERN.n_meas)), dv, np.zeros((60, PATTERN.n_meas))])
    path = tmp_path / "faint.npz"
    volts = rest + frames + noise * rng.normal(size=frames.shape)
    tables = {"drive": PATTERN.drive, "measure": PATTERN.measure}
    np.savez(path, voltages=volts, time_s=0.05 * np.arange(len(volts)), **tables)
    options = ("--skin", SKIN, "--reference", "first:50", "--out", tmp_path / "c.npz", "--json")
    code, out, _ = tomoskin("calibrate", "rub", path, *options)
    assert code == 0
    assert 0.6 * len(dv) < json.loads(out)["touched_frames"] < 1.02 * len(dv)


def test_touches_without_labels_align_an_older_calibration(tomoskin, tmp_path):
    old, new, path, presses = (tmp_path / f"{name}.npz" for name in ("old", "new", "all", "known"))
    dv, xy = frames(100, 3, everywhere(100, 3))
    np.savez(presses, dv=dv, xy_m=xy, drive=PATTERN.drive, measure=PATTERN.measure)
    assert tomoskin("calibrate", "touch", presses, "--skin", SKIN, "--out", old)[0] == 0
    dv, xy = frames(120, 5, everywhere(120, 5))
    gains = 2 * np.exp(0.4 * np.random.default_rng(1).normal(size=PATTERN.n_meas))
    np.savez(path, dv=dv * gains, drive=PATTERN.drive, measure=PATTERN.measure)
    code, out, err = tomoskin(
        *("calibrate", "touch", path, "--onto", old, "--unlabelled", "--out", new)
    )
    assert code == 0
    assert out.startswith("220 presses")
    assert "times as large as in the calibration" in err
    missed = {}
    for calibration in (old, new):
        code, out, err = tomoskin("locate", path, "--calibration", calibration, "--json")
        assert code == 0
        told = np.array([[row["x_m"], row["y_m"]] for row in json.loads(out)])
        missed[calibration] = np.median(np.linalg.norm(told - xy, axis=1))
        assert ("Ellipses are widened" in err) == (calibration == old)
    assert missed[new] < 0.8 * missed[old]
    code, _, err = tomoskin("calibrate", "touch", path, "--unlabelled", "--out", tmp_path / "x.npz")
    assert code == 1
    assert "--onto" in err
