"""Touches fitted on a sheet that is curved both ways, in its own coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Response, SpotFinder, SpotModel, spots_of
from tomoskin.twin import Press, TwinSettings, TwinSkin

NOISE = 15e-6
PLACES = [(0.0, 0.0), (0.05, 0.02), (-0.03, -0.06)]


@pytest.fixture(scope="module")
def skin() -> Skin:
    return Skin.load("textile-disc-16").altered({"surface": {"shape": "cap", "radius": "100 mm"}})


@pytest.fixture(scope="module")
def model(skin: Skin) -> ForwardModel:
    mesh = skin.mesh()
    assert mesh.metric is not None
    return ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)


def test_a_press_on_a_cap_is_placed(skin: Skin, model: ForwardModel) -> None:
    noise = NOISE**2 * np.eye(skin.pattern().n_meas)
    finder = SpotFinder(SpotModel.of(skin, model), skin, model.mesh, noise)
    twin, random = TwinSkin.of(skin, TwinSettings.preset("ideal")), np.random.default_rng(1)
    rest = twin.model.voltages(twin.resistance())
    for x, y in PLACES:
        twin.set_presses((Press(x, y, 3.0, 0.012),))
        change = twin.model.voltages(twin.resistance()) - rest
        dv = change + NOISE * random.standard_normal(len(change))
        (found,) = finder.push(dv, np.zeros((len(dv), 0)))
        assert np.hypot(found.x - x, found.y - y) < 3e-3


def test_derivatives_hold_on_a_cap(skin: Skin, model: ForwardModel) -> None:
    response = Response(model.at(skin.conductivity))
    spot = spots_of([[0.03, -0.02]], 0.02, -0.3)
    _, slopes, _ = response.expanded(spot)
    for column, step in enumerate((1e-5, 1e-5, 1e-4, 1e-9)):
        more, less = spot.copy(), spot.copy()
        more[0, column] += step
        less[0, column] -= step
        ahead, behind = response.changes([more, less])
        size = np.abs(slopes[:, column]).max()
        assert np.abs((ahead - behind) / (2 * step) - slopes[:, column]).max() < 0.02 * size
