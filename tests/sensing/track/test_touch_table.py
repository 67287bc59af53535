"""Columns of touches."""

from __future__ import annotations

import numpy as np

from tomoskin.core import Amount, Detection, Touch
from tomoskin.model.mesh import Plane
from tomoskin.sensing.track import columns_of, touch_columns

FAR = Detection(0.1, -0.2, 1e-3, np.nan, 3e-4, -0.5, np.empty(0))
PRESSED = Detection(0.0, 0.0, 1e-3, 1e-3, 3e-4, -0.5, np.empty(0), force=Amount(2.0, 1.5, 2.5))


def test_no_touches_have_columns_all_the_same():
    table = touch_columns([(0, 0.5, ())], Plane())
    assert tuple(table) == columns_of()
    assert {len(column) for column in table.values()} == {0}
    assert table["id"].dtype == np.int64


def test_what_is_not_known_is_nan_or_minus_one():
    table = touch_columns([(None, 0.5, (Touch(4, "decrease", 0.0, FAR),))])
    assert table["frame"].tolist() == [-1]
    assert np.isnan(table["sd_y_m"][0])
    assert table["sd_x_m"][0] == 1e-3


def test_forces_are_asked_for():
    touches = (Touch(1, "decrease", 0.0, PRESSED), Touch(2, "decrease", 0.0, FAR))
    table = touch_columns([(3, 0.5, touches)], measured=("force",))
    assert table["frame"].tolist() == [3, 3]
    assert table["force_n"][0] == 2.0
    assert np.isnan(table["force_high_n"][1])
    assert table["force_state"].tolist() == ["calibrated", ""]
