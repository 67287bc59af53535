"""The model against the same equations in scikit-fem: another assembly, another elimination."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from golden import mismatch
from scikit_fem import transfer_resistance
from shapes import box, disc, patched
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern


def brick() -> Mesh:
    """Box with five electrodes: two ends, one side, two patches on the top."""
    bar = box(np.linspace(0, 0.2, 6), np.linspace(0, 0.06, 4), np.linspace(0, 0.04, 3))
    return patched(
        bar,
        lambda p: p[:, 0] == 0,
        lambda p: p[:, 0] == 0.2,
        lambda p: p[:, 1] == 0,
        lambda p: (p[:, 2] == 0.04) & (p[:, 0] < 0.07),
        lambda p: (p[:, 2] == 0.04) & (p[:, 0] > 0.13),
    )


MESHES: dict[str, Callable[[], Mesh]] = {"disc": disc, "brick": brick}


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["scalar", "tensor", "complex"])
@pytest.mark.parametrize("shape", MESHES)
def test_scikit_fem_finds_the_same_resistance(shape: str, kind: str, order: int) -> None:
    mesh, rng = MESHES[shape](), np.random.default_rng(0)
    n, d, n_el = len(mesh.cells), mesh.dimension, len(mesh.electrodes)
    root = rng.standard_normal((n, d, d))
    tensor = {
        "scalar": np.exp(rng.standard_normal(n))[:, None, None] * np.eye(d),
        "tensor": root @ root.swapaxes(1, 2) + 0.2 * np.eye(d),
        "complex": root @ root.swapaxes(1, 2) * (1 + 0.7j) + 0.2 * np.eye(d),
    }[kind]
    impedance = np.geomspace(0.001, 0.02, n_el) * (1 - 0.4j if kind == "complex" else 1)
    expected = transfer_resistance(mesh, tensor, impedance, order)
    model = ForwardModel(mesh, Pattern.adjacent(n_el), impedance, order=order)
    sigma = tensor[:, 0, 0] if kind == "scalar" else tensor
    assert mismatch(model.transfer_resistance(sigma), expected) < 1e-9
