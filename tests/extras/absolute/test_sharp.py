"""``tomoskin image --sharp``: edges in place of a smooth image."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin

PLACE = (0.03, 0.04)


@pytest.fixture
def recording(tmp_path):
    """A sheet of another board, untouched and with an object."""
    skin = Skin.load("textile-disc-16").altered({"mesh": {"cells": 900}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    sigma = np.full(len(model.mesh.cells), skin.conductivity)
    near = np.linalg.norm(model.mesh.centroids - PLACE, axis=1) < 0.02
    values = [model.solve(s).voltages for s in (sigma, np.where(near, 0.6 * sigma, sigma))]
    rows = skin.pattern()
    path = tmp_path / "x.npz"
    np.savez(path, voltages=np.array(values), drive=rows.drive, measure=rows.measure)
    return path


def test_more_of_what_changes_is_as_much_as_its_peak(tomoskin, tmp_path, recording):
    shown = {}
    for name, more in (("smooth", ()), ("sharp", ("--sharp",))):
        out = tmp_path / f"{name}.npz"
        code, _, err = tomoskin(
            "image", recording, "--skin", "textile-disc-16", "--out", out, *more
        )
        assert (code, "sharpening" in err) == (0, False)
        with np.load(out) as images:
            shown[name] = np.abs(images["images"][1])
            peak = images["points"][images["cells"][shown[name].argmax()]].mean(axis=0)
        assert np.hypot(*(peak - PLACE)) < 0.02
    flat = [
        np.mean(one > 0.8 * one.max()) / np.mean(one > 0.3 * one.max()) for one in shown.values()
    ]
    assert flat[1] > 1.3 * flat[0]
