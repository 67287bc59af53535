"""The source's metrics on images small enough to be counted by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from shapes import box, grid
from tomoskin.core import DataError, FloatArray, Image
from tomoskin.extras.greit import ThesisMetrics
from tomoskin.model.mesh import Mesh


def squares(n: int = 6) -> Mesh:
    """A sheet of (n − 1)² squares of 1 m, each cut into two triangles."""
    line = np.arange(n, dtype=float)
    points = np.column_stack([np.tile(line, n), np.repeat(line, n)])
    return Mesh(points, grid(n, n), (np.array([[0, 1]]),))


SHEET = squares()
N = len(SHEET.cells)


def image(values: FloatArray, unit: str = "S") -> Image:
    return Image(values, unit, SHEET.identity)


def peaked(**values: float) -> FloatArray:
    """Zero but for the cells named c0, c1, …"""
    whole = np.zeros(N)
    for name, value in values.items():
        whole[int(name[1:])] = value
    return whole


def test_counted_by_hand() -> None:
    """Five elements over 50 %, two of them over 75 %; one of 40 % and an opposite one are not."""
    values = peaked(c0=4.0, c1=3.0, c2=2.0, c3=2.5, c7=2.9, c8=1.6, c9=-3.9)
    found = ThesisMetrics.of(image(values), SHEET, truth=(1.0, 2.0))
    assert found.maximum == 4.0
    assert found.res50 == pytest.approx(1 - np.sqrt(4 / 50))
    assert found.res75 == pytest.approx(1 - np.sqrt(1 / 50))
    assert found.shape_angle == pytest.approx(np.arctan(1.0 / ((found.res75 - found.res50) / 2)))
    middle = SHEET.centroids[:2].mean(axis=0)
    assert found.error75 == pytest.approx(np.linalg.norm(middle - (1.0, 2.0)))


def test_a_single_element_is_the_finest_resolution_and_a_sharp_edge() -> None:
    found = ThesisMetrics.of(image(peaked(c11=-0.3)), SHEET, SHEET.centroids[11])
    assert (found.maximum, found.res50, found.res75) == (-0.3, 1.0, 1.0)
    assert np.degrees(found.shape_angle) == 90.0
    assert found.error75 == pytest.approx(0.0)


def test_everything_at_the_maximum() -> None:
    found = ThesisMetrics.of(image(np.ones(N)), SHEET)
    assert found.res50 == found.res75 == pytest.approx(1 - np.sqrt((N - 1) / N))
    assert np.degrees(found.shape_angle) == 90.0
    assert np.isnan(found.error75)


def test_the_centroid_is_that_of_the_area() -> None:
    """Two elements of unequal size, of which one is three times the other."""
    points = np.array([[0, 0], [4, 0], [1, 3], [4, 4.0]])
    mesh = Mesh(points, np.array([[0, 1, 2], [1, 3, 2]]), (np.array([[0, 1]]),))
    expected = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    found = ThesisMetrics.of(Image(np.array([1.0, 0.8]), "S", mesh.identity), mesh, expected)
    assert found.error75 == pytest.approx(0.0, abs=1e-12)


@given(
    seed=st.integers(0, 10**6),
    scale=st.floats(1e-6, 1e6),
    sign=st.sampled_from([1.0, -1.0]),
)
def test_bounds_and_invariance(seed: int, scale: float, sign: float) -> None:
    """RES75 is never below RES50, β in (0°, 90°]; only maximum and β know the unit."""
    values = np.random.default_rng(seed).standard_normal(N)
    base = ThesisMetrics.of(image(values), SHEET, (0.5, 0.5))
    found = ThesisMetrics.of(image(sign * scale * values), SHEET, (0.5, 0.5))
    assert 0.0 < found.shape_angle <= np.pi / 2
    assert found.res75 >= found.res50
    assert found.maximum == pytest.approx(sign * scale * base.maximum)
    assert (found.res50, found.res75, found.error75) == (base.res50, base.res75, base.error75)


@pytest.mark.parametrize(
    ("values", "truth", "message"),
    [
        (np.zeros(N), None, "shows no change"),
        (np.full(N, np.nan), None, "expected finite values"),
        (np.ones(N) * 1j, None, "expected a real image"),
        (np.ones(N), (0.0, 0.0, 0.0), "2 finite coordinates"),
        (np.ones(N), (np.nan, 0.0), "2 finite coordinates"),
    ],
)
def test_refused(values: Any, truth: Any, message: str) -> None:
    with pytest.raises(DataError, match=message):
        ThesisMetrics.of(image(values), SHEET, truth)


def test_an_image_of_another_mesh_is_refused() -> None:
    line = np.linspace(0, 1, 3)
    with pytest.raises(DataError, match="belongs to mesh"):
        ThesisMetrics.of(image(np.ones(N)), box(line, line, line))
