"""The scan holds every row of a pattern, and nothing that no row needs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import PatternError
from tomoskin.model.pattern import Pattern, Scan, named

patterns = st.one_of(
    st.integers(4, 32).map(Pattern.adjacent),
    st.sampled_from(["skip:2", "opposite", "all_pairs", "adjacent+opposite"]).map(
        lambda name: named(name, 16)
    ),
)


@given(patterns)
def test_every_row_is_the_difference_of_its_two_samples(pattern: Pattern) -> None:
    scan = Scan.of(pattern)
    potential = np.random.default_rng(0).random((pattern.n_drive, pattern.n_electrodes))
    samples = potential[scan.sample_drive, scan.sample_electrode]
    plus, minus = pattern.measure.T
    rows = potential[pattern.drive_index, plus] - potential[pattern.drive_index, minus]
    assert np.array_equal(samples[scan.plus] - samples[scan.minus], rows)


@given(patterns)
def test_samples_are_drive_major_and_ascending(pattern: Pattern) -> None:
    scan = Scan.of(pattern)
    order = np.lexsort((scan.sample_electrode, scan.sample_drive))
    assert np.array_equal(order, np.arange(scan.n_samples))
    assert np.array_equal(scan.drives, pattern.drives)


@given(patterns)
def test_masks_are_the_samples(pattern: Pattern) -> None:
    scan = Scan.of(pattern)
    from_masks = [
        (drive, electrode)
        for drive, mask in enumerate(scan.masks.tolist())
        for electrode in range(32)
        if mask >> electrode & 1
    ]
    samples = zip(scan.sample_drive.tolist(), scan.sample_electrode.tolist(), strict=True)
    assert from_masks == list(samples)
    assert scan.masks.dtype == np.uint32


@given(patterns)
def test_no_sample_is_idle(pattern: Pattern) -> None:
    scan = Scan.of(pattern)
    assert set(scan.plus) | set(scan.minus) == set(range(scan.n_samples))


def test_driven_electrodes_are_not_read_unless_asked_for() -> None:
    scan = Scan.of(Pattern.adjacent(8))
    assert scan.n_samples == 8 * 6
    assert not (scan.drives[scan.sample_drive] == scan.sample_electrode[:, None]).any()
    assert Scan.of(Pattern.adjacent(8, include_driven=True)).n_samples == 64


def test_more_electrodes_than_a_mask_has_bits() -> None:
    assert Scan.of(Pattern.adjacent(32)).masks[0] == 0xFFFFFFFC
    with pytest.raises(PatternError, match="at most 32 electrodes to scan, got 33"):
        Scan.of(Pattern.adjacent(33))
