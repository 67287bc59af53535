"""Segmented imaging: regions with sharp edges, found through the complete forward model."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from shapes import box, disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.extras.absolute import (
    Observation,
    RandomField,
    Segmented,
    ShapeImaging,
    shapes as shapes_module,
)
from tomoskin.extras.absolute.shapes import BACKGROUND, LESS, MORE, Phases
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior.smooth import CORRELATIONS

LENGTH = 0.025


def truth(points: FloatArray) -> np.ndarray:
    """A square that conducts 50 times more, and a disc that conducts 50 times less."""
    square = (np.abs(points - np.array([0.04, 0.02])) < 0.025).all(axis=1)
    disc = np.linalg.norm(points - np.array([-0.045, -0.01]), axis=1) < 0.028
    return np.where(square, MORE, np.where(disc, LESS, BACKGROUND))


@cache
def mesh() -> Mesh:
    return disc(16, 700)


@cache
def seen(contact: float = 0.01, water: float = 2.0) -> Observation:
    """Voltages of another, finer mesh."""
    fine = disc(16, 2500)
    sigma = water * np.array([1.0, 0.02, 50.0])[truth(fine.centroids)]
    v = ForwardModel(fine, Pattern.adjacent(16), contact).solve(sigma).voltages
    noise = 0.01 * np.abs(v) + 1e-3 * np.abs(v).max()
    return Observation.of(v + noise * np.random.default_rng(0).standard_normal(len(v)), noise)


@cache
def found() -> Segmented:
    model = ForwardModel(mesh(), Pattern.adjacent(16), 0.01)
    return ShapeImaging(model, LENGTH)(seen())


def overlap(labels: np.ndarray, true: np.ndarray, kind: int) -> float:
    """Intersection over union."""
    one, other = labels == kind, true == kind
    return float((one & other).sum() / (one | other).sum())


def test_regions_are_found_with_their_kind() -> None:
    """Among all points of a raster, not only where the cells are."""
    step = np.linspace(-0.1, 0.1, 101)
    points = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2)
    points = points[np.linalg.norm(points, axis=1) < 0.099]
    labels = found().at(points)
    assert overlap(labels, truth(points), LESS) > 0.8
    assert overlap(labels, truth(points), MORE) > 0.75
    assert found().absolute.background == pytest.approx(2.0, rel=0.05)
    assert found().absolute.misfit < found().absolute.n_values


def test_cells_are_labelled_as_the_points_in_them() -> None:
    assert np.array_equal(found().cells, found().at(mesh().centroids))
    sigma = found().absolute.conductivity.values
    medium = found().absolute.background
    assert (sigma[found().cells == MORE] > 2 * medium).all()
    assert (sigma[found().cells == LESS] < medium / 2).all()


def test_an_empty_medium_has_no_regions() -> None:
    model = ForwardModel(mesh(), Pattern.adjacent(16), 0.01)
    v = model.solve(1.3).voltages
    noise = 0.01 * np.abs(v) + 1e-3 * np.abs(v).max()
    empty = ShapeImaging(model, LENGTH)(
        Observation.of(v + noise * np.random.default_rng(4).standard_normal(len(v)), noise)
    )
    assert not empty.cells.any()
    assert empty.absolute.background == pytest.approx(1.3, rel=0.01)


def test_the_medium_may_be_known() -> None:
    model = ForwardModel(mesh(), Pattern.adjacent(16), 0.01)
    near = ShapeImaging(model, LENGTH, drift=1e-6)(seen(), 1.9).absolute
    assert near.background == pytest.approx(1.9, rel=1e-4)


def test_contact_impedances_may_be_looked_for() -> None:
    model = ForwardModel(mesh(), Pattern.adjacent(16, include_driven=True), 0.02)
    sigma = np.array([1.0, 0.02, 50.0])[truth(mesh().centroids)]
    true = ForwardModel(mesh(), model.pattern, 0.01).solve(sigma).voltages
    imaging = ShapeImaging(model, LENGTH, contacts="one")
    segmented = imaging(Observation.of(true, 0.005 * np.abs(true).max()))
    assert segmented.absolute.contact_impedance == pytest.approx(np.full(16, 0.01), rel=0.1)
    assert overlap(segmented.cells, truth(mesh().centroids), LESS) > 0.6


def test_a_region_in_a_volume() -> None:
    """A column of cells along a bar, through tetrahedra."""
    bar = box(np.linspace(0, 0.2, 9), np.linspace(0, 0.05, 3), np.linspace(0, 0.05, 3))
    rng = np.random.default_rng(0)
    segmented = ShapeImaging(
        ForwardModel(bar, Pattern.from_tables([[0, 1]], [[0, 1]]), 1e-4), 0.05
    )(Observation.of([rng.uniform(1.0, 2.0)], 1e-3))
    assert segmented.absolute.conductivity.unit == "S/m"
    assert segmented.cells.shape == (len(bar.cells),)
    assert segmented.absolute.misfit < 10.0


def test_a_large_region_does_not_lift_the_background(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disc of a third of the medium; with a mean over all cells, specks of the other kind."""

    def filled(points: FloatArray) -> np.ndarray:
        return np.where(np.linalg.norm(points, axis=1) < 0.06, LESS, BACKGROUND)

    fine, pattern = disc(16, 1500), Pattern.adjacent(16)
    sigma = np.where(filled(fine.centroids) == LESS, 0.02, 1.0)
    v = ForwardModel(fine, pattern, 0.01).solve(sigma).voltages
    noise = 0.01 * np.abs(v) + 1e-3 * np.abs(v).max()
    v += noise * np.random.default_rng(0).standard_normal(len(v))
    imaging = ShapeImaging(ForwardModel(mesh(), pattern, 0.01), LENGTH)
    large = imaging(Observation.of(v, noise), 1.0)
    monkeypatch.setattr(shapes_module, "CENTRED", ())
    lifted = imaging(Observation.of(v, noise), 1.0)
    assert overlap(large.cells, filled(mesh().centroids), LESS) > 0.85
    assert (large.cells == MORE).sum() < 0.2 * (lifted.cells == MORE).sum()


