"""A sheet that conducts otherwise along than across: a run knows it soon after its reference."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from tomoskin.core import Voltages
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import triangulate
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Setting, prepare

INTERVAL, NOISE = 0.056, 1e-6
PLACE, RADIUS, DEPTH = (0.02, -0.015), 0.008, -0.7
ALONG = 0.3
"""Of log σ, as a sheet on a cylinder of 40 mm has it."""


@pytest.fixture(scope="module")
def skin():
    return Skin.load("textile-disc-16")


@pytest.fixture(scope="module")
def wrapped(skin):
    """(n_meas,) V untouched and touched, on a mesh of its own."""
    mesh = triangulate(skin.outline, skin.arcs, 5000, seed=12)
    model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)
    sheet = skin.conductivity * np.tile(expm(np.diag([ALONG, -ALONG])), (len(mesh.cells), 1, 1))
    apart = np.linalg.norm(mesh.centroids - PLACE, axis=1)
    dent = np.exp(DEPTH * np.exp(-((apart / RADIUS) ** 2)))
    return model.solve(sheet).voltages, model.solve(sheet * dent[:, None, None]).voltages


def followed(skin, wrapped, untouched_seconds, interval=INTERVAL):
    """Touches of a run that is pressed so long after its reference."""
    random = np.random.default_rng(5)
    pipeline = Pipeline(prepare(skin), setting=Setting(rounding=0.0))
    rest = 20 + round(untouched_seconds / interval)
    for number in range(rest + 6):
        volts = wrapped[number >= rest] + NOISE * random.standard_normal(len(wrapped[0]))
        lacking = np.zeros(len(volts), dtype=bool)
        time = number * interval
        result = pipeline.follow(Voltages(volts, lacking, time, time, number))
    return result.touches


@pytest.mark.parametrize("interval", [INTERVAL, 0.02])
def test_touches_are_where_they_are_a_second_and_a_half_after_the_reference(
    skin, wrapped, interval
):
    (touch,) = followed(skin, wrapped, 1.5, interval)
    assert math.dist((touch.detection.x, touch.detection.y), PLACE) < 3e-3
