"""Touches are fitted on the sheet that is nearest to how the body stands."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.pipeline.body_sheets import BodySheets
from tomoskin.sensing.signal import Reference

MEAN = np.ones(40)


class Sheet:
    """Stands for a model of a sheet: what it was fitted to."""

    even = None

    def __init__(self, mean):
        self.mean = mean

    def fitting(self, mean, deviation):
        assert deviation.shape == mean.shape
        yield
        return Sheet(mean)


@pytest.fixture
def sheets():
    reference = Reference(MEAN, 1e-3 * MEAN, 20)
    poses = np.linspace(0, 0.2, 11)[:, None] * MEAN
    return BodySheets(Sheet(MEAN), reference, poses)


def done(steps):
    return [better for better in steps if better is not None]


def test_a_pose_that_is_far_from_all_sheets_gets_its_own(sheets, prepared):
    assert done(sheets.steps(prepared, 0.1 * MEAN)) == []  # fitted, and taken in the next frame
    (better,) = done(sheets.steps(prepared, 0.11 * MEAN))
    assert better.spots.mean == pytest.approx(1.1 * MEAN)
    rest = Reference(MEAN, 1e-3 * MEAN, 20)
    assert sheets.shifted(rest).mean == pytest.approx(1.1 * MEAN)


def test_poses_that_were_learnt_are_fitted_while_the_body_is_at_rest(sheets, prepared):
    rest = np.zeros_like(MEAN)
    count = 0
    while (steps := sheets.steps(prepared, rest)) is not None:
        assert done(steps) == []
        count += 1
    assert count == 2  # that at 20 %, then one between: all others are near enough
    (better,) = done(sheets.steps(prepared, 0.2 * MEAN))
    assert better.spots.mean == pytest.approx(1.2 * MEAN)
    (back,) = done(sheets.steps(prepared, rest))
    assert back.spots is sheets.rest
