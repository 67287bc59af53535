"""Units that are not what they are taken for are noticed, in both directions."""

import numpy as np
import pytest

from tomoskin.learning import MEASURED, TOUCH, Locator, label_unit_doubt, scale_doubt
from tomoskin.model.pattern import Pattern

PATTERN = Pattern.adjacent(8)
UNTOUCHED = np.linspace(0.05, 0.2, PATTERN.n_meas)


def frames(part, n=24, seed=0):
    """Presses that change the voltages by a ``part`` of what the untouched skin reads, V."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.05, 0.05, (n, 2))
    waves = np.random.default_rng(9).normal(scale=30.0, size=(2, PATTERN.n_meas))
    return part * UNTOUCHED * np.sin(xy @ waves), xy


def calibration(part, unit=1.0):
    dv, xy = frames(part)
    return TOUCH.of(Locator.fit(unit * dv, xy, pattern=PATTERN), PATTERN)


@pytest.mark.parametrize("part", [0.003, 0.02, 0.08])
def test_frames_a_thousand_times_larger_or_smaller_than_was_taught_are_said(part):
    dv = frames(part, seed=1)[0]
    assert scale_doubt(calibration(part), dv, UNTOUCHED) is None
    for unit in (1e3, 1e-3):
        doubt = scale_doubt(calibration(part), unit * dv, unit * UNTOUCHED)
        assert "mV instead of V" in doubt
        assert scale_doubt(calibration(part, unit), dv, UNTOUCHED) is not None


def test_differences_alone_are_compared_with_what_was_taught():
    dv = frames(0.02, seed=1)[0]
    assert scale_doubt(calibration(0.02), dv, None) is None
    assert scale_doubt(calibration(0.02), 0.1 * dv, None) is None
    assert scale_doubt(calibration(0.02), 1e3 * dv, None) is not None
    assert scale_doubt(calibration(0.02), 1e-3 * dv, None) is not None


@pytest.mark.parametrize(
    ("name", "values", "word"),
    [
        ("force", [20.0, 50.0, 90.0], "grams"),
        ("force", [0.002, 0.01, 0.02], "kilograms"),
        ("depth", [0.04e-3, 0.06e-3, 0.08e-3], "inches"),
    ],
)
def test_labels_that_no_press_has_are_said(name, values, word):
    doubt = label_unit_doubt(MEASURED[name], np.array([*values, np.nan]))
    assert word in doubt
    assert "--unit" in doubt


def test_labels_of_a_hand_are_not():
    assert label_unit_doubt(MEASURED["force"], np.array([0.5, 2.0, 9.8])) is None
    assert label_unit_doubt(MEASURED["depth"], np.array([1e-3, 3e-3])) is None
    assert label_unit_doubt(MEASURED["depth"], np.array([np.nan])) is None
