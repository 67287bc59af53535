"""``tomoskin calibrate mapping``: presses on scrambled wires give a skin file that is right."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labelled_presses import labelled_presses
from tomoskin.learning import ChannelMapping, ring_of
from tomoskin.model.skin import Skin

NAME = "textile-disc-8"
SKIN = Skin.load(NAME)
WIRING = replace(
    ChannelMapping.as_drawn(8).turned(ring_of(SKIN), 3, mirrored=True).swapped(1, 2), reversed=True
)
KEYS = ("voltages", "reference", "drive", "measure", "xy_m")
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def presses(tmp_path: Path) -> Path:
    true = replace(WIRING, reversed=False).applied(SKIN)
    arrays = labelled_presses(true, 1, 12)
    kept = {key: arrays[key] for key in KEYS}
    kept["voltages"], kept["reference"] = -kept["voltages"], -kept["reference"]
    path = tmp_path / "presses.npz"
    np.savez(path, **kept)
    return path


def test_the_skin_file_is_as_it_is_wired(tomoskin: Run, tmp_path: Path, presses: Path) -> None:
    out = tmp_path / "mapped.toml"
    code, said, err = tomoskin("calibrate", "mapping", presses, "--skin", NAME, "--out", out)
    assert (code, err) == (0, "")
    assert WIRING.text(ring_of(SKIN)) in said
    wired = Skin.load(out)
    assert wired.polarity == -1
    np.testing.assert_allclose(
        wired.electrode_centres, SKIN.electrode_centres[list(WIRING.electrodes)], atol=1e-4
    )
    code, said, err = tomoskin("image", presses, "--skin", out, "--json")
    assert (code, err) == (0, "")
    with np.load(presses) as kept:
        xy = kept["xy_m"]
    found = json.loads(said)["touches"]
    missed = [np.hypot(t["x_m"] - xy[t["frame"], 0], t["y_m"] - xy[t["frame"], 1]) for t in found]
    assert len(missed) >= 8
    assert np.nanmedian(missed) < 0.02


def test_too_few_presses_are_refused_with_what_would_tell(
    tomoskin: Run, tmp_path: Path, presses: Path
) -> None:
    with np.load(presses) as kept:
        arrays = dict(kept)
    nearest = int(np.nanargmin(np.linalg.norm(arrays["xy_m"], axis=1)))
    labels = np.full_like(arrays["xy_m"], np.nan)
    labels[nearest] = 0.0
    np.savez(presses, **(arrays | {"xy_m": labels}))
    out = tmp_path / "mapped.toml"
    code, said, err = tomoskin(
        "calibrate", "mapping", presses, "--skin", NAME, "--out", out, "--json"
    )
    assert code == 1
    assert "do not decide it" in err
    assert "a further press is most useful at" in err
    assert not out.exists()
    found = json.loads(said)
    assert not found["sure"]
    assert found["presses"] == 1
    assert sorted(found["places"]) == list(range(8))


def test_another_skin_or_no_label_is_refused(tomoskin: Run, tmp_path: Path, presses: Path) -> None:
    out = tmp_path / "mapped.toml"
    code, _, err = tomoskin(
        "calibrate", "mapping", presses, "--skin", "textile-disc-16", "--out", out
    )
    assert code == 1
    assert "rows are not in the recording" in err
    with np.load(presses) as kept:
        arrays = dict(kept)
    np.savez(presses, **{key: arrays[key] for key in KEYS[:-1]})
    code, _, err = tomoskin("calibrate", "mapping", presses, "--skin", NAME, "--out", out)
    assert code == 1
    assert "no labels" in err
    np.savez(presses, **(arrays | {"xy_m": 1e3 * arrays["xy_m"]}))
    code, _, err = tomoskin("calibrate", "mapping", presses, "--skin", NAME, "--out", out)
    assert code == 1
    assert "within 10 m (give labels in metres)" in err
