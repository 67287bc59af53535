"""What was prepared belongs together: by identity, not by length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.core import DataError, Detection, ModelError
from tomoskin.imaging import OneStep
from tomoskin.learning import FORCE, AmountModel, LabelledPresses
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.sensing.segment import Segmenter

PREPARED = prepare(Skin.load("textile-disc-8").altered({"inverse": {"alpha": 0.1}}))
MOVED = Mesh(1.01 * PREPARED.mesh.points, PREPARED.mesh.cells, PREPARED.mesh.electrodes)


def test_an_operator_of_another_mesh_with_as_many_cells() -> None:
    other = OneStep(ForwardModel(MOVED, PREPARED.pattern, 0.01), alpha=0.1)
    with pytest.raises(ModelError, match=f"operator belongs to mesh {MOVED.identity}, the skin to"):
        replace(PREPARED, operator=other)


def test_an_operator_of_another_pattern_with_as_many_rows() -> None:
    turned = Pattern.from_tables(PREPARED.pattern.drive[:, ::-1], PREPARED.pattern.measure)
    other = OneStep(ForwardModel(PREPARED.mesh, turned, 0.01), alpha=0.1)
    with pytest.raises(DataError, match=f"of pattern {turned.identity}"):
        replace(PREPARED, operator=other)


def test_a_segmenter_of_another_mesh() -> None:
    with pytest.raises(ModelError, match=f"the segmenter to mesh {MOVED.identity}"):
        replace(PREPARED, segmenter=Segmenter(MOVED, PREPARED.skin.touch))


def test_a_calibration_that_cannot_serve_with_new_settings_is_refused() -> None:
    weighed = LabelledPresses.of(
        [Detection(0.01 * n, 0.0, 1e-3, 1e-3, 4e-4, -0.01 * n, np.empty(0)) for n in range(1, 7)],
        np.arange(1.0, 7.0), np.arange(6), np.arange(6.0),
    )  # fmt: skip
    forces = FORCE.of(AmountModel.fit(weighed, PREPARED.skin), PREPARED.pattern, PREPARED.skin)
    weighing = PREPARED.calibrated(forces)
    assert prepare(PREPARED.skin.altered({"inverse": {"alpha": 0.2}}), weighing).calibrations
    with pytest.raises(DataError, match="touches found by"):
        prepare(PREPARED.skin.altered({"touch": {"method": "image"}}), weighing)
