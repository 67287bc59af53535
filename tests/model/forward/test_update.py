"""The local update equals the full solve, and refuses what it cannot do exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from golden import mismatch
from shapes import box, disc, folded, patched, strip
from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.forward import ForwardModel, State, update
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

RNG_SEED = 5


def curved() -> Mesh:
    x = np.linspace(0, 0.2, 21)
    return folded(strip(x, np.linspace(0, 0.06, 8)), x[3:-1:3], 0.4)


def volume() -> Mesh:
    bar = box(np.linspace(0, 0.2, 7), np.linspace(0, 0.06, 4), np.linspace(0, 0.04, 3))
    sides = [lambda p: p[:, 1] == 0, lambda p: p[:, 0] == 0, lambda p: p[:, 2] == 0]
    sides.append(lambda p: p[:, 0] == 0.2)
    return patched(bar, *sides)


MESHES = {"plane": lambda: disc(8, 500), "curved": curved, "volume": volume}


@pytest.fixture(scope="module", params=MESHES)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]()


def state(mesh: Mesh, *, order: int = 1, turn: complex = 1.0) -> State:
    rng, n = np.random.default_rng(RNG_SEED), len(mesh.electrodes)
    model = ForwardModel(mesh, Pattern.all_pairs(n, include_driven=n < 6), 0.01, order=order)
    return model.at(np.exp(0.5 * rng.standard_normal(len(mesh.cells))) * turn)


def touched(mesh: Mesh, count: int) -> IntArray:
    """The ``count`` cells nearest to a cell off the middle."""
    place = mesh.centroids[len(mesh.cells) // 3]
    return np.argsort(np.linalg.norm(mesh.centroids - place, axis=1), kind="stable")[:count]


def full(base: State, cells: IntArray, sigma: NDArray[Any]) -> NDArray[Any]:
    whole = base.conductivity.astype(np.result_type(base.conductivity, sigma))
    whole[cells] = sigma
    return base.model.solve(whole).voltages


def both(factor: FloatArray | complex, base: State, cells: IntArray) -> float:
    sigma = base.conductivity[cells] * factor
    return mismatch(base.local.voltages_of([(cells, sigma)])[0], full(base, cells, sigma))


@pytest.mark.parametrize("factor", [1e-3, 0.5, 1.0, 30.0, 1e3])
@pytest.mark.parametrize("count", [1, 2, 150, 10**6])
def test_the_update_equals_the_full_solve(mesh: Mesh, count: int, factor: float) -> None:
    assert both(factor, state(mesh), touched(mesh, count)) < 1e-10


@pytest.mark.parametrize("order", [1, 2])
def test_increases_and_decreases_in_no_order(mesh: Mesh, order: int) -> None:
    rng, base = np.random.default_rng(0), state(mesh, order=order)
    for _ in range(4):
        cells = rng.permutation(len(mesh.cells))[:40]
        assert both(10.0 ** rng.uniform(-3, 3, len(cells)), base, cells) < 1e-10


def test_complex_admittivity(mesh: Mesh) -> None:
    rng, cells = np.random.default_rng(1), touched(mesh, 60)
    factor = 10.0 ** rng.uniform(-3, 3, len(cells)) * (1 + 0.8j * rng.random(len(cells)))
    assert both(factor, state(mesh, turn=1 + 0.3j), cells) < 1e-10
    assert both(factor, state(mesh), cells) < 1e-10  # the touch alone is complex


def test_transfer_resistance_stays_symmetric_and_centred(mesh: Mesh) -> None:
    base, cells = state(mesh), touched(mesh, 30)
    r = base.local.transfer_resistances_of([(cells, np.full(len(cells), 0.01))])[0]
    assert np.abs(r - r.T).max() < 1e-12 * np.abs(r).max()
    assert np.abs(r.sum(axis=0)).max() < 1e-12 * np.abs(r).max()


def test_nothing_touched_is_the_base_state() -> None:
    base = state(disc())
    for cells in (list[int](), np.zeros(0, dtype=int)):
        assert np.array_equal(base.local.voltages_of([(cells, [])])[0], base.voltages)


def test_the_order_of_calls_and_of_cells_does_not_matter() -> None:
    mesh = disc(8, 500)
    base, again = state(mesh), state(mesh)
    touches = [touched(mesh, 20), touched(mesh, 90), touched(mesh, 5)]
    first = [base.local.voltages_of([(t, np.full(len(t), 0.1))])[0] for t in touches]
    for cells, expected in zip(touches[::-1], first[::-1], strict=True):
        turned = again.local.voltages_of([(cells[::-1], np.full(len(cells), 0.1))])[0]
        assert mismatch(turned, expected) < 1e-12
    assert np.array_equal(base.voltages, state(mesh).voltages)


def spread(mesh: Mesh, count: int) -> list[tuple[IntArray, FloatArray]]:
    rng, touches = np.random.default_rng(3), []
    for size in rng.integers(1, 60, count):
        start = rng.integers(len(mesh.cells) - size)
        touches.append((np.arange(start, start + size), 10.0 ** rng.uniform(-2, 2, size)))
    return touches


def test_many_touches_at_once_are_those_one_by_one(mesh: Mesh) -> None:
    base, touches = state(mesh), [*spread(mesh, 20), (np.zeros(0, int), np.zeros(0))]
    voltages, resistances = (
        ask(touches) for ask in (base.local.voltages_of, base.local.transfer_resistances_of)
    )
    for number, touch in enumerate(touches):
        assert mismatch(voltages[number], base.local.voltages_of([touch])[0]) < 1e-12
        assert mismatch(resistances[number], base.local.transfer_resistances_of([touch])[0]) < 1e-12
    assert mismatch(voltages[5], full(base, *touches[5])) < 1e-10


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("turn", [1.0, 1.0 + 0.3j])
def test_many_touches_without_the_native_engine(
    mesh: Mesh, order: int, turn: complex, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of all sizes."""
    monkeypatch.setenv("TOMOSKIN_ENGINE", "scipy")
    base = state(mesh, order=order, turn=turn)
    touches = [
        (cells, base.conductivity[cells] * factor)
        for factor in (0.1, 3.0)
        for cells in (touched(mesh, count) for count in (1, 2, 9, 10, 40, 200))
    ]
    for voltages, (cells, sigma) in zip(base.local.voltages_of(touches), touches, strict=True):
        assert mismatch(voltages, full(base, cells, sigma)) < 1e-10


