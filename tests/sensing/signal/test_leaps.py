"""Labels of rows with times that no finger could follow."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import FloatArray
from tomoskin.sensing.signal import Recording

RATE = 10.0
PLACES = np.random.default_rng(1).uniform(-0.08, 0.08, (30, 2))


def recording(labels: FloatArray, *, timed: bool = True) -> Recording:
    n = len(labels)
    return Recording(
        voltages=np.ones((n, 3)),
        drive=np.array([(0, 1)] * 3),
        measure=np.array([(2, 3), (3, 4), (4, 5)]),
        time=np.arange(n) / RATE,
        reference=None,
        labels=labels,
        is_change=False,
        source="rows.npz",
        timed=timed,
    )


def course(speed: float, n: int = 60) -> FloatArray:
    """(n, 2) m of a finger that goes round at ``speed`` m/s."""
    angle = speed / 0.05 * np.arange(n) / RATE
    return 0.05 * np.column_stack([np.cos(angle), np.sin(angle)])


def test_single_presses_with_times_are_noticed_and_what_to_do_is_said() -> None:
    said = recording(PLACES).leaps
    assert "Leave out time_s, or put untouched rows between the presses" in said
    assert "rows lie farther from those of the row before than a finger gets (0.5 m/s)" in said


@pytest.mark.parametrize("speed", [0.03, 0.15, 0.3])
def test_a_finger_that_slides_does_not_leap(speed: float) -> None:
    assert recording(course(speed)).leaps == ""


def test_a_finger_that_is_put_down_elsewhere_now_and_then_does_not_leap() -> None:
    held = np.repeat(PLACES[:6], 8, axis=0)
    assert recording(held[:32]).leaps == "", "four presses of eight rows: three moves"
    mixed = np.vstack([course(0.1), PLACES[:6], course(0.1)])
    assert recording(mixed).leaps == ""


def test_presses_without_times_or_with_untouched_rows_between_are_none() -> None:
    assert recording(PLACES, timed=False).leaps == ""
    apart = np.full((2 * len(PLACES), 2), np.nan)
    apart[::2] = PLACES
    assert recording(apart).leaps == ""
    assert recording(np.full((20, 2), np.nan)).leaps == ""
