"""Rate and latency over a bounded window."""

import numpy as np
import pytest

from tomoskin.run.counters import FrameCounter


def test_before_the_first_frame():
    counter = FrameCounter()
    assert np.isnan(counter.latency()).all()
    assert counter.rate(0.0) == 0.0


def test_rate_is_of_the_last_second():
    counter = FrameCounter()
    for k in range(101):
        counter.add_arrival(0.01 * k)
    assert counter.rate(1.0) == pytest.approx(100)
    assert counter.rate(5.0) == 0.0
    assert counter.frames == 101


def test_latency_forgets_what_is_old():
    counter = FrameCounter(window=10)
    for latency in [9.0] * 50 + [1.0] * 10:
        counter.add_latency(latency)
    assert counter.latency() == (1.0, 1.0)


def test_percentiles():
    counter = FrameCounter(window=101)
    for latency in range(101):
        counter.add_latency(float(latency))
    assert counter.latency() == (50.0, 99.0)
