"""Rules on problems whose best alpha is known, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from shapes import disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.imaging import (
    RULES,
    AlphaChoice,
    Evidence,
    LightTouch,
    LinearProblem,
    Spectrum,
    choose,
    for_recording,
    noise_figure,
)
from tomoskin.imaging.choice.alpha_choice import crossing
from tomoskin.imaging.choice.criteria import by_noise_figure, corner, in_the_middle
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

SIGMA = 1e-5


@cache
def spectrum(prior: str = "noser", kind: str = "plain") -> Spectrum:
    model = ForwardModel(disc(16, 500, width=0.015), Pattern.adjacent(16), 0.01, current=0.1)
    return Spectrum.of(LinearProblem.of(model, prior, difference=kind))


def drawn(tau: float, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Noise-free and noisy data of images that come from the prior N(0, τ²Q⁻¹)."""
    s, rng = spectrum(), np.random.default_rng(seed)
    beta = tau * np.sqrt(s.values) * rng.standard_normal((count, len(s.values)))
    clean = np.linalg.solve(s.analysis, beta.T).T
    return clean, clean + rng.normal(0.0, SIGMA, clean.shape)


def touches(count: int = 24, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Noisy data of small touches, and where they are."""
    problem = spectrum().problem
    mesh, rng = problem.model.mesh, np.random.default_rng(seed)
    radius, angle = 0.07 * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(0, 2 * np.pi, count)
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    near = np.linalg.norm(mesh.centroids[:, None] - places, axis=2) < 0.012
    frames = (problem.jacobian @ np.where(near, -0.2, 0.0)).T
    return frames + rng.normal(0.0, SIGMA, frames.shape), places


def lowest(image: FloatArray) -> FloatArray:
    """The place of the lowest value."""
    return spectrum().problem.model.mesh.centroids[[int(image.argmin())]]


def evidence() -> Evidence:
    frames, places = touches()
    return Evidence(np.full(len(frames[0]), SIGMA), frames, places, lowest)


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_says_what_it_chose_and_from_which_curve(rule: str) -> None:
    choice = choose(spectrum(), rule, evidence())
    assert choice.rule == rule
    assert choice.reason
    curve = choice.curve
    assert curve is not None
    assert len(curve.x) == len(curve.y) > 10
    assert np.isfinite(curve.y).all()
    assert 0 <= curve.chosen < len(curve.x)
    if curve.x_label == "alpha":
        assert curve.x[curve.chosen] == pytest.approx(choice.alpha, rel=0.5)


@given(seed=st.integers(0, 1000), tau=st.floats(0.005, 0.5))
@settings(max_examples=20)
def test_discrepancy_leaves_a_residual_as_large_as_the_noise(seed: int, tau: float) -> None:
    _, noisy = drawn(tau, 3, seed)
    s = spectrum()
    choice = choose(s, "discrepancy", Evidence(np.full(len(noisy[0]), SIGMA), noisy))
    level = SIGMA * np.sqrt(len(noisy[0]))
    assert np.sqrt(np.mean(s.residual(choice.alpha, noisy) ** 2)) == pytest.approx(level, rel=1e-6)


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
    one, two = (choose(Spectrum.of(p), "model-error", Evidence()) for p in (problem, twice))
    assert two.alpha == pytest.approx(np.sqrt(2) * one.alpha, rel=1e-3)
    model = ForwardModel(disc(16, 1200, width=0.015), Pattern.adjacent(16), 0.01, current=0.1)
    fine = choose(Spectrum.of(LinearProblem.of(model, "noser")), "model-error", Evidence())
    coarse = choose(spectrum(), "model-error", Evidence())
    assert fine.alpha == pytest.approx(coarse.alpha, rel=0.03)


def test_a_recording_is_trusted_by_its_noise_but_never_more_than_a_model_can_be() -> None:
    """Noise as large as the model's error in each measurement adds to it as its square does."""
    s, (frames, _) = spectrum(), touches(1)
    least = choose(s, "model-error", Evidence()).alpha
    size = float(np.linalg.norm(frames[0]))
    noise = np.full(len(s.values), 0.01 * size / np.sqrt(1.0 + 1e-4 * len(s.values)))
    known = for_recording(s, Evidence(noise, np.vstack([0 * frames, frames])))
    assert known.alpha == pytest.approx(np.sqrt(2.0) * least, rel=1e-3)
    assert "noise of its idle frames is 1 %" in known.reason
    assert for_recording(s, Evidence(1e-9 * noise, frames)).alpha == pytest.approx(least)
    unknown = for_recording(s, Evidence())
    assert (unknown.rule, unknown.alpha) == ("model-error", least)
    assert "no idle frames" in unknown.reason
    lost = for_recording(s, Evidence(100 * noise, frames)).alpha  # nothing but noise in them
    assert lost == pytest.approx(least * 100 * np.hypot(0.01, len(s.values) ** -0.5), rel=1e-3)


@given(seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_l_curve_bends_where_noise_takes_over(seed: int) -> None:
    """Coefficients fall as σ^1.5 (Picard), with noise: the image errs least near the corner."""
    s, rng = spectrum(), np.random.default_rng(seed)
    root = np.sqrt(s.values)
    noisy = 0.01 * root**1.5 + rng.normal(0.0, SIGMA, len(root))
    frame = np.linalg.solve(s.analysis, noisy)

    def wrong(alpha: float) -> float:
        return float(np.linalg.norm(root * s.gains(alpha) * noisy - 0.01 * root**0.5))

    best = float(min(s.alphas, key=lambda a: wrong(float(a))))
    assert 0.4 < choose(s, "l-curve", Evidence(frames=frame[None])).alpha / best < 1.2


@given(st.floats(0.4, 3.0))
def test_corner_of_a_curve_that_is_its_own_mirror_image(power: float) -> None:
    t = np.linspace(-8, 8, 401)
    assert t[corner(t, np.log1p(np.exp(power * t)), np.log1p(np.exp(-power * t)))] == pytest.approx(
        0.0, abs=0.05
    )


@pytest.mark.parametrize("bend", [0.0, -0.3])
def test_a_line_and_an_arch_have_no_corner(bend: float) -> None:
    t = np.linspace(-3, 3, 101)
    with pytest.raises(ModelError, match="no corner"):
        corner(t, t, -t + bend * t**2)


def test_noise_figure_falls_with_alpha_and_is_the_one_aimed_at() -> None:
    s = spectrum()
    volumes = s.problem.model.mesh.volumes
    change = s.problem.jacobian @ in_the_middle(s)
    alphas = np.geomspace(1e-3, 0.3, 8) * s.singular_values[0]
    figures = [noise_figure(s.operator(float(a)).matrix, volumes, change) for a in alphas]
    assert (np.diff(figures) < 0).all()
    for target in (0.5, 1.0, 2.0):
        choice = by_noise_figure(s, Evidence(), target)
        got = noise_figure(s.operator(choice.alpha).matrix, volumes, change)
        assert got == pytest.approx(target, rel=1e-4)


def test_noise_figure_that_no_alpha_has() -> None:
    with pytest.raises(ModelError, match=r"noise figure stays above 0.001.*larger"):
        by_noise_figure(spectrum(), Evidence(), 1e-3)


def test_noise_figure_is_taken_where_it_falls_not_where_it_rises_again() -> None:
    s = spectrum("noser", "normalised")
    volumes = s.problem.model.mesh.volumes
    change = s.problem.jacobian @ in_the_middle(s)
    figures = [noise_figure(s.operator(float(a)).matrix, volumes, change) for a in s.alphas[::8]]
    turn, target = int(np.argmin(figures)), 0.5 * (min(figures) + figures[-1])
    assert figures[-1] > 1.2 * min(figures)  # it does rise again, far beyond the target
    choice = by_noise_figure(s, Evidence(), target)
    assert choice.alpha < s.alphas[8 * turn]
    got = noise_figure(s.operator(choice.alpha).matrix, volumes, change)
    assert got == pytest.approx(target, rel=1e-4)
    with pytest.raises(ModelError, match=r"stays above .*larger noise figure, or another"):
        by_noise_figure(s, Evidence(), 0.9 * min(figures))


def test_a_figure_that_only_rises_to_the_level_is_not_taken() -> None:
    """From 0 up to 1 and never down: the end of the range is not where it falls to 1/2."""
    s = spectrum()
    middle = float(np.median(s.alphas))

    def fallen(quantity: Callable[[float], float]) -> AlphaChoice:
        words: dict[str, Any] = {"rule": "noise-figure", "reason": "", "label": "noise figure"}
        return crossing(s, quantity, 0.5, rising=False, hints=("larger", "smaller"), **words)

    with pytest.raises(ModelError, match=r"starts below 0.5: .*smaller"):
        fallen(lambda alpha: alpha / (alpha + middle))
    found = fallen(lambda alpha: middle / (alpha + middle))
    assert found.alpha == pytest.approx(middle)


def test_discrepancy_where_noise_is_all_there_is_or_far_too_small() -> None:
    frames, _ = touches()
    n = len(frames[0])
    with pytest.raises(ModelError, match=r"stays below 1.*little more than noise"):
        choose(spectrum(), "discrepancy", Evidence(np.full(n, 1.0), frames))
    with pytest.raises(ModelError, match=r"stays above 1.*does not explain"):
        choose(spectrum(), "discrepancy", Evidence(np.full(n, 1e-9), frames))


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


def test_labelled_presses_choose_the_alpha_that_finds_them() -> None:
    s, known = spectrum(), evidence()
    choice = choose(s, "labelled", known)
    frames, places = touches(60, seed=9)

    def error(alpha: float) -> float:
        images = frames @ s.operator(alpha).matrix.T
        found = np.array([lowest(image)[0] for image in images])
        return float(np.linalg.norm(found - places, axis=1).mean())

    assert error(choice.alpha) < 1.25 * min(error(float(a)) for a in s.alphas[::20])
    assert "24 labelled presses" in choice.reason


def test_frames_that_are_zero_and_presses_without_a_place_do_not_count() -> None:
    known = evidence()
    assert known.frames is not None
    assert known.places is not None
    frames = np.vstack([np.zeros_like(known.frames[:1]), known.frames, known.frames[:1]])
    places = np.vstack([[[0.0, 0.0]], known.places, [[np.nan, np.nan]]])
    more = replace(known, frames=frames, places=places)
    for rule in ("labelled", "light-touch"):
        assert choose(spectrum(), rule, more).alpha == choose(spectrum(), rule, known).alpha


@pytest.mark.parametrize(
    ("rule", "changes", "message"),
    [
        ("light-touch", {"noise": None}, "the noise of the measurements is missing"),
        ("light-touch", {"noise": np.zeros(208)}, "expected noise above 0"),
        ("light-touch", {"noise": np.full(208, -1.0)}, "expected noise above 0"),
        ("light-touch", {"noise": np.r_[np.ones(207), np.nan]}, "noise, row 207: .* got nan"),
        ("light-touch", {"noise": np.ones(40)}, r"noise of shape \(208,\), got \(40,\)"),
        ("discrepancy", {"noise": None}, "the noise of the measurements is missing"),
        ("l-curve", {"frames": None}, "no frame of a touched skin"),
        ("l-curve", {"frames": np.zeros((0, 208))}, "no frame of a touched skin"),
        ("l-curve", {"frames": np.zeros((2, 208))}, "are all zero"),
        ("l-curve", {"frames": np.ones((2, 40))}, r"frames of shape \(n, 208\), got \(2, 40\)"),
        ("l-curve", {"frames": np.full((1, 208), np.inf)}, "data, row 0: .* got inf"),
        ("l-curve", {"frames": np.ones((1, 208), complex)}, "expected real difference data"),
        ("labelled", {"places": None}, "no frame has a label that says where"),
        (
            "labelled",
            {"places": np.zeros((3, 2))},
            r"expected positions of shape \(24, 2\), got \(3, 2\)",
        ),
        ("labelled", {"places": np.full((24, 2), np.nan)}, "at least two labelled presses, got 0"),
        ("labelled", {"locate": None}, "the method that finds touches"),
    ],
)
def test_evidence_that_is_missing_or_wrong(
    rule: str, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(DataError, match=message):
        choose(spectrum(), rule, replace(evidence(), **changes))


def test_an_unknown_rule_is_answered_with_the_names() -> None:
    with pytest.raises(ModelError, match=r'light-touch, .*labelled, got "elbow"'):
        choose(spectrum(), "elbow", evidence())
