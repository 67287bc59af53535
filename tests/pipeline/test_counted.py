"""What a frame costs, counted rather than timed: calls, memory, rooms, bytes to the page."""

from __future__ import annotations

import sys
import tracemalloc
from collections import Counter
from statistics import median

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame
from tomoskin.model.forward import choose_engine
from tomoskin.model.forward.engine_choice import Native
from tomoskin.pipeline import Pipeline, prepare

REFERENCE, WARM, COUNTED = 20, 360, 60
MOST_CALLS = {"image": 900, "fit": 2500 if isinstance(choose_engine(), Native) else 5000}
"""Of functions in Python and C, per frame with a touch that moves; the search is one call where the
native engine is installed, and numpy's where it is not."""

MOST_IMAGES = {"image": 15, "fit": 60}
"""Memory that a frame may need, in images of eight bytes a cell."""

NEVER = {"model/mesh", "model/skin", "twin", "files"}
"""Rooms that no frame enters; by image not the exact model either."""


@pytest.fixture(scope="module", params=["image", "fit"])
def method(request):
    return request.param


@pytest.fixture(scope="module")
def by_method(prepared, method):
    return prepare(prepared.skin.altered({"touch": {"method": method}}))


@pytest.fixture(scope="module")
def chunks(prepared, idle):
    """Bytes of frames: an idle skin, then one press that goes round."""
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    places = 0.03 * np.column_stack([np.cos(angles), np.sin(angles)])
    kinds = [samples_of(prepared, pressed(prepared, *place)) for place in places.tolist()]
    noise = np.random.default_rng(5)
    rows = [idle] * REFERENCE + [kinds[k % 20] for k in range(WARM + COUNTED)]
    return [
        encode(Frame(k, 25_000 * k, 0.1 * k, 1, 0, 0, _noisy(row, noise)))
        for k, row in enumerate(rows)
    ]


def _noisy(row, noise):
    told = (row > 0) & (row < 65000)
    return np.where(told, row + noise.integers(-1, 2, len(row)), row).astype(np.uint16)


@pytest.fixture
def one(by_method, chunks):
    """Takes the next chunk from bytes to touches; the reference and the warm-up are over."""
    decoder, pipeline = Decoder(), Pipeline(by_method, reference_frames=REFERENCE)

    def take(number):
        (frame,) = decoder.feed(chunks[number], 0.1 * number)
        return pipeline.push(frame)

    for number in range(REFERENCE + WARM):
        result = take(number)
    assert result.touches
    return take


def _profiled(one, number):
    """Calls of one frame, and the rooms that ran."""
    calls, rooms = Counter(), set()

    def seen(frame, event, _argument):
        if event in ("call", "c_call"):
            calls[event] += 1
        if event == "call" and "/tomoskin/" in frame.f_code.co_filename:
            inside = frame.f_code.co_filename.rpartition("/tomoskin/")[2]
            rooms.update("/".join(inside.split("/")[:depth]) for depth in (1, 2))

    before = sys.getprofile()
    sys.setprofile(seen)
    try:
        one(number)
    finally:
        sys.setprofile(before)
    return calls.total(), rooms


def test_a_frame_calls_few_functions_and_never_the_model(one, method):
    found = [_profiled(one, REFERENCE + WARM + k) for k in range(COUNTED)]
    assert 100 < median(calls for calls, _ in found) < MOST_CALLS[method]
    rooms = set().union(*(rooms for _, rooms in found))
    assert rooms >= {"board/wire", "sensing/signal", "imaging", "sensing/track", "pipeline"}
    assert rooms & (NEVER | ({"model/forward"} if method == "image" else set())) == set()


def test_a_frame_needs_little_memory_and_keeps_none(one, prepared, method):
    tracemalloc.start()
    try:
        peaks = []
        for k in range(COUNTED):
            tracemalloc.reset_peak()
            before, _ = tracemalloc.get_traced_memory()
            one(REFERENCE + WARM + k)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
            if k == COUNTED // 2:
                half, _ = tracemalloc.get_traced_memory()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    picture = 8 * len(prepared.mesh.cells)
    assert median(peaks) < MOST_IMAGES[method] * picture
    # Thirty frames that kept one picture each would keep thirty. Footprints still fill, up to their
    # most, and numpy and scipy keep names.
    assert after - half < 2 * picture
