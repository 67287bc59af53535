"""Figures of merit: images whose figures are known by hand, and properties of real operators."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from golden import SHARED, Golden, mismatch
from shapes import box, disc, mapped
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.extras.greit import Merit, Targets, along, figures
from tomoskin.extras.greit.merit import Balls
from tomoskin.imaging import OneStep, Operator, noise_figure
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

RADIUS = 0.1


@cache
def model(cells: int = 900) -> ForwardModel:
    return ForwardModel(disc(8, cells), Pattern.adjacent(8), 0.01, 0.1)


@cache
def targets() -> Targets:
    places = along(model().mesh, (0.08, 0.0), 9)
    return Targets.simulate(model(3000), places, radius=0.008)


def showing(images: FloatArray) -> Operator:
    """An operator whose image of the k-th unit vector is the k-th of ``images`` (k, n_cells)."""
    matrix = np.zeros((len(model().mesh.cells), 40))
    matrix[:, : len(images)] = images.T
    return Operator(
        model(), matrix, precision=np.eye(40), reference=np.ones(40), difference="plain"
    )


def seen(image: FloatArray, place: tuple[float, float], amount: float = 1.0) -> Merit:
    """Figures of an operator that shows ``image`` for a target at ``place``."""
    dv = np.eye(1, 40)
    one = replace(targets(), places=np.array([place]), amount=np.array([amount]), dv=dv)
    return figures(showing(image[None]), one)


def round_spot(place: tuple[float, float], radius: float) -> FloatArray:
    return Balls(model().mesh).share(np.array(place), radius)


def test_an_ideal_image() -> None:
    spot = round_spot((0.04, 0.0), 0.03)
    amount = float(spot @ model().mesh.volumes)
    found = seen(spot, (0.04, 0.0), amount)
    assert found.distance == pytest.approx([0.04], rel=1e-2)
    assert found.amplitude == pytest.approx([1.0])
    assert abs(found.position_error[0]) < 1e-3
    assert found.offset[0] < 1e-3
    assert found.resolution == pytest.approx([0.3], rel=0.08)  # cells on its edge count
    assert found.deformation[0] < 0.06
    assert found.ringing == pytest.approx([0.0])


def test_a_decrease_is_judged_as_an_increase() -> None:
    spot = round_spot((0.04, 0.0), 0.03)
    both = [seen(sign * spot, (0.03, 0.0), sign * 1e-4) for sign in (1.0, -1.0)]
    for name in ("amplitude", "position_error", "offset", "resolution", "deformation", "ringing"):
        assert getattr(both[0], name) == pytest.approx(getattr(both[1], name)), name


def test_an_image_drawn_inwards_has_a_positive_position_error() -> None:
    inwards = seen(round_spot((0.04, 0.0), 0.02), (0.05, 0.0))
    assert inwards.position_error == pytest.approx([0.01], abs=1e-3)
    sideways = seen(round_spot((0.0, 0.05), 0.02), (0.05, 0.0))
    assert abs(sideways.position_error[0]) < 1e-3
    assert sideways.offset == pytest.approx([0.05 * np.sqrt(2)], abs=1e-3)


def test_a_long_image_is_deformed() -> None:
    """Of a 4:1 rectangle, this part lies outside the disc of its area."""
    x, y = model().mesh.centroids.T
    bar = ((np.abs(x) < 0.06) & (np.abs(y) < 0.015)).astype(float)
    r = np.sqrt(4.0 / np.pi)  # of the disc, for half sides 2 and 1/2
    half = np.arcsin(0.5 / r)
    inside = 2 * (0.5 * np.sqrt(r**2 - 0.25) + r**2 * half)
    assert seen(bar, (0.0, 0.0)).deformation == pytest.approx([1 - inside / 4], abs=0.04)


def test_ringing_is_what_has_the_wrong_sign_outside() -> None:
    mesh = model().mesh
    spot = round_spot((0.0, 0.0), 0.03)
    around = (np.linalg.norm(mesh.centroids, axis=1) > 0.06).astype(float)
    found = seen(spot - 0.05 * around, (0.0, 0.0))
    expected = 0.05 * (around @ mesh.volumes) / (spot @ mesh.volumes)
    assert found.ringing == pytest.approx([expected], rel=0.05)


def test_no_image_has_no_figures() -> None:
    found = seen(-round_spot((0.0, 0.0), 0.03), (0.0, 0.0))
    assert np.isfinite(found.distance).all()
    assert np.isnan([found.amplitude, found.offset, found.resolution, found.ringing]).all()


def test_more_regularisation_blurs_and_quiets() -> None:
    found = [figures(OneStep(model(), alpha=a), targets()) for a in (1e-3, 1e-2, 1e-1)]
    loss = [f.noise_figure for f in found]
    blur = [f.resolution.mean() for f in found]
    assert loss[0] > 1.3 * loss[1] > 1.6 * loss[2]
    assert blur[0] < blur[1] < blur[2]


def test_figures_do_not_depend_on_where_the_sheet_lies() -> None:
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])

    def place(points: FloatArray) -> FloatArray:
        return np.asarray(points @ turn.T + (0.3, -0.1))

    moved = ForwardModel(mapped(model().mesh, place), model().pattern, 0.01, 0.1)
    fine = ForwardModel(mapped(model(3000).mesh, place), model().pattern, 0.01, 0.1)
    there = Targets.simulate(fine, along(moved.mesh, place(np.array([0.08, 0])), 9), radius=0.008)
    a, b = (figures(OneStep(m, alpha=0.01), t) for m, t in ((model(), targets()), (moved, there)))
    assert a.resolution == pytest.approx(b.resolution, rel=1e-6)
    assert a.position_error == pytest.approx(b.position_error, abs=1e-8)
    assert a.ringing == pytest.approx(b.ringing, rel=1e-6)


def test_balls_in_a_volume() -> None:
    line = np.linspace(0, 1, 12)
    body = box(line, line, line)
    share = Balls(body).share(np.array([0.5, 0.5, 0.5]), 0.3)
    assert share @ body.volumes == pytest.approx(4 / 3 * np.pi * 0.027, rel=0.02)


# Targets.


def test_targets_are_what_a_full_solve_gives() -> None:
    mesh = model().mesh
    found = Targets.simulate(
        model(),
        [(0.03, 0.02)],
        radius=0.02,
        contrast=0.5,
        conductivity=2.0,
        difference="normalised",
    )
    share = round_spot((0.03, 0.02), 0.02)
    v0, v = model().solve(2.0).voltages, model().solve(2.0 * (1 + 0.5 * share)).voltages
    assert mismatch(found.dv[0], (v - v0) / np.abs(v0)) < 1e-9
    assert found.amount == pytest.approx([2.0 * 0.5 * share @ mesh.volumes])
    assert found.amount == pytest.approx([np.pi * 0.02**2], rel=0.02)
    assert found.places[0] == pytest.approx([0.03, 0.02], abs=5e-4)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"places": [(0.0, 0.0), (0.2, 0.0)]}, DataError, "target 1: lies outside the sheet"),
        (
            {"places": [0.0, 0.0]},
            DataError,
            r"expected positions of shape \(n, 2\), got shape \(2,\)",
        ),
        ({"places": [(np.nan, 0.0)]}, DataError, "finite positions"),
        ({"radius": 0.0}, ModelError, "radius above 0 m, got 0.0"),
        ({"radius": np.nan}, ModelError, "radius above 0 m"),
        ({"contrast": -1.0}, ModelError, "contrast above -1 and not 0"),
        ({"contrast": 0.0}, ModelError, "contrast above -1 and not 0"),
        ({"difference": "relative"}, ModelError, 'expected difference "plain"'),
        ({"conductivity": 1 + 1j}, ModelError, "expected a real conductivity"),
    ],
)
def test_impossible_targets(settings: dict[str, Any], error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        Targets.simulate(model(), **{"places": [(0.0, 0.0)], "radius": 0.01, **settings})


def test_targets_of_another_pattern_or_difference_are_refused() -> None:
    other = ForwardModel(model().mesh, Pattern.opposite(8), 0.01)
    with pytest.raises(DataError, match="another pattern"):
        figures(OneStep(other, alpha=0.1), targets())
    normalised = OneStep(model(), alpha=0.1, difference="normalised")
    with pytest.raises(DataError, match='takes "normalised" differences, the targets are "plain"'):
        figures(normalised, targets())


# Noise figure.


def test_an_operator_that_changes_nothing_loses_nothing() -> None:
    z = np.random.default_rng(0).standard_normal(30)
    assert noise_figure(np.eye(30), np.full(30, 0.1), z, 3.0) == pytest.approx(1.0)
    assert noise_figure(np.eye(30), np.ones(30), z, np.full(30, 0.1)) == pytest.approx(1.0)


def test_noise_figure_counts_the_noise_that_comes_through() -> None:
    """Against noise that was drawn: 20000 samples tell the deviation to 0.5 %."""
    rng = np.random.default_rng(1)
    matrix, volumes, z = rng.standard_normal((12, 5)), rng.uniform(1, 2, 12), rng.random(5)
    sd = rng.uniform(0.5, 1.5, 5)
    drawn = sd * rng.standard_normal((20_000, 5))
    out = drawn @ (volumes[:, None] * matrix).T
    snr_out = np.abs(volumes * (matrix @ z)).mean() / np.sqrt(out.var(axis=0).mean())
    expected = np.abs(z).mean() / np.sqrt((sd**2).mean()) / snr_out
    assert noise_figure(matrix, volumes, z, sd) == pytest.approx(expected, rel=0.01)


@pytest.mark.data
def test_noise_figure_is_near_that_of_eidors(data_dir: Path) -> None:
    """Indicative only: EIDORS averages in another way."""
    golden = Golden.load(data_dir / SHARED)
    model, mesh = golden.model(), golden.mesh
    sigma = np.ones(len(mesh.cells))
    sigma[golden.fields["nf_tgt_elems"].ravel().astype(int) - 1] = 1.01
    operator = OneStep(model, "noser", alpha=0.1)
    signal = model.solve(sigma).voltages - operator.reference
    expected = float(golden.fields["noise_figure_noser"].item())
    assert noise_figure(operator.matrix, mesh.volumes, signal) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(
    ("signal", "noise", "message"),
    [
        (np.zeros(3), 1.0, "no signal"),
        (np.ones(3), 0.0, "noise above 0"),
        (np.ones(3), -1.0, "noise above 0"),
        (np.ones(3), np.nan, "noise above 0"),
        (np.ones(3), np.ones(2), r"noise of shape \(3,\), got \(2,\)"),
    ],
)
def test_impossible_noise_or_signal(signal: FloatArray, noise: Any, message: str) -> None:
    with pytest.raises(DataError, match=message):
        noise_figure(np.eye(3), np.ones(3), signal, noise)


def test_places_along_a_line() -> None:
    mesh: Mesh = model().mesh
    line = along(mesh, (0.08, 0.0), 5)
    assert line[0] == pytest.approx(mesh.volumes @ mesh.centroids / mesh.volumes.sum())
    assert line[-1].tolist() == [0.08, 0.0]
    with pytest.raises(DataError, match="at least 1 target"):
        along(mesh, (0.08, 0.0), 0)
