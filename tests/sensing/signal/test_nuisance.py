"""Directions that say nothing: the same as an operator that was made with that noise."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import NuisanceSubspace, nuisance_directions

RANDOM = np.random.default_rng(0)
J = RANDOM.standard_normal((12, 30))
GRAM = J @ J.T + 0.5 * np.eye(12)
P = np.linalg.inv(GRAM)
R = J.T @ P


def test_it_is_the_limit_of_ever_more_noise_along_the_directions():
    directions = RANDOM.standard_normal((12, 3))
    blind = NuisanceSubspace.of(directions, P)
    noisy = J.T @ np.linalg.inv(GRAM + 1e7 * directions @ directions.T)
    np.testing.assert_allclose(blind.projected(R), noisy, atol=1e-5)
    dv = RANDOM.standard_normal(12)
    np.testing.assert_allclose(R @ blind(dv), blind.projected(R) @ dv, atol=1e-12)
    shifted = dv + 1e3 * directions @ [1.0, -2.0, 0.5]
    np.testing.assert_allclose(R @ blind(shifted), R @ blind(dv), atol=1e-9)


def test_lost_rows_are_directions_too():
    kept = np.arange(12) > 2
    alone = J[kept].T @ np.linalg.inv(GRAM[np.ix_(kept, kept)])
    blind = NuisanceSubspace.of(np.eye(12)[:, ~kept], P)
    np.testing.assert_allclose(blind.projected(R)[:, kept], alone, atol=1e-9)
    assert not np.abs(blind.projected(R)[:, ~kept]).max() > 1e-9


def test_a_free_image_is_left_out_whatever_the_data_say():
    """An operator that fits a constant beside its prior: it makes none of it, lost rows or not."""
    free = np.full((30, 1), 1 / np.sqrt(30))
    inner = J - (J @ free) @ free.T
    precision = np.linalg.inv(inner @ inner.T + 0.5 * np.eye(12))
    seen = J @ free
    fitted = np.linalg.solve(seen.T @ precision @ seen, seen.T @ precision)
    rest = inner.T @ precision
    matrix = rest + (free - rest @ seen) @ fitted
    left = precision - precision @ seen @ fitted
    blind = NuisanceSubspace.of(np.eye(12)[:, :2], left).without_free(seen, free.T @ matrix)
    dv = RANDOM.standard_normal(12)
    told = matrix @ blind(dv)
    assert np.abs(free.T @ told).max() < 1e-9
    np.testing.assert_allclose(blind.projected(matrix) @ dv, told, atol=1e-9)
    changed = dv + 5.0 * seen[:, 0] + np.where(np.arange(12) < 2, 9.0, 0.0)
    np.testing.assert_allclose(matrix @ blind(changed), told, atol=1e-8)


def test_directions_that_follow_from_others_count_once():
    one = RANDOM.standard_normal((12, 1))
    assert NuisanceSubspace.of(np.hstack([one, 2 * one, 0 * one]), P).directions.shape[1] == 1
    assert NuisanceSubspace.of(np.zeros((12, 0)), P).directions.shape[1] == 0


def test_nothing_that_is_left_is_refused():
    with pytest.raises(DataError, match="got 12"):
        NuisanceSubspace.of(np.eye(12)[:, :2], np.zeros((12, 12)))


def test_a_reading_that_floats_leaves_the_sum_of_its_rows():
    pattern = Pattern.adjacent(8)
    floating = np.arange(8) == 3
    lost = (pattern.drive == 3).any(axis=1)
    directions = nuisance_directions(pattern, lost, floating)
    volts = RANDOM.standard_normal((pattern.n_drive, 8))  # potentials, E4's are any number
    again = volts.copy()
    again[:, 3] = 100 * RANDOM.standard_normal(pattern.n_drive)
    plus, minus = pattern.measure.T

    def rows(potential):
        return potential[pattern.drive_index, plus] - potential[pattern.drive_index, minus]

    blind = NuisanceSubspace.of(directions, np.eye(pattern.n_meas))
    one, other = (blind(np.where(lost, 0.0, rows(p))) for p in (volts, again))
    np.testing.assert_allclose(one, other, atol=1e-9)
    drive = 6  # far from E4: its two rows there count as one
    kept = blind.directions[pattern.drive_index == drive]
    assert np.linalg.matrix_rank(kept) == 1
