"""Touches that go on: how likely they are, and what the evidence makes of that."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from sensing.fit.test_finder import model
from sensing.fit.test_table import TWO, expected, problem
from tomoskin.sensing.fit.expectation import Expectation, less, newcomers
from tomoskin.sensing.fit.spot_fit import Deficit


def test_density_of_what_is_expected() -> None:
    ours = expected(TWO)
    for middle, covariance, volume in zip(
        ours.spots, ours.covariances, ours.log_volumes, strict=True
    ):
        density = multivariate_normal(middle[:3], covariance).logpdf(middle[:3])
        assert volume == pytest.approx(-density)


def test_nothing_is_expected_of_what_is_no_number() -> None:
    covariance = np.eye(8)
    covariance[5, 5] = np.nan
    assert not len(Expectation.of(TWO, covariance, np.diag([25e-6, 25e-6, 1e-2])).spots)


def test_how_far_touches_are_from_where_they_are_expected() -> None:
    ours, off = expected(TWO), np.array([0.003, -0.002, 0.1, 1e-4])
    assert ours.away(TWO, (0, 1)) == ours.away(TWO[:0], ()) == 0.0
    far = float((off[:3] ** 2 / np.diag(ours.covariances[1])).max())
    assert ours.away(TWO[::-1] + np.array([off, 0 * off]), (1, 0)) == pytest.approx(far)
    assert ours.away(TWO, (0, None)) == ours.away(TWO, ()) == math.inf


def test_a_touch_where_it_is_expected_is_likelier_than_a_newcomer() -> None:
    frame = replace(problem(model().solver, TWO, 0.01), expected=expected(TWO))
    none = Deficit.none(len(model().solver.table.basis))
    newly, going_on = (frame.refined(TWO, none, 6, known) for known in ((), (0, 1)))
    prior = model().prior
    assert frame.evidence(going_on) > frame.evidence(newly) + 5.0
    assert prior.log_most(newcomers(2), Expectation.none()) == pytest.approx(
        math.log(2) - 2 * prior.log_volume
    )
    swapped = replace(frame, expected=expected(TWO[::-1]))
    elsewhere = swapped.refined(TWO, none, 6, (0, 1))
    assert frame.evidence(newly) > frame.evidence(elsewhere) + 100.0


def test_who_is_left() -> None:
    assert less((0, None, 2), 0) == (None, 2)
    assert less((0, None, 2), 2) == (0, None)
