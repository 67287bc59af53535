"""The pieces of ``bench life``: conditions month by month, and a twin in one of them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin import Skin
from tomoskin.sensing.segment import Region

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def life(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module("life")


def test_what_has_happened_stays(life: Any) -> None:
    conditions = life.life()
    assert [condition.month for condition in conditions] == list(range(life.MONTHS))
    cut = [condition.cut for condition in conditions]
    assert cut[8:14] == [1.0, 0.02, 0.02, 0.02, 0.7, 0.7]
    assert conditions[30].lost
    assert conditions[30].stretch == conditions[20].stretch > 0
    assert not conditions[-1].lost


def test_the_middle_wears_and_the_cut_conducts_less(life: Any) -> None:
    points = np.array([[0.0, 0.0], [0.1, 0.0], [-0.012, 0.016]])
    new, old = (life.left(points, life.Condition(month)) for month in (0, 30))
    np.testing.assert_array_equal(new, 1.0)
    assert old[0] < old[1] < 1
    cut = life.left(points, life.Condition(30, cut=0.1))
    np.testing.assert_allclose(cut / old, [1.0, 1.0, 0.1])


def test_a_lost_electrode_has_no_rows(life: Any) -> None:
    skin = Skin.load(life.SKIN)
    xy, forces = life.touches(Region.of(skin), 2, np.random.default_rng(0))
    whole = life.Worn(skin, life.Condition(0), 1)(xy, forces)
    lost = life.Worn(skin, life.Condition(0, lost=(4,)), 1)(xy, forces)
    gone = np.isnan(lost).all(axis=0)
    assert np.isfinite(whole).all()
    pattern = skin.pattern()
    assert (gone == (np.hstack([pattern.drive, pattern.measure]) == 4).any(axis=1)).all()
    np.testing.assert_array_equal(lost[:, ~gone], whole[:, ~gone])
