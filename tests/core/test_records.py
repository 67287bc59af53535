"""Records are frozen and compared as what they are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tomoskin.core import Detection, Event, Frame, Image, Touch, Voltages

READING = Detection(0.01, -0.02, np.nan, np.nan, 1e-4, -0.3, np.array([3, 4]))
RECORDS = [
    Frame(1, 2, 3.0, 4, 0, 0, np.zeros(3, dtype=np.uint16)),
    Voltages(np.zeros(3), np.zeros(3, dtype=bool), 2.0, 3.0),
    Image(np.zeros(3), "S", "mesh"),
    READING,
    Touch(1, "decrease", 0.5, READING),
    Event(0.5, "gap", "3 frames are missing"),
]


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
def test_frozen(record: Event) -> None:
    for field in dataclasses.fields(record):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(record, field.name, None)


@pytest.mark.parametrize("record", RECORDS[:-1], ids=lambda record: type(record).__name__)
def test_records_with_arrays_compare_by_identity(record: Frame) -> None:
    """Comparing arrays with == has no single truth value, so records do not try."""
    assert record == record  # noqa: PLR0124
    assert record != dataclasses.replace(record)


def test_events_compare_by_value() -> None:
    assert Event(1.0, "gap", "x") == Event(1.0, "gap", "x")


def test_a_touch_prints_without_its_cells() -> None:
    assert "cells" not in repr(Touch(1, "decrease", 0.5, READING))
