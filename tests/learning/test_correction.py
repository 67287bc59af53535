"""What labels say of a fit."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import Detection, FloatArray
from tomoskin.learning.touch.calibration_health import FitCorrection

SAID = 0.002
PLACES = np.random.default_rng(1).uniform(-0.08, 0.08, (40, 2))


def detection(x: float, y: float) -> Detection:
    return Detection(x, y, SAID, SAID, 1e-4, -1.0, np.empty(0, dtype=np.int64))


def fitted(deviation: float, seed: int = 2) -> FloatArray:
    return PLACES + deviation * np.random.default_rng(seed).standard_normal(PLACES.shape)


def correction(found: FloatArray, labels: FloatArray = PLACES) -> FitCorrection:
    return FitCorrection.of(found, np.full(len(found), SAID**2), labels)


def test_a_fit_that_is_right_stays_as_it_is() -> None:
    answer = correction(fitted(SAID))
    position, covariance = answer(detection(0.03, 0.01))
    assert position.tolist() == [0.03, 0.01]
    assert np.sqrt(covariance[0, 0]) < 1.3 * SAID


def test_a_turned_and_shifted_skin_file_is_corrected() -> None:
    cos, sin = np.cos(0.3), np.sin(0.3)
    turn = np.array([[cos, -sin], [sin, cos]])
    answer = correction(fitted(SAID), PLACES @ turn.T + 0.01)
    position, _ = answer(detection(0.03, 0.01))
    assert position == pytest.approx(turn @ [0.03, 0.01] + 0.01, abs=0.0015)


def test_what_a_fit_misses_beyond_what_it_says_is_added() -> None:
    _, covariance = correction(fitted(5 * SAID))(detection(0.0, 0.0))
    assert np.sqrt(covariance.diagonal()) == pytest.approx(2 * [5 * SAID], rel=0.3)


def test_a_few_that_were_fitted_elsewhere_do_not_matter() -> None:
    found = fitted(SAID)
    found[::8] = -found[::8]
    position, covariance = correction(found)(detection(0.05, 0.0))
    assert position == pytest.approx([0.05, 0.0], abs=0.002)
    assert np.sqrt(covariance[0, 0]) < 2 * SAID


def test_a_fit_that_finds_few_presses_says_nothing_of_positions() -> None:
    found = fitted(SAID)
    found[:25] = np.nan
    _, covariance = correction(found)(detection(0.0, 0.0))
    assert (covariance.diagonal() > 0.9).all()
