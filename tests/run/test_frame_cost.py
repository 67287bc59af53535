"""What frames took their time for, by a clock that the test moves."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import Frame, reach
from tomoskin.run.status import CostMeter


class Clock:
    """Shows what it was set to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def frame(sequence: int) -> Frame:
    return Frame(sequence, 0, float(sequence), 1, 0, 0, np.zeros(0, np.uint16))


def measure(meter: CostMeter, clock: Clock, sequence: int, *stages: tuple[str, float]) -> None:
    with meter.of(frame(sequence)):
        for name, seconds in stages:
            reach(name)
            clock.now += seconds


def test_time_goes_to_the_stage_that_was_reached_last() -> None:
    clock = Clock()
    meter = CostMeter(clock)
    measure(meter, clock, 7, ("image", 1e-3), ("touches", 2e-3), ("image", 1e-3), ("touches", 1e-3))
    (cost,) = meter.slowest
    assert cost.sequence == 7
    assert cost.seconds == pytest.approx(5e-3)
    assert {name: times for name, _, times in cost.stages} == {
        "voltages": 1,
        "touches": 2,
        "image": 2,
    }
    spent = {name: us for name, us, _ in cost.stages}
    assert spent == pytest.approx({"voltages": 0.0, "touches": 3000, "image": 2000})
    assert cost.text.startswith("5.00 ms: touches 3.00 (2 times), image 2.00 (2 times)")


def test_the_slowest_frames_are_kept_in_their_order_and_forgotten_in_the_end() -> None:
    clock = Clock()
    meter = CostMeter(clock)
    for number in range(200):
        measure(meter, clock, number, ("touches", 1e-3 * ((number * 7) % 200)))
    kept = [cost.seconds for cost in meter.slowest]
    assert kept == sorted(kept, reverse=True)
    assert kept[0] == pytest.approx(0.199)
    assert len(kept) == 50
    for number in range(20_000):
        measure(meter, clock, number, ("touches", 0.1))
    assert kept[0] > meter.slowest[0].seconds


def test_a_frame_that_fails_is_timed_too_and_no_stage_outlives_it() -> None:
    clock = Clock()
    meter = CostMeter(clock)

    def fail() -> None:
        with meter.of(frame(1)):
            reach("image")
            clock.now += 1e-3
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    reach("nobody watches")
    assert meter.slowest[0].seconds == pytest.approx(1e-3)
