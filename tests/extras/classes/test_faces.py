"""The examples of the thesis that name classes make their figures; their checks hold."""

from __future__ import annotations

import numpy as np
import pytest

from examples.figure_made import check_figure

EXAMPLES = ["fig64_chopped", "fig64_face"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_figure_is_made_and_the_checks_hold(imported, published, name, tmp_path):
    check_figure(imported(name), published[name], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_numbers_hold_on_other_seeds(imported, name, seed, tmp_path):
    assert imported(name).main(["--seed", str(seed), "--out", str(tmp_path)])


def test_a_face_that_moves_as_a_whole_changes_nothing(imported):
    face, example = imported("face"), imported("fig64_face")
    relaxed = face.face(600)
    rest = example.model_of(relaxed).voltages
    everywhere = [((0.0, 0.0), 1e6, (3.0, -5.0, 2.0))]
    moved = example.model_of(relaxed.moved(everywhere))
    assert np.abs(moved.voltages - rest).max() < 1e-6 * np.abs(rest).max()
    smile = example.model_of(relaxed.moved(face.EXPRESSIONS["smile"])).voltages
    assert np.abs(smile - rest).max() > 0.05 * np.abs(rest).max()


@pytest.mark.slow
def test_small_moves_of_electrodes_are_found(imported):
    example = imported("fig64_face")
    moving = example.Moving()
    state = example.model_of(moving.face)
    way = np.zeros((8, 3))
    way[3] = (2e-3, 0.0, 0.0)
    dv = np.einsum("med,ed->m", state.movement_jacobian, way) / np.abs(state.voltages)
    found = moving(dv)
    named = example.most_moved([found], np.linalg.norm(way, axis=1)[None])
    assert named.all()
    assert found[1][3, 0] > 0.5e-3


def test_a_run_counts_with_five_of_six(imported):
    right = np.ones((4, 6), bool)
    right[0, 0] = right[1, :2] = False
    assert imported("fig64_face").whole_runs(right) == 0.75
