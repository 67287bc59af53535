"""The Kalman filter over frames, against the textbook's filter of all cells and against theory."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from golden import mismatch
from shapes import disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.imaging import Modes, OneStep, Spectrum, Temporal
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import penalty_of

ALPHA = 0.02
TIMES = np.cumsum([0.1, 0.03, 0.4, 0.1, 0.11, 0.09, 2.0, 0.05])


@cache
def model() -> ForwardModel:
    return ForwardModel(disc(8, 150), Pattern.adjacent(8), 0.01, 0.1)


@cache
def operator(**settings: Any) -> OneStep:
    return OneStep(model(), **{"alpha": ALPHA, **settings})


def filtered(op: OneStep, tau: float) -> Temporal:
    return Temporal(Modes.of(Spectrum.of(op.problem), ALPHA), tau)


def frames(n: int = len(TIMES), seed: int = 0) -> FloatArray:
    """Noise and a spot that moves: data with every mode in them."""
    rng = np.random.default_rng(seed)
    jacobian = operator().problem.jacobian
    walk = np.cumsum(rng.standard_normal((n, jacobian.shape[1])), axis=0)
    return np.asarray(walk @ jacobian.T + 1e-3 * rng.standard_normal((n, 40)))


class Textbook:
    """The same process with the covariance of all cells."""

    def __init__(self, op: OneStep, tau: float) -> None:
        q = penalty_of("noser", op.model.mesh, op.problem.jacobian).matrix
        self.prior, self.tau = np.diag(1.0 / q), tau
        self.j, self.r = op.problem.jacobian, np.diag(ALPHA**2 / op.problem.weights)

    def run(self, data: FloatArray, times: FloatArray) -> FloatArray:
        """Filtered images, (n, n_cells)."""
        x, p = np.zeros(len(self.prior)), self.prior
        means = []
        for k, dv in enumerate(data):
            phi = 0.0 if k == 0 else np.exp(-(times[k] - times[k - 1]) / self.tau)
            x, p = phi * x, phi**2 * p + (1 - phi**2) * self.prior
            gain = np.linalg.solve(self.j @ p @ self.j.T + self.r, self.j @ p).T
            x, p = x + gain @ (dv - self.j @ x), p - gain @ self.j @ p
            means.append(x)
        return np.array(means)


@pytest.mark.parametrize("difference", ["plain", "normalised"])
@pytest.mark.parametrize("tau", [0.05, 0.7])
def test_the_filter_is_the_textbooks(tau: float, difference: str) -> None:
    op = operator(difference=difference)
    temporal = filtered(op, tau)
    got = np.array([temporal.push(dv, t).values for dv, t in zip(frames(), TIMES, strict=True)])
    assert mismatch(got, Textbook(op, tau).run(frames(), TIMES)) < 1e-5  # single precision


@pytest.mark.parametrize("prior", ["noser", "laplace", "gaussian", "identity"])
@pytest.mark.parametrize("tau", [0.0, 1e-4])
def test_without_memory_it_is_the_operator(prior: str, tau: float) -> None:
    op = operator(prior=prior)
    temporal = filtered(op, tau)
    for dv, t in zip(frames(), TIMES, strict=True):
        assert mismatch(temporal.push(dv, t).values, op(dv).values) < 1e-5


def test_a_complex_operator_is_filtered_too() -> None:
    op = OneStep(model(), alpha=ALPHA, conductivity=1.0 + 0.5j)
    data = frames() * (1 - 0.3j)
    assert mismatch(filtered(op, 0.0).push(data[0], 0.0).values, op(data[0]).values) < 1e-5


def test_a_constant_input_converges() -> None:
    temporal, dv = filtered(operator(), 0.5), frames(1)[0]
    images = [temporal.push(dv, 0.1 * k).values for k in range(120)]
    steps = [np.linalg.norm(b - a) for a, b in pairwise(images)]
    assert steps[-1] < 1e-5 * np.linalg.norm(images[-1])
    gain, pole = temporal.steady(0.1)
    expected = temporal.modes.synthesis @ (gain / (1 - pole) * (temporal.modes.analysis @ dv))
    assert mismatch(images[-1], expected) < 1e-5


@given(interval=st.floats(1e-3, 3.0), tau=st.floats(1e-3, 30.0))
def test_the_filter_settles_where_the_steady_one_stands(interval: float, tau: float) -> None:
    temporal, dv = filtered(operator(), tau), np.zeros(40)
    for k in range(600):
        temporal.push(dv, k * interval)
    before = temporal.belief
    assert before is not None
    gain, pole = temporal.steady(interval)
    left = gain * (1 - temporal.modes.trust)
    settled = np.exp(-600 * 2 * interval / tau)  # what may be left of the start
    assert before.variance == pytest.approx(left, rel=1e-6 + 1e3 * settled, abs=1e-12)
    assert (np.abs(pole) < 1).all()


def noise_left(temporal: Temporal) -> FloatArray:
    """(n_cells,) deviation of each cell under white noise, as a part of the operator's."""
    noise = 1.0 / np.sqrt(operator().problem.weights)
    plain = np.linalg.norm(operator().matrix * noise, axis=1)
    return np.asarray(np.linalg.norm(temporal.spread(noise, 0.1), axis=1) / plain)


