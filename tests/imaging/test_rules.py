"""Rules on problems whose best alpha is known, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.imaging import (
    RULES,
    AlphaChoice,
    LightTouch,
    LinearProblem,
    Spectrum,
    choose,
    for_recording,
    noise_figure,
)
from tomoskin.imaging.choice import by_noise_figure, in_the_middle, where_it_falls
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

SIGMA = 1e-5
NOISE = np.full(208, SIGMA)


@cache
def spectrum(prior: str = "noser", kind: str = "plain") -> Spectrum:
    model = ForwardModel(disc(16, 500, width=0.015), Pattern.adjacent(16), 0.01, current=0.1)
    return Spectrum.of(LinearProblem.of(model, prior, difference=kind))


def touches(count: int = 24, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Noisy data of small touches, and where they are."""
    problem = spectrum().problem
    mesh, rng = problem.model.mesh, np.random.default_rng(seed)
    radius, angle = 0.07 * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(0, 2 * np.pi, count)
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    near = np.linalg.norm(mesh.centroids[:, None] - places, axis=2) < 0.012
    frames = (problem.jacobian @ np.where(near, -0.2, 0.0)).T
    return frames + rng.normal(0.0, SIGMA, frames.shape), places


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_says_what_it_chose_and_from_which_curve(rule: str) -> None:
    choice = choose(spectrum(), rule, NOISE)
    assert choice.rule == rule
    assert choice.reason
    curve = choice.curve
    assert curve is not None
    assert len(curve.x) == len(curve.y) > 10
    assert np.isfinite(curve.y).all()
    assert 0 <= curve.chosen < len(curve.x)
    assert curve.x[curve.chosen] == pytest.approx(choice.alpha, rel=0.5)


@pytest.mark.parametrize("prior", ["noser", "laplace"])
def test_model_error_rests_on_neither_the_mesh_nor_repeated_rows(prior: str) -> None:
    """Where rows stand twice, alpha² doubles with what they tell: the image is the same."""
    problem = spectrum(prior).problem
    twice = replace(
        problem,
        jacobian=np.vstack(2 * [problem.jacobian]),
        weights=np.tile(problem.weights, 2),
        reference=np.tile(problem.reference, 2),
    )
    one, two = (choose(Spectrum.of(p), "model-error") for p in (problem, twice))
    assert two.alpha == pytest.approx(np.sqrt(2) * one.alpha, rel=1e-3)
    model = ForwardModel(disc(16, 1200, width=0.015), Pattern.adjacent(16), 0.01, current=0.1)
    fine = choose(Spectrum.of(LinearProblem.of(model, "noser")), "model-error")
    coarse = choose(spectrum(), "model-error")
    assert fine.alpha == pytest.approx(coarse.alpha, rel=0.03)


def test_a_recording_is_trusted_by_its_noise_but_never_more_than_a_model_can_be() -> None:
    """Noise as large as the model's error in each measurement adds to it as its square does."""
    s, (frames, _) = spectrum(), touches(1)
    least = choose(s, "model-error").alpha
    size = float(np.linalg.norm(frames[0]))
    noise = np.full(len(s.values), 0.01 * size / np.sqrt(1.0 + 1e-4 * len(s.values)))
    known = for_recording(s, noise, np.vstack([0 * frames, frames]))
    assert known.alpha == pytest.approx(np.sqrt(2.0) * least, rel=1e-3)
    assert "noise of its idle frames is 1 %" in known.reason
    assert for_recording(s, 1e-9 * noise, frames).alpha == pytest.approx(least)
    unknown = for_recording(s, None, frames)
    assert (unknown.rule, unknown.alpha) == ("model-error", least)
    assert "no idle frames" in unknown.reason
    lost = for_recording(s, 100 * noise, frames).alpha  # nothing but noise in them
    assert lost == pytest.approx(least * 100 * np.hypot(0.01, len(s.values) ** -0.5), rel=1e-3)


def test_noise_figure_falls_with_alpha_and_is_the_one_aimed_at() -> None:
    s = spectrum()
    volumes = s.problem.model.mesh.volumes
    change = s.problem.jacobian @ in_the_middle(s)
    alphas = np.geomspace(1e-3, 0.3, 8) * s.singular_values[0]
    figures = [noise_figure(s.operator(float(a)).matrix, volumes, change) for a in alphas]
    assert (np.diff(figures) < 0).all()
    for target in (0.5, 1.0, 2.0):
        choice = by_noise_figure(s, None, target)
        got = noise_figure(s.operator(choice.alpha).matrix, volumes, change)
        assert got == pytest.approx(target, rel=1e-4)


