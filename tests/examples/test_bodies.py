"""The examples on models make their figures; their checks hold, and fail on wrong data."""

from __future__ import annotations

import numpy as np
import pytest

from examples.figure_made import check_figure
from tomoskin.model.mesh import simplex_measure

MODELS = ["fig62_palpation", "fit_bound", "newtons", "soft_volume"]

SHORT = {
    "fig62_palpation": {"RESPONSES": (0.05, 1.0), "ELECTRODES": (16,)},
    "fit_bound": {"RINGS": 1, "FRAMES": 2, "SKINS": ("textile-disc-8",)},
    "newtons": {"PRESSES": 10, "STAGE": 0.3, "STEPS": (3.0, 9.0, 3.0), "STEP": 0.5},
}
"""What makes the long ones short; their checks are the same."""


@pytest.mark.parametrize("name", MODELS)
def test_the_figure_is_made_and_the_checks_hold(imported, published, name, tmp_path, monkeypatch):
    module = imported(name)
    for knob, value in SHORT.get(name, {}).items():
        monkeypatch.setattr(module, knob, value)
    check_figure(module, published[name], tmp_path, is_whole=name not in SHORT)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHORT)
def test_the_numbers_are_those_of_the_gallery(imported, published, name, tmp_path):
    found = imported(name).main(["--out", str(tmp_path)])
    assert found.keys() == published[name].values.keys()
    assert published[name].broken(found) == []


def test_with_the_preset_s_response_no_ball_is_found(imported):
    example = imported("fig62_palpation")
    balls = (example.between(-20e-3, 12e-3, example.LARGE),)
    bed = example.Bed(1, 0.05)
    assert example.Palpation(bed.skin)(bed.stages(balls)) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
@pytest.mark.parametrize("name", MODELS)
def test_the_numbers_hold_on_other_seeds(imported, name, seed, tmp_path):
    assert imported(name).main(["--seed", str(seed), "--out", str(tmp_path)])


@pytest.mark.slow
def test_on_foam_without_balls_nothing_stiff_is_found(imported):
    example = imported("fig62_palpation")
    bed = example.Bed(1)
    assert example.Palpation(bed.skin)(bed.stages(())) == []


@pytest.mark.slow
def test_balls_elsewhere_are_a_failure(imported, monkeypatch, tmp_path):
    example = imported("fig62_palpation")
    measured = example.Bed.stages
    moved = (example.between(25e-3, 25e-3, example.LARGE), example.between(-25e-3, -25e-3, 8e-3))
    monkeypatch.setattr(example.Bed, "stages", lambda bed, _: measured(bed, moved))
    with pytest.raises(AssertionError, match="from their places"):
        example.main(["--out", str(tmp_path)])


def test_what_is_missed_counts_as_infinitely_far(imported):
    example = imported("fig62_palpation")
    assert np.isinf(example.errors([], [example.between(0.0, 0.0, 8e-3)])).all()


def test_a_dent_in_the_block_keeps_its_volume(imported):
    example = imported("soft_volume")
    mesh = example.body(300, 6, seed=3)
    pressed = simplex_measure(example.indented(mesh.points, example.TOUCH), mesh.cells)
    assert pressed.sum() == pytest.approx(mesh.volumes.sum(), rel=0.01)
    below = np.linalg.norm(mesh.centroids[:, :2] - example.TOUCH, axis=1).argmin()
    assert pressed[below] == pytest.approx(mesh.volumes[below], rel=0.1)
    still = mesh.points[:, 2] == 0
    assert example.indented(mesh.points, example.TOUCH)[still, 2] == pytest.approx(0.0)


def test_the_centre_is_that_of_what_is_low(imported):
    example = imported("soft_volume")
    mesh = example.body(300, 6, seed=3)
    found = example.centre(mesh, example.with_ball(mesh) - example.SILICONE)
    assert np.linalg.norm(found - example.BALL) < 3e-3
