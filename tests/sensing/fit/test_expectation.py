"""Touches that go on: how likely they are, and what the evidence makes of that."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from sensing.fit.test_finder import model
from sensing.fit.test_table import TWO, expected, problem
from tomoskin.sensing.fit.expectation import Expectation, ResidualResponse, less, newcomers
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


def slid(count: int) -> ResidualResponse:
    """What a touch has left that slid past ``count`` footprints, which look nearly alike."""
    response, slopes = ResidualResponse(0.1), 0.01 * np.eye(4, 8, 1)
    response.directions(np.eye(8))
    for number in range(count):
        change = 20.0 * np.eye(1, 8) + 0.1 * np.eye(1, 8, 5 + number % 3)
        shapes = np.vstack([change, slopes[1:]])
        response.after(np.array([[0.02 * number, 0.0, -4.0, -1e-4]]), lambda _, s=shapes: s)
    return response


def test_what_a_slide_has_left_is_not_forgotten_while_it_shows_as_a_whole() -> None:
    response, left = slid(6), 3.0 * np.eye(1, 8)[0]  # half a deviation of each
    for _ in range(10):
        response.idle(response.without(left))
    assert np.linalg.norm(response.without(left)) < 1.0
    for _ in range(20):  # it fades
        response.idle(response.without(0.0 * left))
    assert response.doubts == ()


def test_a_long_slide_leaves_something_where_it_began() -> None:
    assert len(slid(30).doubts) == 30
