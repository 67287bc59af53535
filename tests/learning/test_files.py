"""Calibrations as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from learning.earlier_files import check_nothing_may_lack, read_earlier
from tomoskin.core import DataError
from tomoskin.learning import FORCE, TOUCH, Calibration, Kind, Locator
from tomoskin.model.pattern import Pattern

PATTERN = Pattern.adjacent(8)
EARLIER = [TOUCH, FORCE]
"""Kinds of the core of which there are files of before."""

FILES = Path(__file__).parent / "files"


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    rng = np.random.default_rng(0)
    xy = rng.uniform(-0.05, 0.05, (25, 2))
    dv = np.sin(xy @ rng.normal(scale=30.0, size=(2, PATTERN.n_meas)))
    dv[3, 5] = np.nan
    locator = Locator.fit(dv, xy, pattern=PATTERN, strength=rng.uniform(1, 2, 25))
    return Calibration(TOUCH, locator, PATTERN, "a skin")


def test_what_is_read_answers_as_what_was_written(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "c.npz"
    calibration.write(path)
    again = TOUCH.read(path)
    frames = calibration.model.presses.dv[:5]
    for ours, theirs in zip(
        calibration.model.predict(frames), again.model.predict(frames), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(calibration.model.strength(frames), again.model.strength(frames))
    assert again.pattern.identity == PATTERN.identity
    assert again.skin_name == "a skin"
    assert [p.name for p in tmp_path.iterdir()] == ["c.npz"]


def test_a_file_that_cannot_be_written_leaves_nothing(
    calibration: Calibration, tmp_path: Path
) -> None:
    with pytest.raises(DataError, match="cannot be written"):
        calibration.write(tmp_path / "none" / "c.npz")
    (tmp_path / "folder").mkdir()
    with pytest.raises(DataError, match="expected the name of a file, got a folder"):
        calibration.write(tmp_path / "folder")
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "another"}, "not a calibration"),
        ({"version": 2}, "version"),
        ({"version": 1.5}, "whole number"),
        ({"xy_m": np.zeros((25, 3))}, "shape"),
        ({"xy_m": np.ones((25, 2))}, "outside"),
        ({"outline_m": np.zeros((5, 2))}, "outline"),
        ({"outline_m": 1e300 * np.eye(5, 2)}, "outline"),
        ({"dv": np.ones((25, 3))}, "expected"),
        ({"dv": 1e300 * np.eye(25, PATTERN.n_meas)}, "change from press to press"),
        ({"dv": 1e-300 * np.eye(25, PATTERN.n_meas)}, "change from press to press"),
        ({"drive": np.zeros((PATTERN.n_meas, 2))}, "source and sink"),
        ({"n_electrodes": 4}, "electrodes"),
        ({"n_electrodes": 8e300}, "up to 1024"),
        ({"n_electrodes": 1e9}, "up to 1024"),
    ],
)
def test_damaged_files_are_refused(
    calibration: Calibration, tmp_path: Path, change: dict[str, object], words: str
) -> None:
    path = tmp_path / "c.npz"
    calibration.write(path)
    with np.load(path) as kept:
        arrays = dict(kept) | {key: np.asarray(value) for key, value in change.items()}
    np.savez(path, **arrays)
    with pytest.raises(DataError, match=words) as caught:
        TOUCH.read(path)
    assert "c.npz" in str(caught.value)


@pytest.mark.parametrize("kind", EARLIER, ids=lambda kind: kind.name)
def test_files_of_earlier_versions_are_read(kind: Kind[Any]) -> None:
    own, then = read_earlier(FILES / f"{kind.name}.npz", kind)
    assert {*own} - {"measurand", "modelled"} == {*then}
    for key, array in then.items():
        np.testing.assert_array_equal(own[key], array)


@pytest.mark.parametrize("kind", EARLIER, ids=lambda kind: kind.name)
def test_files_that_lack_something_are_refused(kind: Kind[Any], tmp_path: Path) -> None:
    check_nothing_may_lack(FILES / f"{kind.name}.npz", kind, tmp_path)
