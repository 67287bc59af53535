"""The table against the exact model; the native solver against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import FloatArray
from tomoskin.touch.fit import EXHAUSTIVE
from tomoskin.touch.fit.native import NativeSolver
from tomoskin.touch.fit.refine import Deficit, Problem, Solver, WhitenedTable
from tomoskin.touch.fit.solver import NumpySolver, SheetDomain
from touch.fit.scene import noise, whitener
from touch.fit.test_finder import data, model, press

TWO = np.concatenate([press(-0.04, 0.03, 0.018, -0.4), press(0.05, -0.02, 0.024, -0.3)])


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


@pytest.mark.parametrize(("within", "median", "most"), [(0.06, 0.01, 0.04), (0.09, 0.02, 0.12)])
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
    assert np.linalg.norm(ours - exact) < 0.3 * np.linalg.norm(exact)


def problem(solver: Solver, spots: FloatArray, reach: float) -> Problem:
    seen = WhitenedTable.of(solver, whitener(), model().response.times)
    volts = data(spots) + noise(16, 1, 3)[0]
    left = 0.05 * whitener()(data(press(0.0, 0.06))[None])
    return Problem(
        response=model().response,
        seen=seen,
        prior=model().prior,
        sign="decrease",
        reach=reach,
        grows=0.5,
        data=whitener()(volts),
        left=left,
    )


@pytest.mark.parametrize("reach", [0.0, 0.01])
@pytest.mark.parametrize("spots", [TWO[:0], TWO[:1], TWO], ids=len)
def test_native_and_numpy_agree(spots: FloatArray, reach: float) -> None:
    native = model().solver
    if not isinstance(native, NativeSolver):
        pytest.skip("the native engine is not installed")
    plain = NumpySolver(native.table, SheetDomain(model().response.spots.mesh), model().prior)
    start = spots + np.array([4e-3, -3e-3, 0.1, 2e-5])
    deficit = Deficit(start, 1e-6 * np.random.default_rng(1).normal(size=len(native.table.basis)))
    one, other = (
        solver.settled(problem(solver, TWO, reach), start, deficit, 6) for solver in (native, plain)
    )
    assert one.settled == other.settled
    for name in ("spots", "each", "predicted", "residual", "slopes", "unknown", "normal"):
        first, second = getattr(one, name), getattr(other, name)
        assert first.shape == second.shape, name
        np.testing.assert_allclose(
            first, second, rtol=1e-6, atol=1e-7 * np.abs(second).max(initial=1)
        )
    assert one.misfit == pytest.approx(other.misfit, rel=1e-7)
    assert one.log_size == pytest.approx(other.log_size, rel=1e-7, abs=1e-9)
    assert one.cost == pytest.approx(other.cost, rel=1e-7)
    rows = np.random.default_rng(2).normal(size=(5, len(one.residual)))
    np.testing.assert_allclose(
        native.projected(one.unknown, one.slopes, rows),
        plain.projected(other.unknown, other.slopes, rows),
        rtol=1e-5,
        atol=1e-6,
    )


def test_several_spots_are_those_of_the_exact_model() -> None:
    near = np.concatenate([press(-0.015, 0.0, 0.02, -0.8), press(0.025, 0.0, 0.02, -0.8)])
    frame = problem(model().solver, near, 0.0)
    fit = frame.refined(near, Deficit.none(len(frame.solver.table.basis)), 6)
    exact = frame.corrected(fit, EXHAUSTIVE)
    assert exact.misfit < fit.misfit
    assert np.abs((exact.spots - near)[:, :2]).max() < 1.5e-3
    assert frame.change(exact) == pytest.approx(
        model().response.changes([exact.spots])[0], abs=2e-6
    )
