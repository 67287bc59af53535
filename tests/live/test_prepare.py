"""What was prepared belongs together: by identity, not by length."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tomoskin.core import DataError, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse import OneStep
from tomoskin.live import prepare
from tomoskin.mesh import Mesh
from tomoskin.pattern import Pattern
from tomoskin.skin import Skin
from tomoskin.touch import Segmenter

PREPARED = prepare(Skin.load("textile-disc-8").altered({"inverse": {"alpha": 0.1}}))
MOVED = Mesh(1.01 * PREPARED.mesh.points, PREPARED.mesh.cells, PREPARED.mesh.electrodes)


def test_an_operator_of_another_mesh_with_as_many_cells() -> None:
    other = OneStep(ForwardModel(MOVED, PREPARED.pattern, 0.01), alpha=0.1)
    with pytest.raises(ModelError, match=f"operator is of mesh {MOVED.identity}, the skin of"):
        replace(PREPARED, operator=other)


def test_an_operator_of_another_pattern_with_as_many_rows() -> None:
    turned = Pattern.from_tables(PREPARED.pattern.drive[:, ::-1], PREPARED.pattern.measure)
    other = OneStep(ForwardModel(PREPARED.mesh, turned, 0.01), alpha=0.1)
    with pytest.raises(DataError, match=f"of pattern {turned.identity}"):
        replace(PREPARED, operator=other)


def test_a_segmenter_of_another_mesh() -> None:
    with pytest.raises(ModelError, match=f"the segmenter of mesh {MOVED.identity}"):
        replace(PREPARED, segmenter=Segmenter(MOVED, PREPARED.skin.touch))
