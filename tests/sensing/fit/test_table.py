"""The table against the exact model; the native solver against numpy's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sensing.fit.scene import noise, whitener
from sensing.fit.test_finder import data, model, press
from tomoskin.core import FloatArray, finished
from tomoskin.sensing.fit import EXHAUSTIVE, LIVE
from tomoskin.sensing.fit.expectation import Expectation, Known
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.problem import Problem, Solver, WhitenedTable
from tomoskin.sensing.fit.selection import ForwardSelection
from tomoskin.sensing.fit.solver import NumpySolver, SheetDomain
from tomoskin.sensing.fit.spot_fit import Deficit
from tomoskin.sensing.fit.spot_model import NativeSolver

TWO = np.concatenate([press(-0.04, 0.03, 0.018, -0.4), press(0.05, -0.02, 0.024, -0.3)])
SPREAD = np.array([4e-3, 2e-3, 0.2, 3e-5])
"""Deviations of a spot's columns."""


def expected(spots: FloatArray) -> Expectation:
    """Of touches whose columns are correlated."""
    k = len(spots)
    one = SPREAD[:, None] * SPREAD * np.where(np.eye(4, dtype=bool), 1.0, 0.3)
    return Expectation.of(spots, np.kron(np.eye(k), one), np.diag([25e-6, 25e-6, 1e-2]))


def drawn(count: int, within: float) -> list[FloatArray]:
    random = np.random.default_rng(7)
    away, turn = within * np.sqrt(random.uniform(size=count)), random.uniform(0, 7, count)
    sizes, depths = random.uniform(0.012, 0.035, count), random.uniform(-1.0, -0.05, count)
    return [
        press(r * np.cos(t), r * np.sin(t), size, depth)
        for r, t, size, depth in zip(away, turn, sizes, depths, strict=True)
    ]


def by_table(spots: FloatArray) -> FloatArray:
    """(k, 7, n_meas) V."""
    table = model().solver.table
    return table.expanded(spots) @ table.basis


@pytest.mark.parametrize(("within", "median", "most"), [(0.06, 0.005, 0.03), (0.09, 0.008, 0.05)])
def test_a_spot_is_nearly_what_the_exact_model_has(
    within: float, median: float, most: float
) -> None:
    spots = drawn(40, within)
    errors = []
    for spot in spots:
        exact = data(spot)
        errors.append(np.linalg.norm(by_table(spot)[0, 0] - exact) / np.linalg.norm(exact))
    assert np.median(errors) < median
    assert max(errors) < most


def test_slopes_are_those_of_the_change() -> None:
    (spot,) = press(0.03, 0.02, 0.02, -0.4)
    own = model().solver.table.expanded(spot[None])[0]
    for column, step in enumerate((1e-5, 1e-5, 1e-4, 1e-8)):
        move = step * np.eye(4)[column]
        ahead, behind = model().solver.table.expanded(np.array([spot + move, spot - move]))[:, 0]
        slope = (ahead - behind) / (2 * step)
        assert np.linalg.norm(slope - own[1 + column]) < 1e-4 * np.linalg.norm(slope)


def test_a_shape_is_the_way_from_a_tail_to_a_bell() -> None:
    spot = press(0.03, 0.02, 0.025, -0.3)
    *_, nuisances = model().response.expanded(spot)
    exact, ours = nuisances[:, 1], by_table(spot)[0, -1]
    assert np.linalg.norm(ours - exact) < 0.35 * np.linalg.norm(exact)


def whitened(solver: Solver) -> WhitenedTable:
    times = model().response.times
    return finished(WhitenedTable.making(solver, whitener(), times, np.zeros((len(times), 0))))


def problem(solver: Solver, spots: FloatArray, reach: float) -> Problem:
    seen = whitened(solver)
    volts = data(spots) + noise(16, 1, 3)[0]
    along, rest = seen.whitened(volts)
    left = 0.05 * data(press(0.0, 0.06))[None] @ seen.matrix.T
    return Problem(
        exact=model().response.changes,
        reduced=model().reduced,
        seen=seen,
        prior=model().prior,
        sign="decrease",
        reach=reach,
        grows=0.5,
        data=along,
        rest=rest,
        left=left,
    )


def solvers() -> tuple[Solver, Solver]:
    """Of the same table, natively and by numpy."""
    native = model().solver
    if not isinstance(native, NativeSolver):
        pytest.skip("the native engine is not installed")
    plain = NumpySolver(native.table, SheetDomain(model().response.spots.mesh), model().prior)
    return native, plain


def close(first: Any, second: Any, to: float = 1e-6) -> None:
    first, second = np.asarray(first), np.asarray(second)
    assert first.shape == second.shape
    np.testing.assert_allclose(
        first, second, rtol=to, atol=0.1 * to * np.abs(second).max(initial=1)
    )


