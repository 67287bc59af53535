"""Many touches at once: the same changes as those of one after the other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tomoskin import ForwardModel, Skin
from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import State, TouchBatch, batch
from tomoskin.model.forward.engine_choice import VARIABLE
from tomoskin.model.forward.solution import padded

DEPTHS = np.array([-0.1, -2.7, 0.8])


def sheet() -> State:
    skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": 700}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    uneven = np.random.default_rng(4).normal(0.0, 0.2, len(skin.mesh().cells))
    return model.at(skin.conductivity * np.exp(uneven))


def touches(state: State) -> tuple[IntArray, IntArray, FloatArray]:
    """From a few cells in the middle and over an electrode up to nearly the whole sheet."""
    centroids = state.model.mesh.centroids
    cells, height = [], []
    for x, radius in ((0.0, 0.01), (0.03, 0.02), (0.1, 0.02), (-0.02, 0.05), (0.01, 0.09)):
        away = np.linalg.norm(centroids - (x, 0.005), axis=1)
        cells.append(np.flatnonzero(away < radius))
        height.append(1.0 - (away[cells[-1]] / radius) ** 2)
    starts = np.cumsum([0, *map(len, cells)])
    return starts, np.concatenate(cells), np.concatenate(height)


@pytest.mark.parametrize("engine", ["scipy", ""])
@pytest.mark.parametrize("most", [batch.MOST_BYTES, 1 << 20], ids=["whole", "in parts"])
def test_many_touches_at_once_change_what_each_changes_alone(
    engine: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if engine:
        monkeypatch.setenv(VARIABLE, engine)
    monkeypatch.setattr(batch, "MOST_BYTES", most)
    state = sheet()
    starts, cells, height = touches(state)
    found = TouchBatch(state).change((starts, cells, height), DEPTHS)
    ground = state.basis[state.model.assembly.n_points :]
    for touch, (first, end) in enumerate(pairwise(starts)):
        for change, depth in zip(found[touch], DEPTHS, strict=True):
            sigma = state.conductivity.copy()
            sigma[cells[first:end]] *= np.exp(depth * height[first:end])
            exact = state.model.at(sigma).voltages
            ours = state.model.voltages(padded(ground + change))
            np.testing.assert_allclose(ours, exact, atol=1e-9 * np.abs(exact).max())


def test_a_touch_that_reaches_nothing_changes_nothing() -> None:
    state = sheet()
    starts, cells, height = touches(state)
    none = np.concatenate([[0], starts])
    found = TouchBatch(state).change((none, cells, height), DEPTHS[:1])
    assert not found[0].any()
    assert found[1].any()
