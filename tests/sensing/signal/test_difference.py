"""Difference data, plain and normalised."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import DataError
from tomoskin.sensing.signal import difference, in_phase
from tomoskin.sensing.signal.difference import DIFFERENCES

REFERENCE = np.array([1.0, -2.0, 4.0])
VALUES = np.array([[1.5, -2.0, 3.0], [1.0, -1.0, 4.0]])


def test_plain() -> None:
    assert difference(VALUES, REFERENCE, "plain").tolist() == [[0.5, 0, -1], [0, 1, 0]]


def test_normalised_keeps_the_sign_of_the_change() -> None:
    got = difference(VALUES, REFERENCE, "normalised")
    assert got.tolist() == [[0.5, 0, -0.25], [0, 0.5, 0]]


@given(st.floats(1e-6, 1e6))
def test_normalised_is_blind_to_gain(gain: float) -> None:
    got = difference(gain * VALUES, gain * REFERENCE, "normalised")
    assert got == pytest.approx(difference(VALUES, REFERENCE, "normalised"), rel=1e-9)


@pytest.mark.parametrize("kind", DIFFERENCES)
def test_one_frame_is_the_row_of_many(kind: str) -> None:
    many = difference(VALUES, REFERENCE, kind)
    assert np.array_equal(difference(VALUES[1], REFERENCE, kind), many[1])


def test_unknown_kind() -> None:
    with pytest.raises(DataError, match='among plain, normalised, got "ratio"'):
        difference(VALUES, REFERENCE, "ratio")


@pytest.mark.parametrize("kind", DIFFERENCES)
def test_another_number_of_rows(kind: str) -> None:
    with pytest.raises(DataError, match="expected 3 voltages, got 2"):
        difference(VALUES[:, :2], REFERENCE, kind)


def test_a_silent_row_cannot_be_normalised() -> None:
    reference = np.array([1.0, 0.0, 0.0])
    assert difference(VALUES, reference, "plain").shape == VALUES.shape
    with pytest.raises(DataError, match="cannot be normalised by it") as caught:
        difference(VALUES, reference, "normalised")
    assert caught.value.where == "row 1"


@given(st.floats(-np.pi, np.pi), st.integers(0, 1000))
def test_the_instruments_phase_is_taken_out(phase: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = rng.standard_normal(40)
    reference = model * rng.uniform(0.8, 1.2, 40)
    values = reference * rng.uniform(0.9, 1.1, (3, 40))
    turn = np.exp(1j * phase)
    got, got_reference = in_phase(values * turn, reference * turn, model)
    assert got_reference == pytest.approx(reference)
    assert got == pytest.approx(values)


def test_real_recordings_keep_their_sign() -> None:
    values, reference = in_phase(VALUES, REFERENCE, -REFERENCE)
    assert values is VALUES
    assert reference is REFERENCE
