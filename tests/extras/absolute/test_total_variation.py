"""Sharp priors: what they cost, the quadratics that touch them, and edges that they keep."""

from __future__ import annotations

import numpy as np
import pytest

from shapes import box, disc, mapped, strip
from tomoskin.core import FloatArray, ModelError
from tomoskin.extras.absolute import Observation, SharpDifference
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import SharpPrior, Sparse, TotalVariation

SHARP: tuple[SharpPrior, ...] = (TotalVariation(0.05), Sparse(0.05))


def spot(mesh: Mesh, place: tuple[float, float] = (0.03, 0.02), radius: float = 0.03) -> FloatArray:
    return np.where(np.linalg.norm(mesh.centroids - np.array(place), axis=1) < radius, 1.0, 0.0)


@pytest.mark.parametrize("prior", SHARP, ids=lambda prior: type(prior).__name__)
def test_the_quadratic_touches_the_cost_from_above(prior: SharpPrior) -> None:
    mesh = disc()
    rng = np.random.default_rng(0)
    image = rng.standard_normal(len(mesh.cells))
    q = prior.touching(mesh, image).matrix

    def quadratic(x: FloatArray) -> float:
        return float(x @ (q * x if q.ndim == 1 else q @ x))

    above = prior.energy(mesh, image) - quadratic(image)
    for _ in range(5):
        other = image + rng.standard_normal(len(image)) * rng.choice([1e-3, 1.0])
        assert quadratic(other) + above >= prior.energy(mesh, other)
    step = 1e-5 * rng.standard_normal(len(image))
    slopes = [
        (f(image + step) - f(image - step)) for f in (quadratic, lambda x: prior.energy(mesh, x))
    ]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-6)


def test_total_variation_of_a_region_is_twice_its_jump_times_its_edge() -> None:
    sheet = strip(np.linspace(0, 2, 9), np.linspace(0, 1, 5))
    half = np.where(sheet.centroids[:, 0] < 1.0, 0.0, 3.0)
    edge, root = 1.0, np.sqrt(2.0)
    assert TotalVariation(1e-9).energy(sheet, half) == pytest.approx(2 * 3.0 * edge / root)
    assert TotalVariation(0.1).energy(sheet, np.full(len(half), 5.0)) == 0


def test_total_variation_in_a_volume_goes_by_the_area_of_faces() -> None:
    bar = box(np.linspace(0, 2, 5), np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    half = np.where(bar.centroids[:, 0] < 1.0, 0.0, 3.0)
    expected = 2 * 3.0 * 1.0 / 2.0 ** (2 / 3)
    assert TotalVariation(1e-9).energy(bar, half) == pytest.approx(expected)


@pytest.mark.parametrize("prior", SHARP, ids=lambda prior: type(prior).__name__)
def test_cost_does_not_depend_on_the_unit_of_length(prior: SharpPrior) -> None:
    mesh = disc()
    image = spot(mesh)
    large = mapped(mesh, lambda points: 1e3 * points)
    assert prior.energy(large, image) == pytest.approx(prior.energy(mesh, image))


@pytest.mark.parametrize("smoothing", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("kind", [TotalVariation, Sparse])
def test_smoothing_must_be_positive(kind: type[TotalVariation | Sparse], smoothing: float) -> None:
    with pytest.raises(ModelError, match="expected a smoothing above 0"):
        kind(smoothing).touching(disc(), np.zeros(len(disc().cells)))


def edges(values: FloatArray, truth: FloatArray, mesh: Mesh) -> float:
    """Part of the image's jumps, by height and length, that lie on edges of the truth."""
    first, second = mesh.neighbours.T
    jump = np.abs(values[first] - values[second])
    return float(jump[truth[first] != truth[second]].sum() / jump.sum())


def test_total_variation_keeps_the_edge_that_laplace_blurs() -> None:
    mesh = disc(16, 600)
    model = ForwardModel(mesh, Pattern.adjacent(16), 0.01)
    truth = 0.2 * spot(mesh)
    dv = model.jacobian(1.0) @ truth
    noise = 1e-4 * np.abs(dv).max()
    dv += noise * np.random.default_rng(1).standard_normal(len(dv))
    sharp = SharpDifference(model, TotalVariation(1e-3), alpha=10.0)(Observation.of(dv, noise))
    smooth = OneStep(model, "laplace", alpha=noise * 10.0)(dv)
    assert edges(sharp.image.values, truth, mesh) > 1.5 * edges(smooth.values, truth, mesh)
    assert sharp.image.values[truth > 0].mean() == pytest.approx(0.2, rel=0.1)
    assert sharp.image.unit == "S"
    assert sharp.image.mesh_id == mesh.identity


def test_without_alpha_the_data_are_explained_to_their_noise() -> None:
    mesh = disc(16, 600)
    model = ForwardModel(mesh, Pattern.adjacent(16), 0.01)
    truth = 0.2 * spot(mesh)
    dv = model.jacobian(1.0) @ truth
    noise = 3e-3 * np.abs(dv).max()
    dv += noise * np.random.default_rng(1).standard_normal(len(dv))
    found = SharpDifference(model, TotalVariation(1e-3))(Observation.of(dv, noise))
    assert 0.6 * len(dv) < found.descent.steps[-1].misfit <= len(dv)
    assert 0.1 < found.alpha < 1000.0
    assert found.image.values[truth > 0].mean() == pytest.approx(0.2, rel=0.2)


def test_l1_leaves_most_cells_alone() -> None:
    mesh = disc(16, 600)
    model = ForwardModel(mesh, Pattern.adjacent(16), 0.01)
    dv = model.jacobian(1.0) @ (0.2 * spot(mesh, radius=0.015))
    noise = 1e-3 * np.abs(dv).max()
    dv += noise * np.random.default_rng(1).standard_normal(len(dv))
    found = SharpDifference(model, Sparse(1e-4), alpha=100.0)(Observation.of(dv, noise))
    smooth = OneStep(model, "identity", alpha=noise * 5.0)(dv)
    values, blurred = np.abs(found.image.values), np.abs(smooth.values)
    assert np.mean(values < 0.01 * values.max()) > 0.8
    assert np.mean(blurred < 0.01 * blurred.max()) < 0.5
    assert np.linalg.norm(mesh.centroids[values.argmax()] - [0.03, 0.02]) < 0.02


@pytest.mark.parametrize("prior", SHARP, ids=lambda prior: type(prior).__name__)
def test_every_step_lowers_the_objective(prior: SharpPrior) -> None:
    mesh = disc()
    model = ForwardModel(mesh, Pattern.adjacent(8), 0.01)
    dv = model.jacobian(1.0) @ (0.2 * spot(mesh))
    found = SharpDifference(model, prior, alpha=3.0)(Observation.of(dv, 1e-3 * np.abs(dv).max()))
    objective = [step.objective for step in found.descent.steps]
    assert (np.diff(objective) < 0).all()
    assert "stopped: the last step lowered" in str(found)


@pytest.mark.parametrize("alpha", [0.0, -1.0, np.nan])
def test_alpha_must_be_positive(alpha: float) -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    with pytest.raises(ModelError, match="expected alpha above 0"):
        SharpDifference(model, TotalVariation(), alpha=alpha)


def test_complex_conductivity() -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    with pytest.raises(ModelError, match="expected one real conductivity per cell"):
        SharpDifference(model, TotalVariation(), alpha=1.0, conductivity=1.0 + 0.1j)
