"""The trained operator: what it minimises, what it promises, and how it compares."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from golden import mismatch
from shapes import box, disc, patched
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.extras.greit import Greit, Merit, Targets, along, figures
from tomoskin.extras.greit.merit import Balls
from tomoskin.extras.greit.trainer import DESIRED_RADIUS
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import ElectrodeArc, Mesh, Rectangle, triangulate
from tomoskin.model.pattern import Pattern


@cache
def model(cells: int = 500, n: int = 8) -> ForwardModel:
    return ForwardModel(disc(n, cells), Pattern.adjacent(n), 0.01, 0.1)


@cache
def greit(**settings: Any) -> Greit:
    return Greit(model(), **{"simulated_on": model(1500), "count": 200, **settings})


@cache
def targets() -> Targets:
    """On a mesh that neither operator has seen."""
    places = along(model().mesh, (0.08, 0.0), 9)
    return Targets.simulate(model(2600), places, radius=0.006)


def noser(figure: float) -> Merit:
    """NOSER at that noise figure."""

    def excess(decade: float) -> float:
        return figures(OneStep(model(), alpha=10.0**decade), targets()).noise_figure - figure

    return figures(OneStep(model(), alpha=10.0 ** brentq(excess, -2.5, 2.0, xtol=1e-3)), targets())


def test_each_row_is_the_least_squares_solution() -> None:
    """Against the normal equations of single cells, set up from the desired images alone."""
    operator = greit(noise_figure=1.1)
    mesh, training = model().mesh, operator.training
    y = (training.dv / training.amount[:, None]).T
    noise = np.full(len(y), np.sqrt((y**2).mean() * y.shape[1]))
    extent = np.ptp(mesh.points, axis=0).max()
    spot = np.array([Balls(mesh).share(p, DESIRED_RADIUS * extent) for p in training.places])
    wanted = spot / (spot @ mesh.volumes)[:, None]
    system = y @ y.T + operator.noise_weight * np.diag(noise**2)
    for cell in (0, 77, len(mesh.cells) - 1):
        goal = y @ wanted[:, cell]
        assert mismatch(operator.matrix[cell], np.linalg.solve(system, goal)) < 1e-6


@pytest.mark.parametrize("figure", [1.0, 2.0])
def test_it_has_the_noise_figure_that_was_asked_for(figure: float) -> None:
    operator = greit(noise_figure=figure)
    middle = np.linalg.norm(operator.training.places, axis=1).argmin()
    one = along(model().mesh, operator.training.places[middle], 1)
    found = figures(operator, Targets.simulate(model(2600), one, radius=0.006))
    assert found.noise_figure == pytest.approx(figure, rel=0.03)


def test_it_beats_noser_at_equal_noise_along_a_radius() -> None:
    """In position, ringing and evenness of amplitude; not in resolution, which it gives for it."""
    operator = greit(noise_figure=1.0)
    found = figures(operator, targets())
    other = noser(found.noise_figure)
    assert other.noise_figure == pytest.approx(found.noise_figure, rel=0.01)
    assert found.offset.mean() < 0.8 * other.offset.mean()
    assert found.ringing.mean() < other.ringing.mean()
    assert found.amplitude == pytest.approx(np.ones(9), abs=0.4)
    assert found.resolution.mean() < 1.25 * other.resolution.mean()


def test_a_square_skin() -> None:
    outline = Rectangle(0.2, 0.2)
    middles = (np.arange(16) + 0.5) / 16 * outline.length
    arcs = [ElectrodeArc.around(float(c), 0.02) for c in middles]
    coarse, fine = (
        ForwardModel(triangulate(outline, arcs, n), Pattern.adjacent(16), 0.01, 0.1)
        for n in (500, 1500)
    )
    operator = Greit(coarse, simulated_on=fine, count=200, difference="normalised")
    places = np.array([(0.0, 0.0), (0.05, 0.05), (-0.07, 0.02), (0.0, -0.06)])
    shown = Targets.simulate(fine, places, radius=0.01, difference="normalised")
    found = figures(operator, shown)
    assert found.offset.max() < 0.01
    assert found.amplitude == pytest.approx(np.ones(4), abs=0.3)


def test_a_volume() -> None:
    line = np.linspace(0, 0.1, 7)
    body = box(line, line, line)
    sides = [lambda p, a=a, e=e: p[:, a] == e for a in range(3) for e in (0.0, 0.1)]
    body = patched(body, *sides)
    inner = ForwardModel(body, Pattern.all_pairs(6), 0.01, 0.1)
    operator = Greit(inner, count=60, noise_figure=0.8)
    assert operator.unit == "S/m"
    place = body.centroids[np.linalg.norm(body.centroids - 0.05, axis=1).argmin()]
    found = figures(operator, Targets.simulate(inner, [place], radius=0.02))
    assert found.offset[0] < 0.02


def test_noise_that_is_not_alike_counts_less() -> None:
    """Rows that are all noise are hardly used."""
    noise = np.where(np.arange(40) % 5 == 0, 100.0, 1.0)
    operator = Greit(model(), simulated_on=model(1500), count=200, noise=noise, noise_figure=0.1)
    size = np.linalg.norm(operator.matrix, axis=0)
    assert size[noise > 1].max() < 0.1 * size[noise == 1].mean()


def test_rows_left_out_do_not_count() -> None:
    operator, dv = greit(), targets().dv[3]
    less = operator.without([4, 11])
    broken = dv.copy()
    broken[[4, 11]] = np.nan
    assert mismatch(less(broken).values, operator(dv).values) < 0.2


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"noise_figure": 0.0}, "noise figure above 0, got 0"),
        ({"noise_figure": 1e-3}, r"expected a noise figure from \S+ to \S+, got 0.001"),
        ({"count": 5}, "expected 10 to [0-9]+ training targets, got 5"),
        ({"count": 10**6}, "training targets, got 1000000"),
        ({"noise": np.ones(3)}, r"expected noise of shape \(40,\), got \(3,\)"),
        ({"noise": 0.0}, "expected finite noise above 0"),
        ({"difference": "relative"}, 'expected difference "plain"'),
        ({"conductivity": -1.0}, "positive finite conductivity"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Greit(model(), **{"count": 50, **settings})


def test_training_targets_of_another_pattern() -> None:
    other = ForwardModel(model().mesh, Pattern.opposite(8), 0.01)
    with pytest.raises(ModelError, match="same pattern"):
        Greit(model(), simulated_on=other)


def test_data_of_another_length() -> None:
    with pytest.raises(DataError, match=r"shape \(40,\), got \(39,\)"):
        greit()(np.zeros(39))


def test_its_image_belongs_to_its_mesh() -> None:
    mesh: Mesh = model().mesh
    values: FloatArray = greit()(targets().dv[0]).values
    assert greit()(targets().dv[0]).mesh_id == mesh.identity
    assert values.shape == (len(mesh.cells),)
