"""The Gaussian filter of segmentation, beside its definition."""

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


@pytest.mark.parametrize("width", [0.0, 0.004, 0.01])
def test_it_is_its_definition(width: float) -> None:
    mesh = sheet(COARSE)
    values = np.random.default_rng(0).standard_normal(len(mesh.cells))
    expected = dense(mesh, max(width, 1e-9), values)
    np.testing.assert_allclose(Blur(mesh, width)(values), expected, atol=1e-6)


@pytest.mark.parametrize("cells", [COARSE, FINE])
def test_a_level_image_stays_as_it_is(cells: int) -> None:
    mesh = sheet(cells)
    np.testing.assert_allclose(Blur(mesh, 0.03)(np.ones(len(mesh.cells))), 1.0, atol=1e-5)
