"""What a material remembers: laws written out, steps of any length, and the way back."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tomoskin.core import ModelError
from tomoskin.model.skin import (
    MaterialMemory,
    MemoryState,
    Metric,
    advanced,
    broken_down,
    followed,
    load_of,
)
from tomoskin.model.skin.hysteresis import SCALAR

MEMORY = MaterialMemory(
    play=(0.3, 0.2),
    play_widths=(0.01, 0.03),
    creep=(0.1, 0.05),
    creep_times=(1.0, 30.0),
    breakdown=(0.1,),
    breakdown_times=(5.0,),
)
PLAIN = MaterialMemory()

LOADS = st.lists(
    st.tuples(st.floats(-0.2, 0.2), st.floats(0.0, 20.0)), min_size=1, max_size=8
)  # fmt: skip


def response(state, memory):
    """(n,) of all parts together."""
    return followed(state, memory)[0] + broken_down(state, memory).sum(axis=0)


def written_out(steps):
    """The laws of MEMORY, number by number."""
    lag, late, broken, before = [0.0, 0.0], [0.0, 0.0], 0.0, 0.0
    for load, dt in steps:
        lag = [
            max(load - w, min(load + w, at)) for at, w in zip(lag, MEMORY.play_widths, strict=True)
        ]
        prompt = 0.5 * load + 0.3 * lag[0] + 0.2 * lag[1]
        late = [
            prompt + (q - prompt) * math.exp(-dt / tau)
            for q, tau in zip(late, MEMORY.creep_times, strict=True)
        ]
        broken, before = (broken + abs(load - before)) * math.exp(-dt / 5.0), load
    return 0.85 * prompt + 0.1 * late[0] + 0.05 * late[1] + 0.1 * broken


def after(steps, memory=MEMORY, n=1):
    state = MemoryState.fresh(memory, n)
    for load, dt in steps:
        state = advanced(state, memory, np.full((1, n), load), dt)
    return state


@given(LOADS)
def test_the_laws_as_they_are_written(steps):
    assert response(after(steps), MEMORY) == pytest.approx([written_out(steps)], abs=1e-14)


@given(LOADS, st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_one_long_step_is_two_short_ones(steps, first, second):
    load = steps[-1][0]
    one = after([*steps[:-1], (load, first + second)])
    two = after([*steps[:-1], (load, first), (load, second)])
    assert response(one, MEMORY) == pytest.approx(response(two, MEMORY), abs=1e-13)


@given(LOADS)
@settings(deadline=None)
def test_the_load_is_found_again_frame_by_frame(steps):
    lasting = replace(MEMORY, breakdown=(), breakdown_times=())
    forward, back = MemoryState.fresh(lasting, 2), MemoryState.fresh(lasting, 2)
    for load, dt in steps:
        both = np.array([[load, -2 * load]])
        forward = advanced(forward, lasting, both, dt)
        found, back = load_of(back, lasting, followed(forward, lasting)[0], dt)
        assert found == pytest.approx(both[0], abs=1e-10)
        assert back.late == pytest.approx(forward.late, abs=1e-10)


def test_without_memory_the_response_is_the_load():
    state = after([(0.3, 1.0), (-0.1, 0.0)], PLAIN)
    assert response(state, PLAIN) == [-0.1]
    assert load_of(state, PLAIN, np.array([7.0]), 3.0)[0] == pytest.approx([7.0])
    assert PLAIN.still
    assert not MEMORY.still


def test_motion_either_way_breaks_contacts_that_form_again():
    brittle = MaterialMemory(breakdown=(0.5,), breakdown_times=(10.0,))
    left, steps = math.exp(-2), [(1.0, 0.0), (1.0, 20.0), (0.0, 0.0)]
    seen = [response(after(steps[:n], brittle), brittle)[0] for n in (1, 2, 3)]
    assert seen == pytest.approx([1.5, 1 + 0.5 * left, 0.5 * (left + 1)])


def test_a_play_of_several_components_knows_no_direction():
    both = Metric(((1.0, 1.0),))
    memory = MaterialMemory(play=(1.0,), play_widths=(1.0,))
    for angle in (0.0, 0.7, 2.0):
        turned = np.array([[3 * math.cos(angle)], [3 * math.sin(angle)]])
        state = advanced(MemoryState.fresh(memory, 1, both), memory, turned, 0.0, both)
        assert followed(state, memory) == pytest.approx(2 / 3 * turned)
    assert SCALAR.sizes(np.array([[-2.0]])) == [[2.0]]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"play": (0.5,)}, "as many play as play_widths, got 1 and 0"),
        ({"play": (0.5,), "play_widths": (0.0,)}, "play_widths above 0"),
        ({"creep": (0.7, 0.7), "creep_times": (1.0, 2.0)}, "from 0 to a sum of 1"),
        ({"breakdown": (-1.0,), "breakdown_times": (1.0,)}, "breakdown from 0, got"),
    ],
)
def test_what_is_no_memory_is_refused(wrong, message):
    with pytest.raises(ModelError, match=message):
        MaterialMemory(**wrong)


@pytest.mark.parametrize("dt", [-1.0, math.nan, math.inf])
def test_time_goes_on(dt):
    with pytest.raises(ModelError, match="time step of 0 s or more"):
        advanced(MemoryState.fresh(MEMORY), MEMORY, np.zeros((1, 1)), dt)
