"""Identity of touches over frames."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomoskin.core import Reading, Touch
from tomoskin.touch import Tracker

Place = tuple[float, float]


def reading(x: float, y: float = 0.0, peak: float = -1.0) -> Reading:
    return Reading(x, y, np.nan, np.nan, 1e-4, peak, np.array([0]))


def run(frames: list[list[Reading]], tracker: Tracker | None = None) -> list[tuple[Touch, ...]]:
    tracker = tracker or Tracker(reach=0.03, patience=3, debounce=2)
    return [tracker.update(readings, 0.1 * i) for i, readings in enumerate(frames)]


def ids(touches: tuple[Touch, ...]) -> list[int]:
    return [t.id for t in touches]


def test_a_region_must_stand_before_it_is_a_touch() -> None:
    frames = run([[reading(0)]] * 4, Tracker(debounce=3))
    assert [ids(f) for f in frames] == [[], [], [1], [1]]
    assert frames[-1][0].since == 0.0
    assert frames[-1][0].kind == "decrease"


def test_without_debounce_it_shows_at_once() -> None:
    assert ids(run([[reading(0)]], Tracker(debounce=1))[0]) == [1]


def test_a_flicker_never_shows() -> None:
    frames = run([[reading(0)], [], [reading(0)], [], [reading(0)], []])
    assert all(f == () for f in frames)


def test_a_touch_keeps_its_identity_while_it_slides() -> None:
    frames = run([[reading(0.01 * i)] for i in range(10)])
    assert {i for f in frames[1:] for i in ids(f)} == {1}
    assert frames[-1][0].reading.x == pytest.approx(0.09)
    assert frames[-1][0].since == 0.0


def test_release_after_patience() -> None:
    frames = run([[reading(0)]] * 3 + [[]] * 5, Tracker(patience=3, debounce=2))
    assert [len(f) for f in frames] == [0, 1, 1, 1, 1, 1, 0, 0]


def test_a_short_gap_does_not_break_identity() -> None:
    frames = run([[reading(0)]] * 3 + [[]] * 3 + [[reading(0.005)]])
    assert ids(frames[-1]) == [1]
    assert frames[-1][0].reading.x == 0.005


def test_after_release_a_new_press_is_another_touch() -> None:
    frames = run([[reading(0)]] * 3 + [[]] * 5 + [[reading(0)]] * 2)
    assert ids(frames[-1]) == [2]
    assert frames[-1][0].since == pytest.approx(0.8)


def test_a_jump_beyond_reach_is_another_touch() -> None:
    frames = run([[reading(0)]] * 2 + [[reading(0.031)]] * 2)
    assert ids(frames[-1]) == [1, 2]
    frames = run([[reading(0)]] * 2 + [[reading(0.029)]] * 2)
    assert ids(frames[-1]) == [1]


def test_order_of_readings_does_not_matter() -> None:
    a, b = reading(-0.05), reading(0.05)
    frames = run([[a, b], [b, a], [a, b], [b, a]])
    for frame in frames[1:]:
        assert [(t.id, t.reading.x) for t in frame] == [(1, -0.05), (2, 0.05)]


def test_touches_that_pass_each_other_keep_their_identities() -> None:
    xs = np.linspace(-0.05, 0.05, 21)
    frames = run([[reading(x, 0.006), reading(-x, -0.006)] for x in xs])
    assert [(t.id, t.reading.y) for t in frames[-1]] == [(1, 0.006), (2, -0.006)]


def test_pairs_have_the_least_sum_of_distances_not_the_nearest_first() -> None:
    """Two move 20 mm along a line: the nearest reading of the first is the second's."""
    tracker = Tracker(reach=0.03, debounce=1)
    tracker.update([reading(0.0), reading(0.022)], 0.0)
    touches = tracker.update([reading(0.02), reading(0.042)], 0.1)
    assert [(t.id, t.reading.x) for t in touches] == [(1, 0.02), (2, 0.042)]


def test_a_touch_does_not_change_its_sign() -> None:
    frames = run([[reading(0, peak=-1)]] * 2 + [[reading(0, peak=1)]] * 2)
    assert [(t.id, t.kind) for t in frames[-1]] == [(1, "decrease"), (2, "increase")]
    assert frames[-1][0].reading.peak == -1


def test_reset_releases_all_and_counts_on() -> None:
    tracker = Tracker(debounce=1)
    tracker.update([reading(0), reading(0.05)], 0.0)
    tracker.reset()
    assert tracker.update([], 0.1) == ()
    assert ids(tracker.update([reading(0)], 0.2)) == [3]


coordinates = st.floats(-0.1, 0.1)
frames_of_readings = st.lists(
    st.lists(st.tuples(coordinates, coordinates, st.sampled_from([-1.0, 1.0])), max_size=6),
    max_size=25,
)


@given(frames_of_readings, st.integers(0, 3), st.integers(1, 3))
def test_what_holds_whatever_comes(
    frames: list[list[tuple[float, float, float]]], patience: int, debounce: int
) -> None:
    tracker = Tracker(patience=patience, debounce=debounce)
    known: dict[int, Touch] = {}
    for number, places in enumerate(frames):
        readings = [reading(*place) for place in places]
        touches = tracker.update(readings, float(number))
        numbers = ids(touches)
        assert numbers == sorted(set(numbers))
        assert len({id(t.reading) for t in touches}) == len(touches), "one reading, one touch"
        for touch in touches:
            if touch.id in known:
                before = known[touch.id]
                gap = np.hypot(
                    touch.reading.x - before.reading.x, touch.reading.y - before.reading.y
                )
                assert gap <= tracker.reach
                assert (touch.since, touch.kind) == (before.since, before.kind)
            else:
                assert touch.id == max(known, default=0) + 1
            known[touch.id] = touch
