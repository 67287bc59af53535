"""What a reference tells of a sheet that conducts otherwise along than across."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from tomoskin.core import finished
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import triangulate
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.sensing.fit import SpotModel


@pytest.fixture(scope="module")
def skin():
    return Skin.load("textile-disc-16")


@pytest.fixture(scope="module")
def spots(skin):
    return SpotModel.of(skin, prepare(skin).model)


def voltages(skin, grain, factor=1.3):
    """Of a sheet with that D on a mesh of its own, by the tensor itself."""
    mesh = triangulate(skin.outline, skin.arcs, 5000, seed=11)
    model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)
    within = expm(np.array([[grain[0], grain[1]], [grain[1], -grain[0]]]))
    tensor = factor * skin.conductivity * np.tile(within, (len(mesh.cells), 1, 1))
    return model.solve(tensor).voltages


@pytest.mark.parametrize("grain", [(-0.1, 0.0), (0.08, -0.15)])
def test_a_reference_tells_along_which_way_a_sheet_conducts(skin, spots, grain):
    told = finished(spots.fitting(voltages(skin, grain)))
    size = np.hypot(*grain)
    metric = told.response.state.model.mesh.metric
    wanted = expm(-np.array([[grain[0], grain[1]], [grain[1], -grain[0]]]))
    assert metric == pytest.approx(np.tile(wanted, (len(metric), 1, 1)), abs=0.05 * size)
    assert np.linalg.det(metric) == pytest.approx(1.0, abs=1e-12)


def test_a_sheet_that_conducts_alike_in_all_directions_stays_as_it_is(skin, spots):
    assert finished(spots.fitting(voltages(skin, (0.005, 0.0)))) is spots
    uneven = voltages(skin, (0.0, 0.0)) * np.exp(
        0.2 * np.random.default_rng(1).standard_normal(208)
    )
    assert finished(spots.fitting(uneven)) is spots


def test_rows_without_a_value_do_not_count(skin, spots):
    lacking = voltages(skin, (-0.1, 0.0))
    lacking[::7] = np.nan
    metric = finished(spots.fitting(lacking)).response.state.model.mesh.metric
    assert metric[0] == pytest.approx(np.diag(np.exp([0.1, -0.1])), abs=0.005)
