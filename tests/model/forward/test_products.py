"""Products with the jacobian that never make it: along a change, and of weighted measurements."""

from __future__ import annotations

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

RNG = np.random.default_rng(6)
PATTERN = Pattern.adjacent(8).joined(Pattern.opposite(8, include_driven=True))


def model(z: complex = 0.01, order: int = 1) -> ForwardModel:
    current = RNG.uniform(0.01, 0.1, PATTERN.n_drive)
    return ForwardModel(disc(8, 300, width=0.015), PATTERN, z, current, order=order)


def cells(made: ForwardModel, kind: type = float) -> FloatArray:
    values = RNG.uniform(0.5, 2.0, len(made.mesh.cells))
    if kind is complex:
        return np.asarray(values * np.exp(0.3j * RNG.standard_normal(len(values))))
    return np.asarray(values)


@pytest.mark.parametrize("kind", [float, complex])
@pytest.mark.parametrize("order", [1, 2])
def test_products_are_those_of_the_jacobian(kind: type, order: int) -> None:
    made = model(0.01 + 0.002j if kind is complex else 0.01, order)
    state = made.at(cells(made, kind))
    change, weights = RNG.standard_normal((2, 3, len(made.mesh.cells))), None
    weights = RNG.standard_normal((2, PATTERN.n_meas))
    assert state.jvp(change) == pytest.approx(change @ state.jacobian.T, rel=1e-10, abs=1e-13)
    assert state.vjp(weights) == pytest.approx(weights @ state.jacobian, rel=1e-10, abs=1e-13)
    assert state.vjp(weights[0]).shape == (len(made.mesh.cells),)


@pytest.mark.parametrize("kind", [float, complex])
def test_products_are_the_differences_of_voltages(kind: type) -> None:
    """By a polynomial through nine conductivities along the change, to ten digits."""
    made = model(0.01 + 0.002j if kind is complex else 0.01)
    sigma, change = cells(made, kind), 0.2 * cells(made, kind)
    steps = np.arange(-4, 5)
    weight = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840.0
    h = 0.05
    voltages = np.array([made.solve(sigma + h * s * change).voltages for s in steps])
    expected = weight @ voltages / h
    got = made.jvp(sigma, change)
    assert np.abs(got - expected).max() < 1e-10 * np.abs(expected).max()
    weights = RNG.standard_normal(PATTERN.n_meas)
    gradient = made.vjp(sigma, weights)
    assert gradient @ change == pytest.approx(weights @ expected, rel=1e-9)


def test_what_cannot_be_multiplied_is_refused() -> None:
    made = model()
    state = made.at(1.0)
    with pytest.raises(ModelError, match=r"change of shape \(…, \d+\), got \(3,\)"):
        state.jvp(np.ones(3))
    with pytest.raises(ModelError, match="finite weights"):
        state.vjp(np.full(PATTERN.n_meas, np.nan))
    tensors = np.tile(np.eye(2), (len(made.mesh.cells), 1, 1))
    with pytest.raises(ModelError, match="got tensors"):
        made.at(tensors).vjp(np.ones(PATTERN.n_meas))
