"""Leaving rows out is the same as an operator that never had them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from golden import mismatch
from shapes import disc
from tomoskin.core import DataError, FloatArray
from tomoskin.imaging import OneStep, Operator
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import PRIORS

PATTERN = Pattern.adjacent(8)
ALPHA = 0.02
some_rows = st.sets(st.integers(0, PATTERN.n_meas - 1), min_size=1, max_size=25).map(sorted)


@cache
def model() -> ForwardModel:
    return ForwardModel(disc(8), PATTERN, np.geomspace(0.005, 0.02, 8))


@cache
def operator(prior: str, difference: str = "plain") -> OneStep:
    weights = np.random.default_rng(1).uniform(0.5, 2.0, PATTERN.n_meas)
    if difference == "normalised":
        weights *= model().solve(1.0).voltages ** 2
    return OneStep(model(), prior, alpha=ALPHA, difference=difference, weights=weights)


def built_without(whole: OneStep, rows: list[int]) -> FloatArray:
    """The matrix of the same problem with the other rows only."""
    problem, kept = whole.problem, np.setdiff1d(np.arange(PATTERN.n_meas), rows)
    fewer = replace(
        problem,
        jacobian=problem.jacobian[kept],
        weights=problem.weights[kept],
        reference=problem.reference[kept],
    )
    return fewer.operator(ALPHA).matrix


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("difference", ["plain", "normalised"])
@settings(max_examples=15)
@given(rows=some_rows)
def test_without_rows_is_the_operator_built_without_them(
    prior: str, difference: str, rows: list[int]
) -> None:
    whole = operator(prior, difference)
    less = whole.without(rows)
    kept = np.delete(less.matrix, rows, axis=1)
    assert mismatch(kept, built_without(whole, rows)) < 1e-10
    assert not less.matrix[:, rows].any()
    assert np.flatnonzero(less.left_out).tolist() == rows


@pytest.mark.parametrize("prior", PRIORS)
@settings(max_examples=15)
@given(rows=some_rows, seed=st.integers(0, 99))
def test_filled_data_give_the_picture_without_the_rows(
    prior: str, rows: list[int], seed: int
) -> None:
    whole = operator(prior)
    dv = np.random.default_rng(seed).standard_normal(PATTERN.n_meas)
    dv[rows] = np.nan
    missing = np.isnan(dv)
    expected = whole.without(rows)(dv).values
    assert mismatch(whole(whole.filled(dv, missing)).values, expected) < 1e-10


@settings(max_examples=15)
@given(first=some_rows, second=some_rows)
def test_rows_may_leave_in_turns(first: list[int], second: list[int]) -> None:
    both = sorted({*first, *second})
    if len(both) > 30:
        both, second = first, first
    in_turns: Operator = operator("laplace").without(first).without(second)
    at_once = operator("laplace").without(both)
    assert mismatch(in_turns.matrix, at_once.matrix) < 1e-9
    assert np.array_equal(in_turns.left_out, at_once.left_out)
    dv = np.random.default_rng(3).standard_normal(PATTERN.n_meas)
    dv[both] = np.nan
    some = np.zeros(len(dv), bool)
    some[second] = True
    half = operator("laplace").without(first)
    assert mismatch(half(half.filled(dv, some)).values, at_once(dv).values) < 1e-9


def test_rows_that_count_must_still_be_finite() -> None:
    dv = np.full(PATTERN.n_meas, np.nan)
    with pytest.raises(DataError, match=r"rows \[0, 1, 2, 4, "):
        operator("noser").without([3])(dv)


def test_nothing_missing_changes_nothing() -> None:
    dv = np.arange(float(PATTERN.n_meas))
    assert operator("noser").filled(dv, np.zeros(len(dv), bool)) is dv
    assert operator("noser").without([]) is operator("noser")


@pytest.mark.parametrize("row", [-1, PATTERN.n_meas])
def test_a_row_that_does_not_exist(row: int) -> None:
    with pytest.raises(DataError, match=f"expected rows from 0 to 39, got {row}"):
        operator("noser").without([row])


def test_no_row_left() -> None:
    with pytest.raises(DataError, match="at least one row that is not left out"):
        operator("noser").without(range(PATTERN.n_meas))
    with pytest.raises(DataError, match="at least one row that is not left out"):
        operator("laplace").without(range(20)).without(range(20, 40))
