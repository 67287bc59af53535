"""Picard data on a problem whose coefficients are known."""

from __future__ import annotations

import numpy as np
import pytest

from shapes import disc
from tomoskin.imaging import LinearProblem, Spectrum, picard
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern


@pytest.fixture(scope="module", params=["noser", "laplace"])
def spectrum(request: pytest.FixtureRequest) -> Spectrum:
    model = ForwardModel(disc(8), Pattern.adjacent(8), 0.01, current=0.1)
    return Spectrum.of(LinearProblem.of(model, request.param))


def test_smooth_data_have_coefficients_that_fall_as_made(spectrum: Spectrum) -> None:
    sigma = spectrum.singular_values
    beta = np.zeros(40)
    first = int(np.isinf(spectrum.values).sum())
    beta[first : first + len(sigma)] = sigma**2
    told = picard(spectrum, np.linalg.solve(spectrum.analysis, beta))
    assert told.singular_values == pytest.approx(sigma)
    assert told.coefficients == pytest.approx(sigma**2, rel=1e-6, abs=0)
    assert told.solution == pytest.approx(sigma, rel=1e-6, abs=0)
    assert np.isnan(told.noise).all()


def test_noise_is_level_and_told_apart_from_signal(spectrum: Spectrum) -> None:
    sigma = spectrum.singular_values
    beta = np.zeros(40)
    first = int(np.isinf(spectrum.values).sum())
    beta[first : first + 5] = 1e-3
    clean = np.linalg.solve(spectrum.analysis, beta)
    noisy = clean + np.random.default_rng(1).normal(0.0, 1e-5, (50, 40))
    told = picard(spectrum, noisy, np.full(40, 1e-5))
    assert told.noise == pytest.approx(np.full(len(sigma), 1e-5), rel=1e-9, abs=0)
    assert told.coefficients[5:] == pytest.approx(told.noise[5:], rel=0.35, abs=0)
    assert (told.coefficients > 3 * told.noise).sum() == 5