def test_noise_figure_that_no_alpha_has() -> None:
    with pytest.raises(ModelError, match=r"noise figure stays above 0.001.*larger"):
        by_noise_figure(spectrum(), None, 1e-3)


def test_noise_figure_is_taken_where_it_falls_not_where_it_rises_again() -> None:
    s = spectrum("noser", "normalised")
    volumes = s.problem.model.mesh.volumes
    change = s.problem.jacobian @ in_the_middle(s)
    figures = [noise_figure(s.operator(float(a)).matrix, volumes, change) for a in s.alphas[::8]]
    turn, target = int(np.argmin(figures)), 0.5 * (min(figures) + figures[-1])
    assert figures[-1] > 1.2 * min(figures)  # it does rise again, far beyond the target
    choice = by_noise_figure(s, None, target)
    assert choice.alpha < s.alphas[8 * turn]
    got = noise_figure(s.operator(choice.alpha).matrix, volumes, change)
    assert got == pytest.approx(target, rel=1e-4)
    with pytest.raises(ModelError, match=r"stays above .*larger noise figure, or another"):
        by_noise_figure(s, None, 0.9 * min(figures))


def test_a_figure_that_only_rises_to_the_level_is_not_taken() -> None:
    """From 0 up to 1 and never down: the end of the range is not where it falls to 1/2."""
    s = spectrum()
    middle = float(np.median(s.alphas))

    def fallen(quantity: Callable[[float], float]) -> AlphaChoice:
        return where_it_falls(s.alphas[::8], quantity, 0.5, "")

    with pytest.raises(ModelError, match=r"starts below 0.5: .*smaller"):
        fallen(lambda alpha: alpha / (alpha + middle))
    found = fallen(lambda alpha: middle / (alpha + middle))
    assert found.alpha == pytest.approx(middle)


@pytest.mark.parametrize("prior", ["noser", "laplace"])
@pytest.mark.parametrize("kind", ["plain", "normalised"])
def test_light_touch_weighs_blur_against_noise_as_a_simulation_does(prior: str, kind: str) -> None:
    s = spectrum(prior, kind)
    noise = np.full(len(s.values), SIGMA)
    if kind == "normalised":
        noise = noise / np.abs(s.problem.reference)
    choice = LightTouch.of(s)(noise)
    simulated = simulated_errors(s, noise, choice)
    at = len(simulated) // 2
    assert choice.curve is not None
    assert simulated[at] == pytest.approx(choice.curve.y[choice.curve.chosen], rel=0.03)
    assert simulated[at] < min(simulated[0], simulated[-1])


def simulated_errors(s: Spectrum, noise: FloatArray, choice: AlphaChoice) -> list[float]:
    """Mean square error of the image of touches with drawn noise, around the chosen alpha."""
    mesh, rng = s.problem.model.mesh, np.random.default_rng(3)
    radius = 0.055 * np.sqrt(mesh.volumes.sum())
    inside = np.flatnonzero(np.hypot(*mesh.centroids.T) < 0.1 - radius)
    near = np.linalg.norm(mesh.centroids[:, None] - mesh.centroids[inside], axis=2) <= radius
    truth = np.where(near, 0.25, 0.0)
    data = s.problem.jacobian @ truth
    data = data + noise[:, None] * rng.standard_normal(data.shape)
    errors = []
    for factor in (0.25, 1.0, 4.0):
        wrong = s.operator(factor * choice.alpha).matrix @ data - truth
        errors.append(float(np.mean(mesh.volumes @ wrong**2 / (mesh.volumes @ truth**2))))
    return errors


def test_light_touch_trusts_better_data_more() -> None:
    touch = LightTouch.of(spectrum())
    noise = np.full(len(spectrum().values), SIGMA)
    chosen = [touch(factor * noise).alpha for factor in (0.1, 1.0, 10.0)]
    assert chosen[0] < chosen[1] < chosen[2]


@pytest.mark.parametrize(
    ("noise", "message"),
    [
        (None, "the noise of the measurements is missing"),
        (np.zeros(208), "expected finite noise above 0"),
        (np.full(208, -1.0), "expected finite noise above 0"),
        (np.r_[np.ones(207), np.nan], "expected finite noise above 0"),
        (np.ones(40), r"noise of shape \(208,\), got \(40,\)"),
    ],
)
def test_noise_that_is_missing_or_wrong(noise: FloatArray | None, message: str) -> None:
    with pytest.raises(DataError, match=message):
        choose(spectrum(), "light-touch", noise)


def test_an_unknown_rule_is_answered_with_the_names() -> None:
    with pytest.raises(ModelError, match=r'light-touch, .*noise-figure, got "elbow"'):
        choose(spectrum(), "elbow")