@pytest.mark.parametrize("known", [(), (None, 0)], ids=["newcomers", "one goes on"])
@pytest.mark.parametrize("reach", [0.0, 0.01])
@pytest.mark.parametrize("spots", [TWO[:0], TWO[:1], TWO], ids=len)
def test_native_and_numpy_agree(spots: FloatArray, reach: float, known: Known) -> None:
    pair = solvers()
    start = spots + np.array([4e-3, -3e-3, 0.1, 2e-5])
    rank = len(pair[0].table.basis)
    deficit = Deficit(start, 1e-6 * np.random.default_rng(1).normal(size=rank))
    frames = [replace(problem(solver, TWO, reach), expected=expected(TWO[1:])) for solver in pair]
    one, other = (
        solver.settled(frame, start, deficit, 6, known[: len(start)])
        for solver, frame in zip(pair, frames, strict=True)
    )
    assert one.settled == other.settled
    assert one.known == other.known
    assert len(one.known) == len(start)
    for name in ("spots", "each", "predicted", "residual", "slopes", "unknown", "normal"):
        close(getattr(one, name), getattr(other, name))
    for name in ("misfit", "log_size", "cost", "degrees"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-7, abs=1e-9)
    matched = model().candidates.matched(frames[0].seen)
    for sign in ("decrease", "both"):
        ratios = [matched.ratios(solver, one, sign) for solver in pair]
        assert ratios[0][0].max() > 1.0
        close(ratios[0], ratios[1], 1e-5)
    if len(spots):
        squares = [solver.standing(frames[0].left, one) for solver in pair]
        assert squares[0].min() > 100.0
        close(squares[0], squares[1])
        judged = [
            solver.judged(frame, one, 0.08) for solver, frame in zip(pair, frames, strict=True)
        ]
        for first, second in zip(*judged, strict=True):
            close(first, second)


@pytest.mark.parametrize("goes_on", [False, True])
def test_one_call_finds_what_the_search_step_by_step_does(goes_on: bool) -> None:
    native, _ = solvers()
    policy, none = DetectionPolicy(5.0, "decrease", 5, LIVE), Deficit.none(len(native.table.basis))
    counts, known = set(), set[int | None]()
    three = np.concatenate([TWO, press(0.0, -0.06)])
    for spots, before in ((TWO[:0], TWO[:0]), (TWO, TWO[:1]), (three, TWO), (TWO[:1], TWO)):
        frame = problem(native, spots, 0.01)
        if goes_on:
            frame = replace(frame, expected=expected(before))
        matched = model().candidates.matched(frame.seen)
        answer = native.searched(frame, matched, policy, none, before)
        assert answer is not None
        other = ForwardSelection(frame, matched, policy, none).step_by_step(before)
        close(answer.fit.spots, other.spots)
        assert answer.fit.cost == pytest.approx(other.cost, rel=1e-9)
        assert answer.fit.known == other.known
        known.update(other.known)
        counts.add(len(other.spots))
    assert counts == {0, 1, 2, 3}
    assert known == ({None, 0} if goes_on else {None})


def test_one_spot_more_that_was_not_worth_it_is_proposed_as_it_was_fitted() -> None:
    native, _ = solvers()
    none = Deficit.none(len(native.table.basis))
    policy = DetectionPolicy(5.0, "decrease", 5, replace(LIVE, rare=500.0))
    frame = problem(native, np.concatenate([TWO, press(0.0, -0.06, 0.018, -0.1)]), 0.01)
    matched = model().candidates.matched(frame.seen)
    search = ForwardSelection(frame, matched, policy, none)
    answer = native.searched(frame, matched, policy, none, TWO)
    assert answer is not None
    assert answer.turned_down is not None
    assert len(answer.fit.spots) == 2
    anew = search.proposed(answer.fit)
    assert anew is not None
    close(answer.turned_down.spots, anew.spots)
    stepwise = search.step_by_step(TWO)
    proposed = search.proposed(stepwise)
    assert proposed is not None
    close(proposed.spots, anew.spots)


def test_what_changes_do_not_show_along_is_noise() -> None:
    seen = whitened(model().solver)
    volts = data(TWO)
    along, rest = seen.whitened(volts)
    every = whitener()(volts)
    assert len(along) < len(every) - 20
    assert np.sqrt(along @ along) == pytest.approx(np.linalg.norm(every), rel=1e-3)
    assert np.sqrt(rest) < 0.5, "of some eighty deviations"
    assert np.linalg.norm(every) > 50.0


def test_several_spots_are_those_of_the_exact_model() -> None:
    near = np.concatenate([press(-0.015, 0.0, 0.02, -0.8), press(0.025, 0.0, 0.02, -0.8)])
    frame = problem(model().solver, near, 0.0)
    fit = frame.refined(near, Deficit.none(len(frame.solver.table.basis)), 6)
    exact = frame.corrected(fit, EXHAUSTIVE, EXHAUSTIVE.rounds)
    assert exact.misfit < fit.misfit
    assert np.abs((exact.spots - near)[:, :2]).max() < 1.5e-3
    alone = frame.solver.expanded(exact.spots)[:, 0].sum(axis=0)
    assert (alone + exact.deficit.change) @ frame.solver.table.basis == pytest.approx(
        model().response.changes([exact.spots])[0], abs=2e-6
    )
