"""Rows that measure the same: voltages with their signs, sizes without, and what is no copy."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Recording

RNG = np.random.default_rng(4)
ONCE = Pattern.opposite(8)
VALUES = RNG.uniform(0.5, 2.0, (5, ONCE.n_meas)) * np.where(RNG.random(ONCE.n_meas) < 0.5, 1, -1)


def twice(again: FloatArray) -> Recording:
    """Rows of one way, then ``again`` (n, n_meas) driven from the other end."""
    drive = np.vstack([ONCE.drive, ONCE.drive[:, ::-1]])
    measure = np.vstack([ONCE.measure, ONCE.measure])
    return Recording(
        np.hstack([VALUES, again]), drive, measure, np.arange(5.0), None, None, False, "here"
    )


def test_voltages_are_meant_with_their_signs() -> None:
    found = twice(-1.2 * VALUES).without_repeats()
    assert found.voltages == pytest.approx(1.1 * VALUES)
    assert np.array_equal(found.drive, ONCE.drive)
    assert found.notes == ("16 of 32 rows repeat another's measurement: their mean counts",)


def test_sizes_repeat_with_the_same_sign_and_do_not_cancel() -> None:
    found = twice(1.2 * VALUES).without_repeats()
    assert found.voltages == pytest.approx(1.1 * VALUES)
    assert found.notes == ("16 of 32 rows repeat another's size: their mean counts",)


def test_rows_that_do_not_agree_are_no_copies() -> None:
    found = twice(RNG.standard_normal(VALUES.shape)).without_repeats()
    assert np.array_equal(found.voltages, VALUES)
    assert "do not agree, so the first counts" in found.notes[0]


def test_what_is_missing_in_one_row_is_in_the_other() -> None:
    again = -1.2 * VALUES
    again[2, 3] = np.nan
    found = twice(again).without_repeats()
    assert found.voltages[2, 3] == VALUES[2, 3]
    assert found.voltages[2, 4] == pytest.approx(1.1 * VALUES[2, 4])


def test_a_pattern_that_asks_for_both_ways_gets_both() -> None:
    recording = twice(-1.2 * VALUES)
    both = Pattern.from_tables(recording.drive, recording.measure)
    found = recording.in_order_of(both)
    assert found.voltages is recording.voltages
    assert found.notes == ()
    assert recording.in_order_of(ONCE).voltages == pytest.approx(1.1 * VALUES)


def test_a_row_that_stands_twice_is_meant_where_a_pattern_would_refuse_it() -> None:
    drive, measure = np.vstack(2 * [ONCE.drive]), np.vstack([ONCE.measure, ONCE.measure[:, ::-1]])
    values = np.hstack([VALUES, -3.0 * VALUES])
    recording = Recording(values, drive, measure, np.arange(5.0), None, None, False, "here")
    found = recording.in_order_of(ONCE)
    assert found.voltages == pytest.approx(2.0 * VALUES)
    assert found.notes[0].endswith("counts, though the repeated ones are 3 times as large")
