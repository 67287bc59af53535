"""What rows that are turned copies of each other share."""

from __future__ import annotations

import numpy as np
import pytest

from learning.labelled import RADIUS, Floats, places
from tomoskin import Locator, Pattern
from tomoskin.learning.touch.per_channel import ChannelMaps, Rotations, turned

PATTERN = Pattern.adjacent(8)


def alike(
    n: int, seed: int, way: int, uneven: float = 0.0, noise: float = 0.1
) -> tuple[Floats, Floats]:
    """Presses on a skin whose rows answer alike when it is turned, and a part that is uneven."""
    xy, turns = places(n, seed), Rotations.of(PATTERN)
    rng = np.random.default_rng(99)
    shared = {k: rng.normal(size=(4, 3)) for k in np.unique(turns.orbit).tolist()}
    dv = np.empty((n, PATTERN.n_meas))
    for row, (orbit, angle) in enumerate(zip(turns.orbit, turns.angle, strict=True)):
        own = rng.normal(size=(4, 3))
        common = _bumps(turned(xy, way * angle), shared[int(orbit)])
        dv[:, row] = np.sqrt(1 - uneven) * common + np.sqrt(uneven) * _bumps(xy, own)
    return dv + noise * np.random.default_rng(seed + 1).normal(size=dv.shape), xy


def _bumps(xy: Floats, table: Floats) -> Floats:
    away = xy[:, None] / RADIUS - 0.6 * table[:, :2]
    return np.asarray(np.exp(-2 * (away**2).sum(axis=2)) @ table[:, 2])


def missed(n: int, way: int, turns: Rotations, uneven: float = 0.0) -> float:
    """Root mean square by which maps from ``n`` presses miss what other presses answer."""
    dv, xy = alike(n, 0, way, uneven)
    others, there = alike(300, 5, way, uneven, noise=0.0)
    told, _ = ChannelMaps.of(xy / RADIUS, dv, turns).at(there / RADIUS)
    return float(np.sqrt(((told - others) ** 2).mean()))


def test_rows_of_an_orbit_are_turned_copies() -> None:
    turns = Rotations.of(PATTERN)
    assert np.bincount(turns.orbit)[np.unique(turns.orbit)].tolist() == [8] * 5
    table = np.hstack([PATTERN.drive, PATTERN.measure])
    steps = np.round(turns.angle * 8 / (2 * np.pi)).astype(int)
    np.testing.assert_array_equal((table[turns.orbit] + steps[:, None]) % 8, table)


def test_a_pattern_with_one_drive_has_no_copies() -> None:
    some = Pattern.from_tables([[0, 4], [0, 4]], [[1, 2], [3, 2]], 8)
    assert not Rotations.of(some).any
    assert Rotations.of(PATTERN).any
    assert not Rotations.none(40).any


def test_turning_back_undoes_a_turn() -> None:
    there = turned(np.array([[0.0, 1.0]]), np.pi / 2)
    np.testing.assert_allclose(there, [[1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("way", [1, -1])
def test_few_presses_tell_more_of_rows_that_are_alike_all_round(way: int) -> None:
    apart, shared = (missed(8, way, turns) for turns in (Rotations.none(40), Rotations.of(PATTERN)))
    assert shared < 0.8 * apart


def test_which_way_round_the_electrodes_go_is_found() -> None:
    turns = Rotations.of(PATTERN)
    for way, angle in ((1, turns.angle), (-1, turns.reversed().angle)):
        dv, xy = alike(12, 0, way)
        np.testing.assert_array_equal(ChannelMaps.of(xy / RADIUS, dv, turns).rotations.angle, angle)


def test_rows_that_are_not_alike_all_round_lose_little() -> None:
    apart, shared = (
        missed(25, 1, turns, 1.0) for turns in (Rotations.none(40), Rotations.of(PATTERN))
    )
    assert shared < 1.1 * apart


def test_maps_of_shared_rows_know_how_far_they_may_be_off() -> None:
    dv, xy = alike(40, 0, 1, uneven=0.4)
    others, there = alike(300, 5, 1, uneven=0.4)
    told, variance = ChannelMaps.of(xy / RADIUS, dv, Rotations.of(PATTERN)).at(there / RADIUS)
    assert 0.7 < float(((told - others) ** 2 / variance).mean()) < 1.4


def test_a_locator_that_knows_its_pattern_uses_it() -> None:
    dv, xy = alike(12, 0, 1)
    others, there = alike(200, 5, 1)
    known, unknown = Locator.fit(dv, xy, pattern=PATTERN), Locator.fit(dv, xy)
    assert np.abs(known.predict(others)[0] - unknown.predict(others)[0]).max() > 0.01 * RADIUS
    assert np.linalg.norm(known.predict(others)[0] - there, axis=1).mean() < 0.2 * RADIUS
