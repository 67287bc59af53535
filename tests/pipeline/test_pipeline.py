"""From frames to touches, and what becomes of frames that are not as they should be."""

import tracemalloc
from itertools import count

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame, Mark
from tomoskin.pipeline import Pipeline

NEEDED = 5


@pytest.fixture(scope="module")
def touched(prepared):
    return samples_of(prepared, pressed(prepared, 0.03, 0.02))


@pytest.fixture
def push(prepared):
    """A pipeline's push for bare samples; every frame has noise of a fraction of a count."""
    pipeline = Pipeline(prepared, reference_frames=NEEDED)
    rng, number = np.random.default_rng(3), count()

    def push(samples, mark=Mark.NONE):
        n = next(number)
        noise = rng.integers(-1, 2, len(samples))
        noisy = np.where((samples == 0) | (samples > 65000), samples, samples + noise)
        ticks = round(0.01 * n * pipeline.tick_rate)
        frame = Frame(n, ticks, 0.01 * n, 1, 0, 0, noisy.astype(np.uint16))
        return pipeline.push(frame, mark)

    push.pipeline = pipeline
    return push


SETTLED = 300
"""Frames after a reference in which alpha and sheet follow it."""


def settle(push, idle):
    for _ in range(NEEDED):
        push(idle)


def test_the_first_frames_make_the_reference(push, idle, prepared):
    for taken in range(NEEDED):
        assert push.pipeline.reference_state.frames == taken
        assert not push.pipeline.reference_state.ready
        result = push(idle)
        assert not result.image.values.any()
        assert result.touches == ()
    assert result.ready
    state = push.pipeline.reference_state
    assert state.ready
    assert state.since == pytest.approx(0.01 * (NEEDED - 1))
    assert 0 < state.noise < 1e-3
    np.testing.assert_allclose(result.reference, prepared.operator.reference, rtol=0.02)


def test_an_idle_skin_has_no_touch(push, idle):
    settle(push, idle)
    for _ in range(50):
        assert push(idle).touches == ()


def test_a_touch_is_found_where_it_is_and_keeps_its_identity(push, idle, touched):
    settle(push, idle)
    results = [push(touched) for _ in range(10)]
    [touch] = results[-1].touches
    assert np.hypot(touch.detection.x - 0.03, touch.detection.y - 0.02) < 0.01
    assert touch.kind == "decrease"
    assert touch.detection.peak < 0
    assert 0 < touch.detection.sd_x < 0.01
    assert {t.id for r in results for t in r.touches} == {touch.id}
    released = [push(idle) for _ in range(10)][-1]
    assert released.touches == ()


def test_a_new_reference_takes_the_touch_for_rest(push, idle, touched):
    settle(push, idle)
    for _ in range(5):
        push(touched)
    push.pipeline.take_reference()
    result = push(touched)
    assert not result.ready
    assert result.touches == ()
    for _ in range(NEEDED + 3):
        result = push(touched)
    assert result.ready
    assert result.touches == ()


def test_pause(push, idle):
    settle(push, idle)
    assert push(idle, Mark.HELD) is None
    assert push(idle) is not None


def test_a_frame_of_another_scan_is_refused(push, idle):
    settle(push, idle)
    assert push(idle[:-1]) is None
    assert push.pipeline.refused == 1
    assert push(idle) is not None


@pytest.mark.parametrize("rail", [0, 65535])
def test_rows_at_a_rail_are_left_out_and_said(push, idle, touched, rail):
    settle(push, idle)
    for _ in range(3):
        push(touched)
    whole = push(touched)
    broken = touched.copy()
    broken[7] = rail
    result = push(broken)
    assert 0 < result.left_out <= 2
    assert result.has_image
    assert "without them" in result.problem
    change = np.abs(result.image.values - whole.image.values).max()
    assert change < 0.3 * np.abs(whole.image.values).max()
    [touch] = result.touches
    assert np.hypot(touch.detection.x - 0.03, touch.detection.y - 0.02) < 0.015
    assert push(touched).problem is None


def test_too_many_rows_at_a_rail_give_no_picture(push, idle, touched):
    settle(push, idle)
    broken = touched.copy()
    broken[::2] = 0
    result = push(broken)
    assert not result.has_image
    assert not result.image.values.any()
    assert result.touches == ()
    assert "no image" in result.problem


def test_a_row_at_a_rail_in_the_reference_stays_out(push, idle, touched):
    broken = idle.copy()
    broken[7] = 0
    push(broken)
    settle(push, idle)
    result = push(touched)
    assert result.left_out > 0
    assert np.isfinite(result.image.values).all()
    assert np.isfinite(result.reference).all()


@pytest.mark.parametrize("rail", [0, 65535])
def test_a_frame_of_nothing_but_rails_does_not_spoil_the_reference(push, idle, touched, rail):
    push(np.full_like(idle, rail))
    settle(push, idle)
    for _ in range(3):
        result = push(touched)
        assert result.left_out == 0
    assert result.touches


def test_a_reference_of_nothing_but_rails_is_said(push, idle, touched):
    settle(push, np.zeros_like(idle))
    for _ in range(30):  # until alpha has been tuned
        result = push(touched)
    assert not result.has_image
    assert "too few rows are left" in result.problem


def test_memory_does_not_grow(push, idle, touched):
    settle(push, idle)
    for _ in range(SETTLED):
        push(idle)
    for _ in range(20):
        push(touched)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(300):
        push(touched)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 100_000
