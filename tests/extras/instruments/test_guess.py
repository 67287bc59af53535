"""``tomoskin skin guess``: a skin file for a recording of another board, and an image with it."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin


@pytest.fixture
def recording(tmp_path):
    """A round sheet, untouched and with an object; in millivolts of another current."""
    skin = Skin.load("textile-disc-16").altered({"mesh": {"cells": 900}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, 3e-4)
    near = np.hypot(*(model.mesh.centroids - (0.03, 0.04)).T) < 0.02
    sigma = np.where(near, 0.7, 1.0) * skin.conductivity
    values = [model.solve(s).voltages for s in (skin.conductivity, sigma)]
    rows = {"drive": model.pattern.drive, "measure": model.pattern.measure}
    np.savez(tmp_path / "x.npz", voltages=1e3 * np.array(values), **rows)
    return tmp_path / "x.npz"


def test_an_image_with_the_guessed_skin(tomoskin, tmp_path, recording):
    skin = tmp_path / "guess.toml"
    code, out, _ = tomoskin("skin", "guess", recording, "--out", skin)
    assert (code, skin.exists()) == (0, True)
    assert f"next: tomoskin image {recording} --skin {skin}" in out
    assert tomoskin("skin", "guess", recording, "--out", skin)[0] != 0  # it is there
    code, out, err = tomoskin("image", recording, "--skin", skin, "--out", tmp_path / "image.npz")
    assert (code, err) == (0, "")
    said = "no data can tell how this is turned or mirrored: "
    assert f'{said}first = "90 deg" and order = "clockwise" of [electrodes]' in out
    with np.load(tmp_path / "image.npz") as images:
        cell = images["cells"][np.abs(images["images"][1]).argmax()]
        peak = images["points"][cell].mean(axis=0)
    assert np.hypot(*(peak - (0.03, 0.04))) < 0.02
    assert tomoskin("skin", "guess", recording)[1].startswith("# Guessed from x.npz.")


def test_exchanged_electrodes_are_named(tomoskin, tmp_path, recording):
    wires = np.arange(16)
    wires[[4, 5]] = 5, 4
    skin = Skin.load("textile-disc-16").altered({"mesh": {"cells": 900}})
    own = skin.pattern()
    crossed = Pattern.from_tables(wires[own.drive], wires[own.measure])
    model = ForwardModel(skin.mesh(), crossed, skin.contact_impedance, 3e-4)
    values = model.solve(skin.conductivity).voltages[None]
    np.savez(tmp_path / "y.npz", voltages=values, drive=own.drive, measure=own.measure)
    tomoskin("skin", "guess", recording, "--out", tmp_path / "guess.toml")
    err = tomoskin("image", tmp_path / "y.npz", "--skin", tmp_path / "guess.toml")[2]
    assert "its untouched frame looks as if E5 and E6 are exchanged: check its tables" in err
