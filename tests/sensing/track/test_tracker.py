"""Identity of touches over frames, their beginning and their end."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from sensing.track.detections import AREA, Run, detection
from tomoskin.core import Detection
from tomoskin.sensing.track import Tracker, TrackSettings

STILL = TrackSettings(still=True)
FAINT = {"snr": 6.0}


@pytest.mark.parametrize("rate", [10, 40, 200, 1000])
def test_a_faint_touch_begins_in_its_second_frame_or_after_a_moment(rate: float) -> None:
    """Frames within 20 ms tell the same, so that a fast board is not believed sooner."""
    run = Run(rate)([[detection(0, **FAINT)]] * 60)
    first = [len(ids) for ids in run.shown].index(1)
    assert 1 <= first <= max(1, 0.02 * rate)
    run([[]] * 100)
    gone = [len(ids) for ids in run.shown].index(0)
    assert 1 <= gone <= max(2, 0.06 * rate)
    assert run.happened == [("onset", 1), ("release", 1)]


def test_a_touch_without_doubt_begins_in_its_first_frame() -> None:
    run = Run()([[detection(0, snr=15.0)]])
    assert run.happened == [("onset", 1)]


def test_beside_another_no_touch_begins_in_its_first_frame() -> None:
    """What a model lacks of a strong touch stands out too."""
    run = Run()([[detection(-0.05)], [detection(-0.05), detection(0.05, snr=30.0)]])
    assert run.shown == [[1], [1]]
    assert run([[detection(-0.05), detection(0.05, snr=30.0)]] * 2).shown[-1] == [1, 2]


def test_what_a_strong_touch_may_leave_in_frame_after_frame_takes_longer_to_begin() -> None:
    """A wrong profile errs alike in each frame; a second finger stands out by more."""
    strong = detection(-0.05, snr=260.0)
    run = Run(5)([[strong]] * 4 + [[strong, detection(0.05, snr=12.0)]] * 2 + [[strong]] * 4)
    assert run.happened == [("onset", 1)]
    run([[strong, detection(0.05, snr=40.0)]] * 2)
    assert run.happened == [("onset", 1), ("onset", 2)]


def test_touches_that_begin_together_are_beside_each_other() -> None:
    """What a wrong profile leaves begins with its touch."""
    strong, ghost = detection(-0.05, snr=130.0), detection(0.05, snr=13.0)
    run = Run(5)([[strong, ghost], [strong, replace(ghost, snr=10.0)], *[[strong]] * 4])
    assert run.happened == [("onset", 1)]
    run = Run(5)([[strong, detection(0.05, snr=60.0)]])
    assert run.happened == [("onset", 1), ("onset", 2)]


def test_what_stands_out_in_one_frame_alone_does_not_begin() -> None:
    faint = [detection(0.05, snr=6.0, weak=True)]
    run = Run(5)([[detection(-0.05)]] * 4)
    run([[detection(-0.05), detection(0.05, snr=8.0)], *[[detection(-0.05), *faint]] * 10])
    assert run.happened == [("onset", 1)]


def test_what_was_beside_a_touch_and_is_gone_does_not_hold_it_back() -> None:
    run = Run(10)([[detection(-0.05)], [detection(0.05, snr=15.0)]])
    assert run.shown == [[1], [1, 2]]


@pytest.mark.parametrize("rate", [10, 40])
def test_a_touch_is_reported_where_it_is_or_after_a_moment(rate: float) -> None:
    vague = {"sd_x": 0.010, "sd_y": 0.010}
    run = Run(rate)([[detection(0, **vague)], [detection(0.01)]])
    assert run.shown == [[], [1]]
    shown = Run(rate)([[detection(0, **vague)]] * 20).shown
    assert 0.1 * rate < shown.index([1]) < 0.15 * rate + 2


def test_a_touch_tells_since_when_by_the_host() -> None:
    run = Run(10)([[]] * 3 + [[detection(0, **FAINT)]] * 3)
    assert run.touches[-1][0].since == pytest.approx(100.3)
    assert run.touches[-1][0].kind == "decrease"
    assert run.events[0].host_time == pytest.approx(100.4)


def test_frames_that_do_not_follow_each_other_show_what_they_hold() -> None:
    run = Run(settings=STILL)([[detection(0)], [], [detection(0)]])
    assert run.shown == [[1], [], [2]]


def test_a_faint_flicker_never_shows() -> None:
    assert Run()([[detection(0, **FAINT)], []] * 20).happened == []


def test_presses_that_follow_each_other_quickly_elsewhere_are_others() -> None:
    """Taps of a fifth of a second, a tenth apart, 60 mm from each other, at 10 frames/s."""
    taps = [(0.0, 0.05), (0.05, 0.0), (0.0, -0.05), (-0.05, 0.0)]
    run = Run(10)([frame for x, y in taps for frame in ([detection(x, y)], [detection(x, y)], [])])
    assert [number for kind, number in run.happened if kind == "onset"] == [1, 2, 3, 4]


def test_between_onset_and_release_ratio_a_touch_neither_begins_nor_ends() -> None:
    strong, middle = detection(0, snr=5.1), detection(0, snr=3.5)
    run = Run()([[middle]] * 10)
    assert run.shown[-1] == []
    run([[strong]] * 3 + [[middle]] * 20)
    assert run.shown[-1] == [1]
    assert run.happened == [("onset", 1)]


def test_where_the_noise_is_not_known_every_reading_counts() -> None:
    unknown = detection(0, snr=np.nan, sd_x=np.nan, sd_y=np.nan)
    assert Run()([[unknown]] * 2).shown[-1] == [1]


def test_what_another_outshines_goes_on_but_does_not_begin() -> None:
    strong, weak = detection(-0.05), detection(0.05, weak=True)
    run = Run()([[strong, weak]] * 5)
    assert run.shown[-1] == [1]
    run([[strong, detection(0.05)]] * 2 + [[strong, weak]] * 20)
    assert run.shown[-1] == [1, 2]


@pytest.mark.parametrize("rate", [10, 40, 1000])
def test_a_slide_of_a_quarter_of_a_metre_a_second_is_one_touch(rate: float) -> None:
    seconds = np.arange(0, 0.6, 1 / rate)
    run = Run(rate)([[detection(0)]] * 60 + [[detection(0.25 * s)] for s in seconds])
    assert run.happened == [("onset", 1)]
    moves = [e.touch.detection.x for e in run.events if e.kind == "move"]
    assert moves == sorted(moves)
    assert 5 <= len(moves) <= 50
    assert moves[-1] > 0.11


def test_a_resting_touch_does_not_move() -> None:
    rng = np.random.default_rng(1)
    frames = [
        [detection(*(0.003 * rng.standard_normal(2)), sd_x=0.003, sd_y=0.003)] for _ in "x" * 99
    ]
    moves = [e for e in Run()(frames).events if e.kind == "move"]
    assert len(moves) <= 3


def test_a_short_gap_does_not_break_identity() -> None:
    run = Run()([[detection(0)]] * 3 + [[]] * 2 + [[detection(0.004)]])
    assert run.shown[-1] == [1]


def test_a_long_pause_does_not_release_by_itself() -> None:
    """As when the picture was held: nothing was missing in between."""
    tracker = Tracker()
    for time in (0.0, 0.025, 0.05, 60.0, 60.025):
        touches = tracker.update([detection(0)], time, time)
    assert [touch.id for touch in touches] == [1]


def test_a_jump_is_another_touch() -> None:
    run = Run()([[detection(0)]] * 5 + [[detection(0.06)]] * 10)
    assert run.happened == [("onset", 1), ("onset", 2), ("release", 1)]


def test_a_reading_that_is_surely_elsewhere_is_another_touch() -> None:
    """40 mm in a millisecond: near for a vague detection, far for a sharp one."""
    for sd, same in ((0.001, False), (0.02, True)):
        small = {"sd_x": sd, "sd_y": sd, "area": AREA / 100}
        run = Run(1000)([[detection(0, **small)]] * 400 + [[detection(0.04, **small)]] * 60)
        assert (run.shown[-1] == [1]) == same


def test_covariance_counts_along_its_axes() -> None:
    """A detection that is vague along the diagonal may have wandered along it, not across."""
    vague = {"sd_x": 0.02, "sd_y": 0.02, "cov_xy": 3.99e-4, "area": AREA / 100}
    for step, same in (((0.03, 0.03), True), ((0.03, -0.03), False)):
        run = Run(1000)([[detection(0, 0, **vague)]] * 400 + [[detection(*step, **vague)]] * 60)
        assert (run.shown[-1] == [1]) == same


def test_order_of_readings_does_not_matter() -> None:
    a, b = detection(-0.05), detection(0.05)
    run = Run()([[a, b], [b, a], [a, b], [b, a]])
    assert [(t.id, t.detection.x) for t in run.touches[-1]] == [(1, -0.05), (2, 0.05)]


def test_touches_that_pass_each_other_keep_their_identities() -> None:
    xs = np.linspace(-0.05, 0.05, 60)
    frames = [[detection(x, 0.004), detection(-x, -0.004)] for x in xs]
    run = Run(40)(frames)
    assert [(t.id, t.detection.y) for t in run.touches[-1]] == [(1, 0.004), (2, -0.004)]


def test_pairs_have_the_least_sum_not_the_nearest_first() -> None:
    run = Run(10)([[detection(0.0), detection(0.022)]] * 3 + [[detection(0.015), detection(0.037)]])
    assert [(t.id, t.detection.x) for t in run.touches[-1]] == [(1, 0.015), (2, 0.037)]


def test_a_touch_does_not_change_its_sign() -> None:
    run = Run()([[detection(0)]] * 3 + [[detection(0, peak=1)]] * 8)
    assert run.happened == [("onset", 1), ("onset", 2), ("release", 1)]
    assert run.touches[-1][0].kind == "increase"


def test_reset_releases_all_and_counts_on() -> None:
    run = Run()([[detection(0)]] * 3)
    run.tracker.reset()
    assert run([[]]).shown == [[]]
    assert run([[detection(0)]] * 3).shown[-1] == [2]
    assert run.happened == [("onset", 1), ("release", 1), ("onset", 2)]


def test_touches_that_have_gone_are_forgotten() -> None:
    """But for residual responses of the last ones: weeks need no more memory than an hour."""
    run, sizes = Run(10.0), []
    for number in range(200):
        run([[detection(0.03 * (number % 3))]] * 3 + [[]] * 20)
        sizes.append(len(pickle.dumps(run.tracker)))
    assert run.tracker.ledger.numbered == 200
    assert max(sizes[150:]) <= max(sizes[80:120]) + 16  # numbers become longer


def test_a_clock_that_begins_again_keeps_the_touches() -> None:
    tracker = Tracker()
    for time, host in ((9.0, 1.0), (9.1, 1.1), (0.0, 1.2), (0.1, 1.3)):
        touches = tracker.update([detection(0)], time, host)
    assert [(t.id, t.since) for t in touches] == [(1, 1.0)]


def test_a_clock_that_stands_still_is_the_hosts() -> None:
    tracker = Tracker()
    shown = [len(tracker.update([detection(0)], 0.0, 0.025 * n)) for n in range(3)]
    assert shown == [1, 1, 1]


coordinates = st.floats(-0.1, 0.1)
frames_of_readings = st.lists(
    st.lists(st.tuples(coordinates, coordinates, st.sampled_from([-1.0, 1.0])), max_size=6),
    max_size=25,
)


@given(frames_of_readings, st.sampled_from([10.0, 40.0, 300.0]), st.booleans())
def test_what_holds_whatever_comes(
    frames: list[list[tuple[float, float, float]]], rate: float, close: bool
) -> None:
    run = Run(rate)
    begun: set[int] = set()
    ended: set[int] = set()
    for places in frames:
        before = len(run.events)
        found: list[Detection] = [detection(*place, close=close) for place in places]
        (touches,) = run([found]).touches
        for event in run.events[before:]:
            if event.kind == "onset":
                assert event.touch.id == max(begun, default=0) + 1
                begun.add(event.touch.id)
            if event.kind == "release":
                assert event.touch.id not in ended
                ended.add(event.touch.id)
        told = [number for t in touches for number in (t.merged or (t.id,))]
        assert sorted(told) == sorted(begun - ended), "every touch that goes on is shown once"
        assert [t.id for t in touches] == sorted(t.id for t in touches)
        assert len({id(t.detection) for t in touches}) == len(touches), "one detection, one touch"
        for touch in touches:
            assert not touch.merged or touch.id == min(touch.merged)
            assert (touch.kind == "decrease") == (touch.detection.peak < 0)


def test_of_frames_that_do_not_follow_each_other_none_tells_of_another() -> None:
    """A faint target where a strong one was is a target, a weak one beside a new strong one not."""
    strong, faint = detection(0, peak=-1.0), detection(0, peak=-0.2)
    run = Run(settings=STILL)([[strong], [], [faint]])
    assert [len(ids) for ids in run.shown] == [1, 0, 1]
    run = Run(settings=STILL)([[strong], [detection(0, weak=True), detection(0.05)]])
    assert [[touch.detection.x for touch in frame] for frame in run.touches] == [[0], [0.05]]


def test_of_frames_that_do_not_follow_each_other_presses_elsewhere_are_others() -> None:
    """One a second, 50 mm from the last; a touch that goes on a little is the same."""
    run = Run(1, STILL)([[detection(0.0)], [detection(0.05)], [detection(0.055)], [detection(0.0)]])
    assert run.shown == [[1], [2], [2], [3]]
