"""From an image to detections: right place, right sign, thresholds that mean what they say."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from shapes import disc
from tomoskin.core import DataError, Detection, FloatArray, Image
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import TouchSettings
from tomoskin.sensing.segment import Segmenter

SETTINGS = TouchSettings(
    gamma1=0.65,
    gamma2=0.9,
    smoothing=0.004,
    sign="both",
    snr=5.0,
    position="centroid",
    max_touches=8,
)


@cache
def sheet() -> Mesh:
    return disc(8, 1500)


def blob(x: float, y: float, height: float = -1.0, width: float = 0.012) -> FloatArray:
    offset = sheet().centroids - [x, y]
    return np.asarray(height * np.exp(-0.5 * (offset**2).sum(axis=1) / width**2))


def segment(values: FloatArray, **changes: object) -> list[Detection]:
    image = Image(values, "S", sheet().identity)
    return Segmenter(sheet(), replace(SETTINGS, **changes))(image)  # type: ignore[arg-type]


def test_an_image_of_another_mesh_with_as_many_cells_is_refused() -> None:
    image = Image(blob(0.0, 0.0), "S", "another")
    with pytest.raises(DataError, match=f"image of mesh {sheet().identity}, got one of mesh ano"):
        Segmenter(sheet(), SETTINGS)(image)


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.05, 0.01), (-0.03, -0.06)])
def test_a_blob_is_found_where_it_is(place: tuple[float, float]) -> None:
    (detection,) = segment(blob(*place))
    cell = np.sqrt(sheet().volumes.mean())
    assert np.hypot(detection.x - place[0], detection.y - place[1]) < 0.5 * cell
    assert detection.peak == blob(*place).min()
    assert np.isnan(detection.sd_x)
    assert np.isnan(detection.sd_y)


def test_area_is_that_of_the_cells_above_the_threshold() -> None:
    """A Gaussian exceeds a fraction f inside a circle of radius w·√(2 ln 1/f)."""
    image = blob(0.01, 0.02, width=0.02)
    (detection,) = segment(image, smoothing=0.0, gamma1=0.5, gamma2=1.0)
    above = np.flatnonzero(np.abs(image) >= 0.5 * np.abs(image).max())
    assert sorted(detection.cells) == above.tolist()
    assert detection.area == pytest.approx(sheet().volumes[above].sum())
    assert detection.area == pytest.approx(np.pi * 0.02**2 * 2 * np.log(2), rel=0.1)


def test_centroid_is_weighted_by_area() -> None:
    """Cells shrink towards the rim; their number must not pull the centroid there."""
    rng = np.random.default_rng(0)
    image = blob(0.0, 0.09, width=0.015) * rng.uniform(0.8, 1.0, len(sheet().cells))
    (detection,) = segment(image)
    mass = np.abs(image[detection.cells]) * sheet().volumes[detection.cells]
    expected = mass @ sheet().centroids[detection.cells] / mass.sum()
    assert (detection.x, detection.y) == pytest.approx(tuple(expected), abs=1e-15)


@pytest.mark.parametrize(
    ("sign", "kinds"), [("decrease", [-1.0]), ("increase", [0.9]), ("both", [-1.0, 0.9])]
)
def test_sign(sign: str, kinds: list[float]) -> None:
    image = blob(-0.04, 0.0) + blob(0.04, 0.0, height=0.9)
    detections = segment(image, sign=sign)
    assert [r.peak for r in detections] == pytest.approx(kinds, rel=0.05)
    for detection in detections:
        assert np.sign(detection.x) == np.sign(detection.peak)


@pytest.mark.parametrize("sign", ["decrease", "increase"])
def test_an_image_of_the_other_sign_has_no_touch(sign: str) -> None:
    height = 1.0 if sign == "decrease" else -1.0
    assert segment(blob(0, 0, height=height), sign=sign) == []


def test_touching_blobs_of_opposite_sign_stay_apart() -> None:
    offset = sheet().centroids[:, 0]
    image = np.where(np.abs(sheet().centroids).max(axis=1) < 0.03, np.sign(offset), 0.0)
    detections = segment(image, smoothing=0.0)
    assert sorted(np.sign(r.peak) for r in detections) == [-1, 1]


def test_two_blobs_are_two_readings_strongest_first() -> None:
    image = blob(-0.05, 0.0, height=-0.9) + blob(0.05, 0.0, height=-1.0)
    strong, weak = segment(image)
    assert abs(strong.peak) > abs(weak.peak)
    assert (strong.x, weak.x) == pytest.approx((0.05, -0.05), abs=2e-3)


def test_gamma1_hides_what_is_much_weaker_than_the_strongest() -> None:
    image = blob(-0.05, 0.0, height=-0.55) + blob(0.05, 0.0, height=-1.0)
    assert len(segment(image, gamma1=0.65)) == 1
    assert len(segment(image, gamma1=0.4)) == 2


def test_gamma2_and_smoothing_drop_what_is_narrower_than_the_filter() -> None:
    image = blob(0.05, 0.0)
    lone = int(np.argmin(np.linalg.norm(sheet().centroids - [-0.05, 0.0], axis=1)))
    image[lone] = -1.0
    assert len(segment(image, smoothing=0.0)) == 2
    (detection,) = segment(image, smoothing=0.006)
    assert detection.x > 0


def test_the_filter_averages_cells_above_gamma1_only() -> None:
    """By hand, dense: threshold, area-weighted Gaussian to two widths, second threshold.

    At an electrode, where cells are small, and inside.
    """
    mesh, width = sheet(), 0.006
    image = blob(0.0, 0.08, width=0.02) + 0.8 * blob(-0.04, -0.03)
    limit = 0.65 * np.abs(image).max()
    masked = np.where(np.abs(image) >= limit, image, 0.0)
    gap = np.linalg.norm(mesh.centroids[:, None] - mesh.centroids[None], axis=2)
    weights = np.where(gap <= 2 * width, np.exp(-0.5 * (gap / width) ** 2), 0.0) * mesh.volumes
    filtered = weights @ masked / weights.sum(axis=1)
    expected = np.flatnonzero(np.abs(filtered) >= 0.9 * limit)
    detections = segment(image, smoothing=width)
    assert sorted(np.concatenate([r.cells for r in detections])) == expected.tolist()


def test_regions_are_the_connected_components() -> None:
    """Against scipy's, on speckle that makes many regions."""
    mesh, rng = sheet(), np.random.default_rng(1)
    image = np.where(rng.random(len(mesh.cells)) < 0.5, rng.choice([-1.0, 1.0]), 0.0)
    image *= rng.uniform(0.8, 1.0, len(image))
    detections = segment(image, smoothing=0.0, gamma1=0.5, gamma2=1.0, max_touches=10_000)
    kept = image != 0
    joined = kept[mesh.neighbours].all(axis=1)
    ends = mesh.neighbours[joined].T
    graph = coo_array((np.ones(len(ends[0])), tuple(ends)), shape=(len(image),) * 2)
    _, label = connected_components(graph, directed=False)
    expected = {frozenset(np.flatnonzero(label == k)) for k in np.unique(label[kept])}
    assert {frozenset(r.cells.tolist()) for r in detections} == expected


