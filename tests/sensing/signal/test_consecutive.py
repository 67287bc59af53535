"""Dynamic imaging: each frame against the one before, rows brought to one time."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.sensing.signal import Consecutive

FRAMES = np.array([[1.0, -2.0], [1.5, -2.0], [1.5, -1.0]])


def test_each_against_the_one_before() -> None:
    plain, normalised = Consecutive(), Consecutive("normalised")
    assert plain.push(FRAMES[0]) is None
    assert normalised.push(FRAMES[0]) is None
    assert [plain.push(f).tolist() for f in FRAMES[1:]] == [[0.5, 0.0], [0.0, 1.0]]  # type: ignore[union-attr]
    assert [normalised.push(f).tolist() for f in FRAMES[1:]] == [[0.5, 0.0], [0.0, 0.5]]  # type: ignore[union-attr]


def test_the_frame_is_kept_as_it_was() -> None:
    """A caller may use one array for every frame."""
    buffer, dynamic = FRAMES[0].copy(), Consecutive()
    dynamic.push(buffer)
    buffer[:] = FRAMES[1]
    change = dynamic.push(buffer)
    assert change is not None
    assert change.tolist() == [0.5, 0.0]


def test_a_bad_frame_is_refused_and_skipped() -> None:
    dynamic = Consecutive()
    dynamic.push(FRAMES[0])
    with pytest.raises(DataError, match=r"rows \[1\] are not"):
        dynamic.push(np.array([1.0, np.nan]))
    with pytest.raises(DataError, match="expected 2 voltages, got 3"):
        dynamic.push(np.ones(3))
    change = dynamic.push(FRAMES[1])
    assert change is not None
    assert change.tolist() == [0.5, 0.0]


def test_an_unknown_kind() -> None:
    with pytest.raises(DataError, match='among plain, normalised, got "relative"'):
        Consecutive("relative")
