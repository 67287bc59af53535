"""Cells of an image that lie in a disc, against all cells one by one."""

from __future__ import annotations

import numpy as np
import pytest

from shapes import disc
from tomoskin.sensing.fit.sight import CellDiscs


@pytest.mark.parametrize("radius", [1e-6, 0.004, 0.03, 0.5])
def test_they_are_those_within_the_radius_or_the_nearest(radius: float) -> None:
    mesh = disc(8, 600, width=0.01)
    cells = CellDiscs.of(mesh)
    for x, y in np.random.default_rng(3).uniform(-0.11, 0.11, (20, 2)).tolist():
        away = np.hypot(*(mesh.centroids - [x, y]).T)
        expected = np.flatnonzero(away <= max(radius, away.min()))
        assert sorted(cells.within(x, y, radius).tolist()) == expected.tolist()
