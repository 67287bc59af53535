"""What the data cannot tell of a skin, as its pages and files show it."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError, IntArray
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, Unresolved, prepare

NONE = np.empty(0, np.int64)


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    return prepare(Skin.load("textile-disc-8").altered({"mesh": {"cells": 600}}))


def open_part(prepared: Prepared, excluded: IntArray = NONE) -> Unresolved:
    return Unresolved.of(prepared, prepared.choice.alpha, excluded)


def test_of_a_usual_touch_more_than_half_stays_open_with_eight_electrodes(
    prepared: Prepared,
) -> None:
    found = open_part(prepared)
    assert found.radius == pytest.approx(0.0195, rel=0.01)
    assert 0.5 < found.values.min() < found.values.max() < 1.0


def test_sixteen_electrodes_leave_less_open(prepared: Prepared) -> None:
    finer = prepare(Skin.load("textile-disc-16").altered({"mesh": {"cells": 600}}))
    assert np.median(open_part(finer).values) < np.median(open_part(prepared).values)


def test_a_lost_electrode_leaves_more_open_beside_it(prepared: Prepared) -> None:
    lost = open_part(prepared, prepared.pattern.rows_of(2)).values - open_part(prepared).values
    at = prepared.mesh.centroids[lost.argmax()]
    assert np.linalg.norm(at - prepared.skin.electrode_centres[2]) < 0.04
    assert lost.max() > 0.1
    with pytest.raises(DataError, match="at least one row"):
        open_part(prepared, np.arange(prepared.pattern.n_meas))
