"""Calibrations of earlier versions, as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from learning.earlier_files import check_nothing_may_lack, read_earlier
from tomoskin.extras.body import BODY

FILE = Path(__file__).parent / "files" / "body.npz"


def test_a_file_of_an_earlier_version_is_read() -> None:
    own, then = read_earlier(FILE, BODY)
    assert own.pop("names").tolist() == ["angle"]
    then["state"] = then.pop("angle_rad")[:, None]  # now the first coordinate of a state
    then["axis_rad"] = then["axis_rad"][0]
    assert {*own} == {*then}
    for key, array in then.items():
        np.testing.assert_array_equal(own[key], array)


def test_a_file_that_lacks_something_is_refused(tmp_path: Path) -> None:
    check_nothing_may_lack(FILE, BODY, tmp_path)
