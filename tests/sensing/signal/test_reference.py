"""The reference and the noise of an idle skin."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.sensing.signal import Reference


def test_mean_and_noise_of_idle_frames() -> None:
    rng = np.random.default_rng(1)
    true = np.geomspace(1e-6, 1.5e-6, 40)
    level = np.linspace(1e-3, 5e-3, 40)
    n = 2000
    reference = Reference.of(level + true * rng.standard_normal((n, 40)))
    assert reference.n_frames == n
    assert reference.noise_is_known
    # standard errors: sd/√n of the mean, sd/√(2(n−1)) of the deviation
    assert (np.abs(reference.mean - level) < 4.5 * true / np.sqrt(n)).all()
    assert (np.abs(reference.noise - true) < 4.5 * true / np.sqrt(2 * (n - 1))).all()


def test_noise_is_unbiased_for_few_frames() -> None:
    """The divisor is n − 1: variances of three frames average to the true one."""
    rng = np.random.default_rng(2)
    variances = [Reference.of(rng.standard_normal((3, 1))).noise[0] ** 2 for _ in range(4000)]
    assert np.mean(variances) == pytest.approx(1.0, abs=4.5 / np.sqrt(4000))


def test_a_channel_is_never_taken_for_silent() -> None:
    """Three equal counts in a row say little about a channel's noise."""
    values = np.random.default_rng(3).standard_normal((3, 9))
    values[:, 4] = 0.7
    noise = Reference.of(values).noise
    assert noise[4] == 0.5 * np.median(values.std(axis=0, ddof=1))
    assert noise[4] > 0


def test_noise_of_one_frame_is_not_known() -> None:
    reference = Reference.of(np.ones((1, 5)))
    assert not reference.noise_is_known
    assert np.isnan(reference.noise).all()
    assert reference.mean.tolist() == [1.0] * 5


@pytest.mark.parametrize("shape", [(0, 5), (5,), (2, 3, 4)])
def test_no_frames(shape: tuple[int, ...]) -> None:
    with pytest.raises(DataError, match="expected frames"):
        Reference.of(np.ones(shape))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_frame_that_is_not_finite_is_named(value: float) -> None:
    values = np.ones((4, 5))
    values[2, 3] = value
    with pytest.raises(DataError, match="expected finite voltages") as caught:
        Reference.of(values)
    assert caught.value.where == "reference frame 2, row 3"
