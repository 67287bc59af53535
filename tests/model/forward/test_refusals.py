"""What the forward model refuses, and that the message names the place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

MESH = disc()
PATTERN = Pattern.adjacent(8)
N_CELLS = len(MESH.cells)


def with_cell(value: complex, cell: int = 7) -> Any:
    sigma = np.ones(N_CELLS, dtype=type(value))
    sigma[cell] = value
    return sigma


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, -1 + 1j, complex(1, np.nan)])
def test_impossible_conductivity_names_the_cell(value: complex) -> None:
    model = ForwardModel(MESH, PATTERN, 0.01)
    with pytest.raises(ModelError, match="positive finite conductivity") as caught:
        model.solve(with_cell(value))
    assert caught.value.where == "cell 7"


@pytest.mark.parametrize("shape", [(N_CELLS + 1,), (N_CELLS, 1), (1,), (0,)])
def test_conductivity_of_another_mesh(shape: tuple[int, ...]) -> None:
    with pytest.raises(ModelError, match=rf"shape \({N_CELLS},\) or \({N_CELLS}, 2, 2\), got"):
        ForwardModel(MESH, PATTERN, 0.01).solve(np.ones(shape))


@pytest.mark.parametrize("value", [0.0, -0.1, np.nan, np.inf, -1j])
def test_impossible_contact_impedance_names_the_electrode(value: complex) -> None:
    z = np.full(8, 0.01, dtype=type(value))
    z[3] = value
    with pytest.raises(ModelError, match="positive contact impedance") as caught:
        ForwardModel(MESH, PATTERN, z)
    assert caught.value.where == "E4"


def test_another_count_of_contact_impedances() -> None:
    with pytest.raises(ModelError, match=r"one contact impedance or 8, got shape \(7,\)"):
        ForwardModel(MESH, PATTERN, np.ones(7))


@pytest.mark.parametrize("current", [0.0, np.nan, np.inf, np.array([1, 1, 1, 1, 0, 1, 1, 1])])
def test_impossible_current(current: Any) -> None:
    with pytest.raises(ModelError, match="currents other than zero"):
        ForwardModel(MESH, PATTERN, 0.01, current)


def test_another_count_of_currents() -> None:
    with pytest.raises(ModelError, match=r"one current or 8, got shape \(3,\)"):
        ForwardModel(MESH, PATTERN, 0.01, [1, 2, 3])


@pytest.mark.parametrize("value", ["x", None, [1.0, [2.0]], ["0.01"] * 8, object()])
def test_what_is_no_number_is_refused(value: Any) -> None:
    local = ForwardModel(MESH, PATTERN, 0.01).at(1.0).local
    for give in (
        lambda: ForwardModel(MESH, PATTERN, value),
        lambda: ForwardModel(MESH, PATTERN, 0.01, value),
        lambda: ForwardModel(MESH, PATTERN, 0.01).solve(value),
        lambda: local.voltages([1], value),
        lambda: local.voltages(value, [1.0]),
    ):
        with pytest.raises(ModelError, match="expected"):
            give()


def test_a_complex_current_is_refused() -> None:
    with pytest.raises(ModelError, match="real currents"):
        ForwardModel(MESH, PATTERN, 0.01, 1j)


@pytest.mark.parametrize("order", [0, 3, "2", None])
def test_another_order(order: Any) -> None:
    with pytest.raises(ModelError, match="order 1 or 2"):
        ForwardModel(MESH, PATTERN, 0.01, order=order)


def test_pattern_of_another_electrode_count() -> None:
    with pytest.raises(ModelError, match="the mesh has 8 electrodes and the pattern 16"):
        ForwardModel(MESH, Pattern.adjacent(16), 0.01)


@pytest.mark.parametrize(("sigma", "z"), [(1e-320, 1e300), (1e300, 1.0), (1.0, 1e300)])
def test_a_singular_system_never_returns_numbers(sigma: float, z: float) -> None:
    with pytest.raises(ModelError, match="singular to working precision"):
        ForwardModel(MESH, PATTERN, z).solve(sigma)


def test_a_cut_off_electrode_is_noticed() -> None:
    """σ so small around one electrode that rounding swallows it."""
    sigma = np.ones(N_CELLS)
    near = np.isin(MESH.cells, MESH.electrodes[0]).any(axis=1)
    sigma[near] = 1e-300
    with pytest.raises(ModelError, match="singular"):
        ForwardModel(MESH, PATTERN, 1e280).solve(sigma)


def test_residual_is_checked() -> None:
    """A factor that belongs to another matrix is found out."""
    model = ForwardModel(MESH, PATTERN, 0.01)
    state, other = model.at(np.ones(N_CELLS)), model.at(np.full(N_CELLS, 2.0))
    vars(state)["factor"] = other.factor
    with pytest.raises(ModelError, match="singular"):
        state.voltages  # noqa: B018 - computed when it is asked for