def raster() -> FloatArray:
    """(n, 2) points of the disc, 4 mm apart."""
    step = np.linspace(-0.098, 0.098, 50)
    points = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2)
    return np.asarray(points[np.linalg.norm(points, axis=1) < 0.098])


def test_probable_labels_are_the_labels_and_wrong_ones_are_unsure() -> None:
    points = raster()
    labels, bits = found().at(points), found().entropy(points)
    probability = found().probability(points)
    assert probability.sum(axis=1) == pytest.approx(1.0)
    assert (probability.argmax(axis=1) == labels).mean() > 0.97
    assert -1e-12 <= bits.min() < 0.01 < bits.max() <= np.log2(3) + 1e-9
    wrong = labels != truth(points)
    assert 0 < wrong.mean() < 0.1
    # a wrong point is less sure than a right one, nine times of ten
    assert np.mean(bits[wrong][:, None] > bits[~wrong]) > 0.9
    # more is known than how often labels are wrong, alike everywhere
    loss = -np.log(probability[np.arange(len(points)), truth(points)]).mean()
    often = wrong.mean()
    assert loss < -0.8 * (often * np.log(often / 2) + (1 - often) * np.log(1 - often))


def test_what_is_far_from_all_electrodes_that_are_read_is_unsure() -> None:
    """Without E1 to E6, the right half; there the prior is what is left."""
    model = ForwardModel(mesh(), Pattern.adjacent(16), 0.01)
    pattern = model.pattern
    rows = np.hstack([pattern.drives[pattern.drive_index], pattern.measure])
    noise = np.where((rows < 6).any(axis=1), np.inf, seen().noise)
    dark = ShapeImaging(model, LENGTH)(Observation.of(seen().values, noise))
    points = raster()
    unseen = points @ np.array([0.8, 0.3]) > 0.05
    before, after = found().entropy(points), dark.entropy(points)
    assert after[unseen].mean() > 1.5 * before[unseen].mean()
    assert after[unseen].mean() > 1.5 * after[points[:, 0] < -0.05].mean()


@pytest.mark.parametrize("softness", [0.6, 0.15])
def test_chain_is_the_derivative_of_the_contrast(softness: float) -> None:
    field = RandomField.on(disc(), 0.04)
    phases = Phases(field, softness, 0.98)
    rng = np.random.default_rng(1)
    latent, step = rng.standard_normal((2, phases.size))
    h = 1e-6
    slope = (phases.contrast(latent + h * step) - phases.contrast(latent - h * step)) / (2 * h)
    every = np.eye(len(disc().cells))
    assert phases.chain(latent, every) @ step == pytest.approx(slope, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("smoothness", CORRELATIONS)
def test_field_has_the_covariance_that_it_should(smoothness: float) -> None:
    field = RandomField.on(disc(), 0.04, smoothness, left_out=1e-3)
    gaps = cdist(disc().centroids, disc().centroids)
    wanted = CORRELATIONS[smoothness](np.sqrt(2 * smoothness) / 0.04 * gaps)
    assert np.abs(field.basis @ field.basis.T - wanted).max() < 2e-3
    assert np.abs(field.at(disc().centroids) - field.basis).max() < 1e-6


def test_field_of_fewer_modes_leaves_no_more_out_than_it_may() -> None:
    coarse, fine = (RandomField.on(disc(), 0.04, left_out=part) for part in (0.1, 0.01))
    assert coarse.size < fine.size < len(disc().cells)
    for field, part in ((coarse, 0.1), (fine, 0.01)):
        kept = np.einsum("ck,ck->c", field.basis, field.basis)
        assert 1 - part - 1e-9 <= kept.min() <= kept.max() <= 1 + 1e-9


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"length": 0.0}, "expected a correlation length above 0 m, got 0.0"),
        ({"length": np.nan}, "expected a correlation length above 0 m"),
        ({"contrast": 1.0}, "expected a contrast above 1, got 1.0"),
        ({"drift": 0.0}, "expected a drift above 0, got 0.0"),
        ({"softness": ()}, r"expected softness above 0, step by step, got \[\]"),
        ({"softness": (0.5, 0.0)}, "expected softness above 0, step by step"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    with pytest.raises(ModelError, match=message):
        ShapeImaging(model, **{"length": LENGTH, **settings})


def test_smoothness_of_the_field() -> None:
    with pytest.raises(ModelError, match=r"expected a smoothness among 0.5, 1.5, 2.5, got 2.0"):
        RandomField.on(disc(), 0.04, 2.0)


def test_data_of_another_pattern() -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    with pytest.raises(DataError, match="expected an observation of 40 voltages, got one of 208"):
        ShapeImaging(model, LENGTH)(seen())
