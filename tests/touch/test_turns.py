"""What rows that are turned copies of each other share."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin import Locator, Pattern
from tomoskin.touch.locator.turns import Turns, turned
from touch.labelled import RADIUS, Floats, places

PATTERN = Pattern.adjacent(8)


def alike(n: int, seed: int, way: int, uneven: float = 0.0) -> tuple[Floats, Floats]:
    """Presses on a skin whose rows answer alike when it is turned, and a part that is uneven."""
    xy, turns = places(n, seed), Turns.of(PATTERN)
    rng = np.random.default_rng(99)
    shared = {k: rng.normal(size=(4, 3)) for k in np.unique(turns.orbit).tolist()}
    dv = np.empty((n, PATTERN.n_meas))
    for row, (orbit, angle) in enumerate(zip(turns.orbit, turns.angle, strict=True)):
        own = rng.normal(size=(4, 3))
        common = _bumps(turned(xy, way * angle), shared[int(orbit)])
        dv[:, row] = np.sqrt(1 - uneven) * common + np.sqrt(uneven) * _bumps(xy, own)
    return dv + 0.1 * np.random.default_rng(seed + 1).normal(size=dv.shape), xy


def _bumps(xy: Floats, table: Floats) -> Floats:
    away = xy[:, None] / RADIUS - 0.6 * table[:, :2]
    return np.asarray(np.exp(-2 * (away**2).sum(axis=2)) @ table[:, 2])


def missed(locator: Locator, way: int, uneven: float = 0.0) -> float:
    dv, xy = alike(200, 5, way, uneven)
    return float(np.linalg.norm(locator.predict(dv)[0] - xy, axis=1).mean()) / RADIUS


def test_rows_of_an_orbit_are_turned_copies() -> None:
    turns = Turns.of(PATTERN)
    assert np.bincount(turns.orbit)[np.unique(turns.orbit)].tolist() == [8] * 5
    table = np.hstack([PATTERN.drive, PATTERN.measure])
    steps = np.round(turns.angle * 8 / (2 * np.pi)).astype(int)
    np.testing.assert_array_equal((table[turns.orbit] + steps[:, None]) % 8, table)


def test_a_pattern_with_one_drive_has_no_copies() -> None:
    some = Pattern.from_tables([[0, 4], [0, 4]], [[1, 2], [3, 2]], 8)
    assert not Turns.of(some).any
    assert Turns.of(PATTERN).any
    assert not Turns.none(40).any


def test_turning_back_undoes_a_turn() -> None:
    there = turned(np.array([[0.0, 1.0]]), np.pi / 2)
    np.testing.assert_allclose(there, [[1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("way", [1, -1])
def test_few_presses_tell_more_on_a_skin_that_is_alike_all_round(way: int) -> None:
    dv, xy = alike(14, 0, way)
    assert missed(Locator.fit(dv, xy, pattern=PATTERN), way) < 0.7 * missed(
        Locator.fit(dv, xy), way
    )


def test_a_skin_that_is_not_alike_all_round_loses_nothing() -> None:
    dv, xy = alike(25, 0, 1, uneven=1.0)
    shared, plain = Locator.fit(dv, xy, pattern=PATTERN), Locator.fit(dv, xy)
    assert missed(shared, 1, uneven=1.0) < 1.1 * missed(plain, 1, uneven=1.0)
