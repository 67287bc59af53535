"""Rate and latency over a bounded window."""

import numpy as np
import pytest

from tomoskin.run.meter import Meter


def test_before_the_first_frame():
    meter = Meter()
    assert np.isnan(meter.latency()).all()
    assert meter.rate(0.0) == 0.0


def test_rate_is_of_the_last_second():
    meter = Meter()
    for k in range(101):
        meter.arrived(0.01 * k)
    assert meter.rate(1.0) == pytest.approx(100)
    assert meter.rate(5.0) == 0.0
    assert meter.frames == 101


def test_latency_forgets_what_is_old():
    meter = Meter(window=10)
    for latency in [9.0] * 50 + [1.0] * 10:
        meter.took(latency)
    assert meter.latency() == (1.0, 1.0)


def test_percentiles():
    meter = Meter(window=101)
    for latency in range(101):
        meter.took(float(latency))
    assert meter.latency() == (50.0, 99.0)
