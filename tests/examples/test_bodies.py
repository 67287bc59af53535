"""The examples on soft bodies make their figures; their checks hold, and fail on wrong data."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

BODIES = ["fig62_palpation"]


@pytest.mark.parametrize("name", BODIES)
def test_the_figure_is_made_and_the_numbers_hold(imported, name, tmp_path):
    module = imported(name)
    found = module.main(["--out", str(tmp_path)])
    assert all(math.isfinite(value) for value in found.values())
    data = (tmp_path / f"{name}.png").read_bytes()
    width, height = struct.unpack(">II", data[16:24])
    assert width > 400
    assert height > 250
    assert "Source saw:" in module.__doc__
    assert "Checked:" in module.__doc__


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
@pytest.mark.parametrize("name", BODIES)
def test_the_numbers_hold_on_other_seeds(imported, name, seed, tmp_path):
    assert imported(name).main(["--seed", str(seed), "--out", str(tmp_path)])


def test_on_foam_without_balls_nothing_stiff_is_found(imported):
    example = imported("fig62_palpation")
    bed = example.Bed(1)
    assert example.Palpation(bed.skin)(bed.stages(())) == []


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
