"""Extreme contrasts: the answer is right, or there is none.

The library's numbers are held against the same model with sixty digits.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sixty_digits
from shapes import disc, patched, strip
from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

MESH = disc(5, 60, width=0.05)
N = len(MESH.cells)
PATTERN = Pattern.all_pairs(5)
BASE = np.exp(0.3 * np.random.default_rng(0).standard_normal(N))
Z = np.full(5, 0.01)
INWARD = np.argsort(np.linalg.norm(MESH.centroids, axis=1))
FACTORS = [10.0**k for k in (-16, -14, -12, -10, -8, -4, -2, 2, 4, 6, 8, 10, 12, 14, 16)]


def at_electrode(number: int, corners: int) -> IntArray:
    """Cells with that many corners on an electrode: 1, all around it; 2, with a facet of it."""
    return np.flatnonzero(np.isin(MESH.cells, MESH.electrodes[number]).sum(axis=1) >= corners)


ISLANDS = {
    "one cell inside": INWARD[:1],
    "ten cells inside": INWARD[:10],
    "all but one": INWARD[1:],
    "all": INWARD,
    "one cell at an electrode": at_electrode(0, 2)[:1],
    "one cell at the ground": at_electrode(4, 2)[:1],
    "around an electrode": at_electrode(0, 1),
    "around the ground": at_electrode(4, 1),
    "around two": np.union1d(at_electrode(1, 1), at_electrode(4, 1)),
}


def error(got: FloatArray, exact: FloatArray) -> float:
    """Largest relative error of a drive: a drive with small voltages counts like any other."""
    largest = np.zeros(PATTERN.n_drive)
    np.maximum.at(largest, PATTERN.drive_index, np.abs(exact))
    return float((np.abs(got - exact) / largest[PATTERN.drive_index]).max())


def right_or_refused(solve: Callable[[], FloatArray], exact: FloatArray) -> bool:
    """Whether there was an answer; a wrong one fails."""
    try:
        got = solve()
    except ModelError:
        return False
    assert error(got, exact) < 1e-5
    return True


@pytest.mark.parametrize("island", ISLANDS)
def test_an_island_of_another_conductivity(island: str) -> None:
    cells, model = ISLANDS[island], ForwardModel(MESH, PATTERN, Z)
    local = model.at(BASE).local
    for factor in FACTORS:
        sigma = BASE.copy()
        sigma[cells] *= factor
        exact = sixty_digits.voltages(MESH, PATTERN, sigma, Z)
        answers = [
            right_or_refused(lambda s=sigma: model.solve(s).voltages, exact),
            right_or_refused(lambda s=sigma: local.voltages_of([(cells, s[cells])])[0], exact),
        ]
        if 1e-6 < factor < 1e6:
            assert all(answers), "a contrast that occurs must be solved"


@pytest.mark.parametrize(
    "island", ["one cell inside", "ten cells inside", "one cell at the ground"]
)
@pytest.mark.parametrize("factor", [1e-16, 1e-14, 1e-8])
def test_a_hole_is_no_difficulty(island: str, factor: float) -> None:
    """Current goes around it; the answer is good to rounding."""
    sigma = BASE.copy()
    sigma[ISLANDS[island]] *= factor
    exact = sixty_digits.voltages(MESH, PATTERN, sigma, Z)
    solution = ForwardModel(MESH, PATTERN, Z).solve(sigma)
    assert error(solution.voltages, exact) < 1e-12
    assert solution.residual < 1e-12


@pytest.mark.parametrize("electrode", [0, 2])
def test_an_open_contact_costs_the_others_no_digit(electrode: int) -> None:
    for factor in (1e4, 1e8, 1e16):
        z = Z.copy()
        z[electrode] *= factor
        exact = sixty_digits.voltages(MESH, PATTERN, BASE, z)
        assert error(ForwardModel(MESH, PATTERN, z).solve(BASE).voltages, exact) < 1e-12


def test_voltages_that_are_zero_by_symmetry_are_no_lost_digits() -> None:
    """A square driven across one diagonal and read across the other."""
    x = np.linspace(-1, 1, 21)
    far = [lambda p, s=s: np.abs(p @ s - 2) < 0.4 for s in ([1, 1], [-1, 1], [-1, -1], [1, -1])]
    square = patched(strip(x, x), *far)
    pattern = Pattern.from_tables([[0, 2], [1, 3]], [[1, 3], [0, 2]])
    state = ForwardModel(square, pattern, 0.01).at(1.0)
    assert np.abs(state.voltages).max() < 1e-12
    assert state.local.voltages_of([([0], [1.0])])[0] == pytest.approx(0.0, abs=1e-12)
    changed = state.local.voltages_of([([100], [3.0])])[0]
    assert changed == pytest.approx(
        state.model.solve(np.where(np.arange(800) == 100, 3.0, 1.0)).voltages, rel=1e-9
    )


@pytest.mark.parametrize("electrode", [0, 4])
def test_a_contact_that_is_all_but_open_or_shorted(electrode: int) -> None:
    solved = []
    for factor in FACTORS:
        z = Z.copy()
        z[electrode] *= factor
        exact = sixty_digits.voltages(MESH, PATTERN, BASE, z)
        model = ForwardModel(MESH, PATTERN, z)
        if right_or_refused(lambda m=model: m.solve(BASE).voltages, exact):
            solved.append(factor)
    assert set(solved) >= {f for f in FACTORS if 1e-6 < f < 1e6}


def test_a_random_mixture() -> None:
    rng, model = np.random.default_rng(1), ForwardModel(MESH, PATTERN, Z)
    for span in (2, 4, 8, 14):
        sigma = 10.0 ** rng.uniform(-span / 2, span / 2, N)
        exact = sixty_digits.voltages(MESH, PATTERN, sigma, Z)
        answered = right_or_refused(lambda s=sigma: model.solve(s).voltages, exact)
        assert answered or span > 8
