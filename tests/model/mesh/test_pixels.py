"""Pixels: each one's cell, against the mesh's own geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from shapes import box, disc, folded, grid, rings, strip
from tomoskin.core import DataError, FloatArray, GeometryError, Image, PixelMap
from tomoskin.model.mesh import Mesh


def centres(pixels: PixelMap) -> FloatArray:
    return np.asarray(np.stack(np.meshgrid(pixels.x, pixels.y), axis=-1))


def square(n: int = 2) -> Mesh:
    line = np.linspace(0.0, 1.0, n)
    points = np.column_stack([np.tile(line, n), np.repeat(line, n)])
    return Mesh(points, grid(n, n), (np.array([[0, 1]]),))


def test_two_triangles() -> None:
    """The square's diagonal runs up to the right; pixels on it go to the lower number."""
    pixels = square().pixels(2)
    assert pixels.x.tolist() == [0.25, 0.75]
    assert pixels.y.tolist() == [0.75, 0.25]
    assert pixels.cells.tolist() == [[1, 0], [0, 0]]


@given(
    seed=st.integers(0, 1000),
    count=st.integers(1, 60),
)
def test_a_linear_field_comes_back(seed: int, count: int) -> None:
    """Each pixel lies in its cell: its centre is a convex mixture of the corners."""
    mesh = disc(8, 150)
    turn = np.random.default_rng(seed).uniform(0, np.pi)
    spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    mesh = Mesh(mesh.points @ spin.T, mesh.cells, mesh.electrodes)
    pixels = mesh.pixels(count)
    inside = pixels.cells >= 0
    corner = mesh.points[mesh.cells[pixels.cells[inside]]]
    matrix = np.concatenate([corner, np.ones((len(corner), 3, 1))], axis=2).swapaxes(1, 2)
    place = np.concatenate([centres(pixels)[inside], np.ones((inside.sum(), 1))], axis=1)
    share = np.linalg.solve(matrix, place[..., None])
    assert share.min() > -1e-9


def test_area_of_the_pixels_is_that_of_the_sheet() -> None:
    mesh = disc(8, 300)
    pixels = mesh.pixels(step=5e-4)
    assert (pixels.cells >= 0).sum() * 25e-8 == pytest.approx(mesh.volumes.sum(), rel=2e-3)
    count = np.bincount(pixels.cells[pixels.cells >= 0], minlength=len(mesh.cells))
    assert count * 25e-8 == pytest.approx(mesh.volumes, rel=0.1)


def test_a_hole_is_outside() -> None:
    """A square with its middle four cells cut out."""
    whole = square(5)
    keep = np.abs(whole.centroids - 0.5).max(axis=1) > 0.25
    used = np.unique(whole.cells[keep])
    number = np.full(len(whole.points), -1)
    number[used] = np.arange(len(used))
    ring = Mesh(whole.points[used], number[whole.cells[keep]], (number[whole.boundary[:1]],))
    pixels = ring.pixels(40)
    middle = (np.abs(centres(pixels) - 0.5) < 0.25).all(axis=-1)
    assert np.array_equal(pixels.cells < 0, middle)


def test_rim_pixels_of_a_round_sheet() -> None:
    mesh = rings(np.array([0.5, 1.0]), 40)
    pixels = mesh.pixels(101)
    r = np.linalg.norm(centres(pixels), axis=-1)
    apothem = np.cos(np.pi / 40)
    assert (pixels.cells[r < apothem] >= 0).all()
    assert (pixels.cells[r > 1.0 + 1e-9] < 0).all()


def test_a_slice_of_a_volume() -> None:
    line = np.linspace(0, 1, 4)
    body = box(2 * line, line, line)
    pixels = body.pixels(20, z=0.4)
    assert pixels.cells.shape == (10, 20)
    corner = body.points[body.cells[pixels.cells]]
    place = np.concatenate([centres(pixels), np.full((10, 20, 1), 0.4)], axis=-1)[..., None, :]
    assert (corner.min(axis=2) <= place[..., 0, :] + 1e-12).all()
    assert (corner.max(axis=2) >= place[..., 0, :] - 1e-12).all()


def test_image_on_pixels() -> None:
    mesh = disc(8, 150)
    pixels = mesh.pixels(30)
    values = np.arange(len(mesh.cells), dtype=float)
    picture = Image(values, "S", mesh.identity).on_pixels(pixels)
    assert np.isnan(picture[pixels.cells < 0]).all()
    assert np.array_equal(picture[pixels.cells >= 0], pixels.cells[pixels.cells >= 0])


def test_an_image_of_another_mesh_is_refused() -> None:
    """By identity: a mesh with as many cells is another one all the same."""
    mesh = disc(8, 150)
    other = Mesh(1.01 * mesh.points, mesh.cells, mesh.electrodes)
    image = Image(np.zeros(len(mesh.cells)), "S", mesh.identity)
    with pytest.raises(DataError, match=r"the image belongs to mesh \w+, the pixels to"):
        image.on_pixels(other.pixels(10))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"count": 0}, "at least 1 pixel, got 0"),
        ({"step": 0.0}, "pixel size above 0 m, got 0 m"),
        ({"step": np.nan}, "pixel size above 0 m"),
        ({"step": 1e-9}, "more than"),
        ({"z": 0.0}, "no height for a sheet in the plane"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        square().pixels(**settings)


@pytest.mark.parametrize(
    ("height", "message"),
    [(None, "height of a slice"), (1.5, "from 0 to 1 m, got 1.5"), (np.nan, "from 0 to 1 m")],
)
def test_a_volume_needs_a_height_within(height: float | None, message: str) -> None:
    line = np.linspace(0, 1, 3)
    with pytest.raises(GeometryError, match=message):
        box(line, line, line).pixels(4, z=height)


def test_a_curved_sheet_is_refused() -> None:
    x = np.linspace(0, 0.2, 21)
    curved = folded(strip(x, np.linspace(0, 0.06, 8)), x[3:-1:3], 0.4)
    with pytest.raises(GeometryError, match="curved sheet has no pixels"):
        curved.pixels(10)
