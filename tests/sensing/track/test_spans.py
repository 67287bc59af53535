"""Touches counted as a person does: each once, with its beginning, its end and its best moment."""

from __future__ import annotations

import numpy as np

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track import touch_spans


def touch(number: int, x: float, peak: float, since: float = 1.0, merged: tuple[int, ...] = ()):
    """A touch at (x, 0)."""
    nothing = np.empty(0, dtype=np.int64)
    detection = Detection(x, 0.0, 1e-3, 1e-3, 1e-4, peak, nothing)
    return Touch(number, "decrease", since, detection, merged)


def test_a_touch_of_many_frames_is_one_where_it_was_strongest() -> None:
    frames = [
        (0.9, ()),
        (1.0, (touch(1, 0.01, -0.1),)),
        (1.1, (touch(1, 0.02, -0.3), touch(2, 0.05, 0.2, since=1.1))),
        (1.2, (touch(1, 0.09, -0.2),)),  # as it is released
    ]
    one, two = touch_spans(frames)
    assert (one.id, one.begin, one.end, one.x, one.peak) == (1, 1.0, 1.2, 0.02, -0.3)
    assert (two.id, two.begin, two.end, two.kind) == (2, 1.1, 1.1, "decrease")


def test_what_is_merged_goes_on_at_a_place_of_its_own() -> None:
    apart = touch(1, 0.01, -0.1), touch(3, 0.03, -0.1)
    together = (touch(1, 0.02, -0.5, merged=(1, 3)),)
    one, three = touch_spans([(1.0, apart), (1.1, together), (1.2, together)])
    assert (one.id, one.end, one.x) == (1, 1.2, 0.01)
    assert (three.id, three.end, three.x) == (3, 1.2, 0.03)


def test_a_number_that_is_given_again_is_another_touch() -> None:
    frames = [(1.0, (touch(1, 0.0, -0.1),)), (5.0, (touch(1, 0.0, -0.1, since=5.0),))]
    assert [(span.begin, span.end) for span in touch_spans(frames)] == [(1.0, 1.0), (5.0, 5.0)]
    assert touch_spans([]) == ()
