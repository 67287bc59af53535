"""The Gaussian filter: exact on coarse meshes, nearly so and no dearer per cell on fine ones."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.segment.segment import REACH, Blur

COARSE, FINE = 800, 6000


@cache
def sheet(cells: int) -> Mesh:
    return disc(8, cells)


def dense(mesh: Mesh, width: float, values: FloatArray) -> FloatArray:
    """The same by its definition."""
    gap = np.linalg.norm(mesh.centroids[:, None] - mesh.centroids[None], axis=2)
    weights = np.where(gap <= REACH * width, np.exp(-0.5 * (gap / width) ** 2), 0) * mesh.volumes
    return np.asarray(weights @ values / weights.sum(axis=1))


def side(mesh: Mesh) -> float:
    """Of the largest cell, m."""
    return float(np.sqrt(mesh.volumes.max()))


@pytest.mark.parametrize("width", [0.0, 0.004, 0.01])
def test_on_a_coarse_mesh_it_is_its_definition(width: float) -> None:
    mesh = sheet(COARSE)
    assert width < 6 * np.sqrt(mesh.volumes.min())
    values = np.random.default_rng(0).standard_normal(len(mesh.cells))
    expected = dense(mesh, max(width, 1e-9), values)
    np.testing.assert_allclose(Blur(mesh, width)(values), expected, atol=1e-6)


@pytest.mark.slow
def test_on_a_fine_mesh_a_touch_is_averaged_alike() -> None:
    mesh, width = sheet(FINE), 8 * side(sheet(FINE))
    assert (np.sqrt(mesh.volumes) < width / 6).all()
    values = np.exp(-0.5 * ((mesh.centroids - [0.02, 0.01]) ** 2).sum(axis=1) / 0.03**2)
    error = np.abs(Blur(mesh, width)(values) - dense(mesh, width, values))
    assert 0 < error.max() < 0.01


@pytest.mark.parametrize("cells", [COARSE, FINE])
def test_a_level_image_stays_as_it_is(cells: int) -> None:
    mesh = sheet(cells)
    np.testing.assert_allclose(Blur(mesh, 0.03)(np.ones(len(mesh.cells))), 1.0, atol=1e-5)


def test_a_mesh_twice_as_fine_costs_twice_as_much_and_no_more() -> None:
    width = 8 * side(sheet(FINE))
    entries = [Blur(sheet(n), width)._spread.nnz for n in (FINE, 2 * FINE)]
    cells = [len(sheet(n).cells) for n in (FINE, 2 * FINE)]
    assert entries[1] / entries[0] < 1.2 * cells[1] / cells[0]
