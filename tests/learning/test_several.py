"""Two touches by what single presses have taught: public recordings of a hydrogel skin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tomoskin import Locator
from tomoskin.core import DataError, FloatArray
from tomoskin.learning import Several

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def folder(data_dir: Path) -> Path:
    return data_dir / "eskin_hydrogel_round"


def changes(path: Path) -> FloatArray:
    with np.load(path) as kept:
        return np.asarray(kept["v_down"].astype(float) - kept["v_up"])


@pytest.fixture(scope="module")
def presses(folder: Path) -> tuple[FloatArray, FloatArray]:
    path = folder / "round16_single550.npz"
    with np.load(path) as kept:
        return changes(path), 1e-3 * kept["xy_mm"].astype(float)


@pytest.fixture(scope="module")
def several(presses: tuple[FloatArray, FloatArray]) -> Several:
    dv, xy = presses
    return Several.of(Locator.fit(dv[:200], xy[:200]))


def test_fingers_108_mm_apart_are_two_and_20_mm_apart_are_not(
    folder: Path, several: Several
) -> None:
    """The order of the pair's angles is not documented, so only the distance is known."""
    found = several(changes(folder / "round16_twotouch.npz")[[0, 1, 2, 8]])
    assert [len(detections) for detections in found] == [2, 2, 2, 1]
    for one, other in found[:3]:
        assert 0.09 < np.hypot(one.x - other.x, one.y - other.y) < 0.125


def test_presses_that_add_up_are_found_where_they_were(
    presses: tuple[FloatArray, FloatArray], several: Several
) -> None:
    dv, xy = presses
    left, right = (np.flatnonzero(s * xy[200:, 0] > 0.04)[:2] + 200 for s in (-1, 1))
    for a, b, detections in zip(left, right, several(dv[left] + dv[right]), strict=True):
        one, other = sorted(detections, key=lambda r: r.x)
        assert np.hypot(*(xy[a] - (one.x, one.y))) < 0.03
        assert np.hypot(*(xy[b] - (other.x, other.y))) < 0.03
        assert 0.002 < one.sd_x < 0.03


def test_a_press_is_one_where_the_locator_says(
    presses: tuple[FloatArray, FloatArray], several: Several
) -> None:
    dv = presses[0][200:220]
    found = several(dv)
    assert sum(len(detections) == 1 for detections in found) >= 19
    expected = several.locator.predict(dv)[0]
    alone = [(detections[0], at) for detections, at in zip(found, expected, strict=True)]
    assert sum((r.x, r.y) == pytest.approx(tuple(at)) for r, at in alone) >= 19


def test_data_of_another_pattern_are_refused(several: Several) -> None:
    with pytest.raises(DataError, match="expected dv of shape"):
        several(np.zeros((1, 40)))
