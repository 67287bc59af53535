"""What was measured: checked, whitened, and no more values than there are different ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.extras.absolute import Observation

N_MEAS = 6


def combined() -> tuple[np.ndarray, Observation]:
    """Sixteen values of six voltages, and the voltages."""
    rng = np.random.default_rng(0)
    voltages, combine = rng.standard_normal(N_MEAS), rng.standard_normal((16, N_MEAS))
    noise = rng.uniform(0.1, 1.0, 16)
    return voltages, Observation.of(combine @ voltages + 0.1 * noise, noise, combine)


def test_plain_values_are_divided_by_their_noise() -> None:
    noise = np.array([1.0, 2.0, np.inf, 4.0, 5.0, 6.0])
    seen = Observation.of(np.r_[1.0, 2.0, np.nan, 4.0, 5.0, 6.0], noise).whitened(N_MEAS)
    assert seen.target == pytest.approx(np.ones(5))
    voltages = np.arange(6.0)
    assert seen.rows @ voltages == pytest.approx((voltages / noise)[[0, 1, 3, 4, 5]])


def test_combinations_keep_their_sum_of_squares() -> None:
    voltages, observation = combined()
    seen = observation.whitened(N_MEAS)
    assert len(seen.target) == 6
    assert observation.combine is not None
    left_over = []
    for guess in (voltages, np.zeros(N_MEAS), np.ones(N_MEAS)):
        residual = (observation.values - observation.combine @ guess) / observation.noise
        shorter = seen.target - seen.rows @ guess
        left_over.append(residual @ residual - shorter @ shorter)  # what no voltages explain
    assert left_over == pytest.approx(3 * left_over[:1])


def test_a_row_that_does_not_count_is_as_if_it_were_not_there() -> None:
    _, observation = combined()
    assert observation.combine is not None
    noise = observation.noise.copy()
    noise[[3, 7]] = np.inf
    kept = np.isfinite(noise)
    one = Observation.of(observation.values, noise, observation.combine).whitened(N_MEAS)
    other = Observation.of(
        observation.values[kept], noise[kept], observation.combine[kept]
    ).whitened(N_MEAS)
    assert one.rows.T @ one.target == pytest.approx(other.rows.T @ other.target)


@pytest.mark.parametrize(
    ("values", "noise", "combine", "message"),
    [
        (np.ones((2, 3)), 1.0, None, r"expected values of shape \(n,\), got \(2, 3\)"),
        (np.ones(3), np.ones(2), None, r"expected one noise or 3, got shape \(2,\)"),
        (np.ones(3), [1.0, 0.0, 1.0], None, r"row 1: expected noise above 0, got 0.0"),
        (np.ones(3), [1.0, np.nan, 1.0], None, r"row 1: expected noise above 0, got nan"),
        ([1.0, np.nan, np.inf], 1.0, None, r"rows \[1, 2\] are not"),
        (np.ones(3), np.inf, None, "at least one row with finite noise"),
        (["a", "b"], 1.0, None, "values: expected real numbers, got <U1"),
        (np.ones(2) + 1j, 1.0, None, "values: expected real numbers, got complex128"),
        ([[1.0], [1.0, 2.0]], 1.0, None, "values: expected rows of equal length"),
        (np.ones(3), "loud", None, "noise: expected real numbers"),
        (np.ones(3), 1.0, np.ones((2, 3)), r"expected combine of shape \(3, n\), got \(2, 3\)"),
    ],
)
def test_refused(values: Any, noise: Any, combine: Any, message: str) -> None:
    with pytest.raises(DataError, match=message):
        Observation.of(values, noise, combine)


def test_of_another_pattern() -> None:
    with pytest.raises(DataError, match="expected an observation of 7 voltages, got one of 6"):
        combined()[1].whitened(7)
    with pytest.raises(DataError, match="expected an observation of 7 voltages, got one of 6"):
        Observation.of(np.ones(6), 1.0).whitened(7)