def test_at_most_so_many_touches_and_the_strongest_stay() -> None:
    places = [(-0.06, 0), (0.06, 0), (0, 0.06), (0, -0.06)]
    heights = [0.85, 1.0, 0.9, 0.95]
    image = sum((blob(*p, height=h) for p, h in zip(places, heights, strict=True)), np.zeros(1))
    detections = segment(image, max_touches=2)
    assert [(round(r.x, 2), round(r.y, 2)) for r in detections] == [(0.06, 0.0), (0.0, -0.06)]


def test_scale_does_not_matter() -> None:
    image = blob(0.02, 0.03)
    for scale in (1e-9, 1e9):
        (detection,) = segment(scale * image)
        assert (detection.x, detection.y) == pytest.approx(
            (segment(image)[0].x, segment(image)[0].y), rel=1e-9
        )


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_nothing_is_found_in_nothing(value: float) -> None:
    assert segment(np.full(len(sheet().cells), value)) == []


def test_positions_by_extremes_part_what_one_region_joins() -> None:
    image = blob(-0.018, 0.0) + blob(0.018, 0.0)
    (joined,) = segment(image, gamma1=0.4)
    assert joined.x == pytest.approx(0.0, abs=2e-3)
    left, right = sorted(segment(image, gamma1=0.4, position="peak"), key=lambda r: r.x)
    cell = np.sqrt(sheet().volumes.mean())
    assert (left.x, right.x) == pytest.approx((-0.018, 0.018), abs=1.5 * cell)
    assert np.isnan(left.sd_x)


def test_a_level_region_still_has_a_position_by_extremes() -> None:
    """A plateau has no cell above all its neighbours."""
    image = np.where(np.abs(sheet().centroids).max(axis=1) < 0.03, -1.0, 0.0)
    (detection,) = segment(image, smoothing=0.0, position="peak")
    assert abs(detection.x) < 0.03
    assert detection.peak == -1.0
