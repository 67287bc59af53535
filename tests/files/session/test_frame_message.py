"""Frames in a session file: with and without sums, and as before protocol 1.2."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import DataError, Frame, Mark
from tomoskin.files.session.layout import decode_frame, encode_frame

counts = st.lists(st.integers(0, 65535), max_size=40)


def frame_of(samples, sums):
    parts = [None if c is None else np.array(c, dtype=np.uint16) for c in (samples, sums)]
    return Frame(7, 123_456, 1.5, 0x1A2B, 1, 3, *parts)


@given(counts, st.booleans())
def test_there_and_back(samples, chopped):
    sums = samples[::-1] if chopped and samples else None
    frame = frame_of(samples, sums)
    data = encode_frame(frame, Mark.OPENED)
    back = decode_frame(data, "here")
    assert back.mark == Mark.OPENED
    assert back.frame.samples.tolist() == samples
    assert (None if back.frame.sums is None else back.frame.sums.tolist()) == sums
    assert (back.frame.sequence, back.frame.ticks, back.frame.drops) == (7, 123_456, 3)


@pytest.mark.parametrize("n", [0, 5, 48])
def test_a_frame_of_before_protocol_1_2_has_no_sums(n):
    samples = list(range(n))
    old = encode_frame(frame_of(samples, None), Mark.NONE)[: 36 + 2 * n]
    frame = decode_frame(old, "here").frame
    assert frame.samples.tolist() == samples
    assert frame.sums is None


@pytest.mark.parametrize("cut", [1, 2, 3, 5, 9])
def test_a_torn_one_is_refused(cut):
    data = encode_frame(frame_of([1, 2, 3], [4, 5, 6]), Mark.NONE)
    with pytest.raises(DataError, match="expected a frame"):
        decode_frame(data[:-cut], "here")
