"""Many conductivities in one call, and the model inside PyTorch and JAX, where these are there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import ForwardModel, jax_voltages, torch_voltages
from tomoskin.model.pattern import Pattern

RNG = np.random.default_rng(7)
MODEL = ForwardModel(disc(8, 300, width=0.015), Pattern.adjacent(8), 0.01, 0.01)
N_CELLS, N_MEAS = len(MODEL.mesh.cells), MODEL.pattern.n_meas
SIGMA = RNG.uniform(0.5, 2.0, (2, 3, N_CELLS))
WEIGHTS = RNG.standard_normal((2, 3, N_MEAS))
CHANGE = RNG.standard_normal((2, 3, N_CELLS))


def each(product: Any, *given: FloatArray) -> FloatArray:
    return np.array([[product(*one) for one in zip(*rows, strict=True)]
                     for rows in zip(*given, strict=True)])  # fmt: skip


def test_many_conductivities_are_solved_one_after_the_other() -> None:
    voltages = each(lambda sigma: MODEL.solve(sigma).voltages, SIGMA)
    assert np.array_equal(MODEL.solve_many(SIGMA), voltages)
    assert np.array_equal(MODEL.solve_many(SIGMA[0, 0]), voltages[0, 0])
    assert np.array_equal(MODEL.vjp(SIGMA, WEIGHTS), each(MODEL.vjp, SIGMA, WEIGHTS))
    assert np.array_equal(MODEL.jvp(SIGMA, CHANGE), each(MODEL.jvp, SIGMA, CHANGE))
    tensors = np.tile(np.eye(2), (N_CELLS, 1, 1))
    assert MODEL.solve_many(tensors) == pytest.approx(MODEL.solve_many(1.0))
    with pytest.raises(ModelError, match=r"each of \(2, 3\) conductivities, got shape \(2, "):
        MODEL.vjp(SIGMA, WEIGHTS[:, 0])
    with pytest.raises(ModelError, match="conductivit"):
        MODEL.solve_many(SIGMA[..., 1:])


def test_in_pytorch() -> None:
    torch: Any = pytest.importorskip("torch")
    voltages = torch_voltages(MODEL)
    sigma = torch.tensor(SIGMA, requires_grad=True)
    found = voltages(sigma)
    assert np.array_equal(found.detach().numpy(), MODEL.solve_many(SIGMA))
    (found * torch.tensor(WEIGHTS)).sum().backward()
    assert sigma.grad.numpy() == pytest.approx(MODEL.vjp(SIGMA, WEIGHTS), rel=1e-12)
    along = torch.func.jvp(voltages, (torch.tensor(SIGMA),), (torch.tensor(CHANGE),))[1]
    assert along.numpy() == pytest.approx(MODEL.jvp(SIGMA, CHANGE), rel=1e-12)
    single = voltages(torch.tensor(SIGMA[0, 0], dtype=torch.float32))
    assert single.dtype == torch.float32
    one = sigma[0, 0].detach().requires_grad_()
    assert torch.autograd.gradcheck(lambda sigma: voltages(sigma)[:3], one)


def test_in_jax() -> None:
    jax: Any = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", val=True)
    voltages = jax_voltages(MODEL)
    assert np.array_equal(jax.jit(voltages)(SIGMA), MODEL.solve_many(SIGMA))
    gradient = jax.jit(jax.grad(lambda sigma: (WEIGHTS * voltages(sigma)).sum()))(SIGMA)
    assert np.asarray(gradient) == pytest.approx(MODEL.vjp(SIGMA, WEIGHTS), rel=1e-12)
    mapped = jax.vmap(jax.grad(lambda s, w: (w * voltages(s)).sum()))(SIGMA[0], WEIGHTS[0])
    assert np.asarray(mapped) == pytest.approx(MODEL.vjp(SIGMA, WEIGHTS)[0], rel=1e-12)
    assert voltages(jax.numpy.asarray(SIGMA[0, 0], "float32")).dtype == "float32"


@pytest.mark.parametrize("bridge", [torch_voltages, jax_voltages])
def test_what_a_bridge_needs(bridge: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    name = bridge.__name__.partition("_")[0]
    monkeypatch.setitem(__import__("sys").modules, name, None)
    with pytest.raises(Exception, match=f"needs the package {name}"):
        bridge(MODEL)
    monkeypatch.setitem(__import__("sys").modules, name, object())
    with pytest.raises(ModelError, match="real contact impedances"):
        bridge(ForwardModel(MODEL.mesh, MODEL.pattern, 0.01 + 0.01j))
