"""What a host leaves out that does not keep up."""

from __future__ import annotations

import numpy as np

from tomoskin.run.intake import MOST_AT_ONCE, Backlog

LATE, PROMPT = 0.02, 0.0
PERIOD = 1 / 400
"""s between frames."""


def ages(cost: float, frames: int = 4000) -> tuple[np.ndarray, int]:
    """s from each computed frame to its result on a host that needs ``cost`` s for one; and how
    many are left out."""
    backlog, now, taken, found, left_out = Backlog(), 0.0, 0, [], 0
    while taken < frames:
        came = int(now / PERIOD) + 1
        if came == taken:
            now = (taken + 1e-6) * PERIOD
            continue
        late = backlog.late(came - taken, now - taken * PERIOD)
        left_out += late
        for number in range(taken + late, came):
            now += cost
            found.append(now - number * PERIOD)
        taken = came
    return np.array(found), left_out


def test_who_keeps_up_leaves_nothing_out() -> None:
    late, left_out = ages(0.9 * PERIOD)
    assert left_out == 0
    assert late.max() < PERIOD


def test_who_is_behind_computes_the_newest_alone() -> None:
    late, left_out = ages(1.3 * PERIOD)
    assert np.percentile(late[100:], 99) < 2.7 * PERIOD
    assert 0.2 < left_out / 4000 < 0.35  # what cannot be computed, and little more


def test_who_was_held_up_once_catches_up() -> None:
    backlog = Backlog()
    assert backlog.late(MOST_AT_ONCE + 5, LATE) == 5
    assert backlog.late(MOST_AT_ONCE // 2, LATE) == 0
    assert [backlog.late(1, PROMPT) for _ in range(100)] == [0] * 100
    assert backlog.late(MOST_AT_ONCE, LATE) == 0


def test_a_port_that_gives_many_at_once_is_no_host_that_is_behind() -> None:
    backlog = Backlog()
    assert [backlog.late(MOST_AT_ONCE + 1, PROMPT) for _ in range(50)] == [1] * 50
    assert backlog.late(MOST_AT_ONCE, LATE) == 0