@pytest.mark.parametrize("tau", [0.05, 0.3, 2.0])
def test_noise_is_reduced_as_theory_says(tau: float) -> None:
    """4000 frames of white noise; frames within τ are not independent, hence 10 %."""
    temporal, rng = filtered(operator(), tau), np.random.default_rng(3)
    noise = rng.standard_normal((4000, 40)) / np.sqrt(operator().problem.weights)
    images = np.array([temporal.push(dv, 0.1 * k).values for k, dv in enumerate(noise)])[200:]
    plain = np.array([operator()(dv).values for dv in noise])[200:]
    measured = np.sqrt(images.var(axis=0).mean() / plain.var(axis=0).mean())
    power = plain.var(axis=0)
    theory = np.sqrt((noise_left(temporal) ** 2 @ power) / power.sum())
    assert measured == pytest.approx(theory, rel=0.1)
    assert theory < 1.0


def test_spread_of_uneven_noise_is_what_a_simulation_finds() -> None:
    """Noise that differs from row to row couples modes; with one mode alone it would not."""
    temporal, rng = filtered(operator(), 0.2), np.random.default_rng(5)
    noise = rng.uniform(0.2, 3.0, 40)
    data = noise * rng.standard_normal((6000, 40))
    images = np.array([temporal.push(dv, 0.1 * k).values for k, dv in enumerate(data)])[100:]
    spread = temporal.spread(noise, 0.1)
    assert np.cov(images.T) == pytest.approx(spread @ spread.T, abs=0.08 * (spread**2).sum(1).max())
    sd = np.linalg.norm(spread, axis=1)
    assert images.std(axis=0) == pytest.approx(sd, rel=0.08)


def test_the_longer_it_remembers_the_quieter_it_is() -> None:
    left = [noise_left(filtered(operator(), tau)).mean() for tau in (0.0, 0.05, 0.5, 5.0)]
    assert left[0] == pytest.approx(1.0)
    assert left[0] > left[1] > left[2] > left[3]


def test_a_touch_shows_at_once_and_noise_does_not() -> None:
    """What memory is for: the strong modes follow, the weak ones wait."""
    mesh, op = model().mesh, OneStep(model(), alpha=0.05)
    spot = (np.linalg.norm(mesh.centroids - (0.03, 0.0), axis=1) < 0.03).astype(float)
    touch = -0.3 * op.problem.jacobian @ spot
    temporal = Temporal(Modes.of(Spectrum.of(op.problem), op.alpha), 0.3)
    for k in range(30):
        temporal.push(np.zeros(40), 0.05 * k)
    first = temporal.push(touch, 1.5).values
    assert first.min() / op(touch).values.min() > 0.5


def test_reset_forgets() -> None:
    temporal = filtered(operator(), 10.0)
    first = temporal.push(frames()[0], 0.0).values
    temporal.push(frames()[1], 1.0)
    temporal.reset()
    assert np.array_equal(temporal.push(frames()[0], 0.5).values, first)


@pytest.mark.parametrize("time", [0.0, -1.0, np.nan, np.inf])
def test_time_must_go_on(time: float) -> None:
    temporal = filtered(operator(), 1.0)
    temporal.push(frames()[0], 0.0)
    before = temporal.belief
    with pytest.raises(DataError, match=r"expected (frames in order of time|a finite time), got"):
        temporal.push(frames()[1], time)
    assert temporal.belief is before


def test_data_that_do_not_fit_leave_the_filter_alone() -> None:
    temporal = filtered(operator(), 1.0)
    temporal.push(frames()[0], 0.0)
    before = temporal.belief
    with pytest.raises(DataError, match=r"rows \[3\] are not"):
        temporal.push(np.where(np.arange(40) == 3, np.nan, 1.0), 1.0)
    with pytest.raises(DataError, match=r"shape \(40,\), got \(39,\)"):
        temporal.push(np.ones(39), 1.0)
    assert temporal.belief is before


@pytest.mark.parametrize("tau", [-1.0, np.nan, np.inf])
def test_an_impossible_time_constant(tau: float) -> None:
    with pytest.raises(ModelError, match="time constant of 0 s or more"):
        filtered(operator(), tau)


@pytest.mark.parametrize("interval", [0.0, -1.0, np.nan, np.inf])
def test_an_impossible_interval(interval: float) -> None:
    with pytest.raises(DataError, match="interval above 0 s"):
        filtered(operator(), 1.0).steady(interval)