def test_no_touch_at_all(mesh: Mesh) -> None:
    base = state(mesh)
    assert base.local.voltages_of([]).shape == (0, base.model.pattern.n_meas)


def test_a_wrong_one_among_many_is_named() -> None:
    base, touches = state(disc()), spread(disc(), 5)
    touches[3] = (np.array([7, 8]), np.array([1.0, -2.0]))
    with pytest.raises(ModelError, match="positive finite") as caught:
        base.local.voltages_of(touches)
    assert caught.value.where == "touch 3, cell 8"


def test_a_large_patch_is_factorised_anew(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    base, touches = state(mesh), spread(mesh, 6)
    expected = base.local.voltages_of(touches)
    monkeypatch.setattr(update, "MOST_CELLS", 30)
    assert max(len(cells) for cells, _ in touches) > 30
    assert mismatch(state(mesh).local.voltages_of(touches), expected) < 1e-10
    with pytest.raises(ModelError, match="each cell once"):
        base.local.voltages_of([(np.zeros(31, int), np.ones(31))])


def test_a_store_too_small_for_all_touches(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    touches = spread(mesh, 12)
    expected = state(mesh).local.voltages_of(touches)
    monkeypatch.setattr(update, "MOST_BYTES", 1)
    assert mismatch(state(mesh).local.voltages_of(touches), expected) < 1e-12


def test_columns_are_computed_once() -> None:
    mesh = disc(8, 500)
    base, cells = state(mesh), touched(mesh, 40)
    counted = Counted(base.factor)
    object.__setattr__(base, "factor", counted)
    for factor in (0.1, 2.0, 3.0):
        base.local.voltages_of([(cells, np.full(len(cells), factor))])
    # one solve of the basis, one of the nodes that the patch needs
    assert len(counted.asked) == 2


class Counted:
    """A factor that notes how many columns each solve had."""

    def __init__(self, factor: Any) -> None:
        self.factor = factor
        self.asked: list[int] = []

    def columns(self, rows: IntArray) -> NDArray[Any]:
        self.asked.append(len(rows))
        return np.asarray(self.factor.columns(rows))

    def checked_columns(self, values: NDArray[Any], rows: IntArray) -> Any:
        self.asked.append(len(rows))
        return self.factor.checked_columns(values, rows)


def test_a_full_store_forgets_and_stays_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = disc(8, 500)
    base, rng = state(mesh), np.random.default_rng(2)
    monkeypatch.setattr(update, "MOST_BYTES", 60 * 8 * len(mesh.points))
    for count in (10, 40, 10, 200, 3, 40):  # 200 cells alone are more than the store holds
        start = rng.integers(len(mesh.cells) - count)
        cells = np.arange(start, start + count)
        assert both(10.0 ** rng.uniform(-2, 2, count), base, cells) < 1e-10


@pytest.mark.parametrize(
    ("cells", "sigma", "message"),
    [
        ([3, 5, 3], [1.0, 1.0, 1.0], "each cell once"),
        ([-1], [1.0], "cells from 0 to"),
        ([10**6], [1.0], "cells from 0 to"),
        ([1.0], [1.0], "expected cells"),
        ([[1]], [[1.0]], "expected cells"),
        ([1, 2], [1.0], "as many conductivities"),
        ([1], 1.0, "as many conductivities"),
    ],
)
def test_impossible_cells(cells: Any, sigma: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        state(disc()).local.voltages_of([(cells, sigma)])


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1j])
def test_impossible_conductivity_names_the_cell(value: complex) -> None:
    with pytest.raises(ModelError, match="positive finite conductivity") as caught:
        state(disc()).local.voltages_of([([4, 17], [1.0, value])])
    assert caught.value.where == "cell 17"


def test_a_tensor_state_is_refused() -> None:
    mesh = disc()
    base = ForwardModel(mesh, Pattern.adjacent(8), 0.01).at(
        np.broadcast_to(np.eye(2), (len(mesh.cells), 2, 2))
    )
    with pytest.raises(ModelError, match="scalar conductivity"):
        base.local.voltages_of([([1], [1.0])])
