"""Foreign rows in any order, sign or exchange come back in the pattern's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import FloatArray, IntArray, PatternError
from tomoskin.model.pattern import Pattern, match_rows, named, sum_rows

patterns = st.one_of(
    st.integers(4, 12).map(Pattern.adjacent),
    st.sampled_from(["skip:1", "opposite", "all_pairs", "adjacent+opposite"]).map(
        lambda name: named(name, 8)
    ),
)


def resistance(n: int) -> FloatArray:
    """Reciprocal (n, n) Ω, so that each voltage is known by its electrodes alone."""
    half = np.random.default_rng(n).random((n, n))
    return half + half.T


def voltages(drive: IntArray, measure: IntArray, n: int) -> FloatArray:
    r = resistance(n)
    (source, sink), (plus, minus) = drive.T, measure.T
    return np.asarray(r[plus, source] - r[plus, sink] - r[minus, source] + r[minus, sink])


def scrambled(pattern: Pattern, random: Any) -> tuple[IntArray, IntArray]:
    """The rows shuffled; each pair perhaps reversed, drive and measurement perhaps exchanged."""
    out = []
    for d, m in zip(pattern.drive.tolist(), pattern.measure.tolist(), strict=True):
        first, second = (d, m) if random.random() < 0.5 else (m, d)
        out.append((first[:: random.choice((1, -1))], second[:: random.choice((1, -1))]))
    random.shuffle(out)
    unique = {(frozenset(d), frozenset(m)): (d, m) for d, m in out}.values()
    return np.array([d for d, _ in unique]), np.array([m for _, m in unique])


@given(patterns, st.randoms(use_true_random=False))
def test_round_trip(pattern: Pattern, random: Any) -> None:
    drive, measure = scrambled(pattern, random)
    match = match_rows(pattern, drive, measure)
    foreign = voltages(drive, measure, pattern.n_electrodes)
    own = voltages(pattern.drive, pattern.measure, pattern.n_electrodes)
    assert match.apply(foreign) == pytest.approx(own, rel=1e-12)
    assert match.apply(np.stack([foreign, 2 * foreign])) == pytest.approx(np.stack([own, 2 * own]))


def test_the_same_table_is_left_as_it_is() -> None:
    pattern = Pattern.adjacent(8)
    match = match_rows(pattern, pattern.drive, pattern.measure)
    assert match.rows.tolist() == list(range(pattern.n_meas))
    assert (match.signs == 1).all()


def test_a_row_as_itself_wins_over_its_reciprocal() -> None:
    """Measured noise differs between the two, so the choice shows."""
    wanted = Pattern.from_tables([[1, 0]], [[3, 2]], 4)
    match = match_rows(wanted, [[3, 2], [0, 1]], [[1, 0], [3, 2]])
    assert (match.rows.tolist(), match.signs.tolist()) == ([1], [-1.0])


def test_half_a_scan_fills_a_whole_one_by_reciprocity() -> None:
    pattern = Pattern.adjacent(8)
    low = np.sort(pattern.drive, axis=1), np.sort(pattern.measure, axis=1)
    first = np.lexsort(np.hstack([*low[::-1]]).T)
    keep = [r for r in first if tuple(low[0][r]) < tuple(low[1][r])]
    assert len(keep) == pattern.n_meas // 2
    drive, measure = pattern.drive[keep], pattern.measure[keep]
    match = match_rows(pattern, drive, measure)
    own = voltages(pattern.drive, pattern.measure, 8)
    assert match.apply(voltages(drive, measure, 8)) == pytest.approx(own)


def test_rows_that_are_not_asked_for_are_left_out() -> None:
    full = Pattern.adjacent(8, include_driven=True)
    match = match_rows(Pattern.adjacent(8), full.drive, full.measure)
    touching = (full.drive[:, :, None] == full.measure[:, None, :]).any(axis=(1, 2))
    assert match.apply(np.arange(64.0)).tolist() == np.flatnonzero(~touching).tolist()


def test_missing_rows_are_listed() -> None:
    pattern = Pattern.adjacent(8)
    touched = (pattern.drive == 3).any(axis=1) | (pattern.measure == 3).any(axis=1)
    with pytest.raises(PatternError) as caught:
        match_rows(pattern, pattern.drive[~touched], pattern.measure[~touched])
    message = str(caught.value)
    assert message.startswith(f"{touched.sum()} of 40 rows are not in the recording: ")
    row = int(np.argmax(touched))
    (source, sink), (plus, minus) = pattern.drive[row] + 1, pattern.measure[row] + 1
    assert f"row {row}: source E{source}, sink E{sink}, plus E{plus}, minus E{minus}" in message
    assert f"and {touched.sum() - 5} more" in message


def test_one_missing_row_is_named_alone() -> None:
    pattern = Pattern.adjacent(4)
    drive, measure = [[1, 0], [2, 1]], [[2, 3], [3, 0]]
    match_rows(pattern, drive, measure)  # by reciprocity
    with pytest.raises(
        PatternError, match=r"2 of 4 rows.*row 1: source E3.*; row 3: source E1"
    ) as e:
        match_rows(pattern, drive[:1], measure[:1])
    assert "more" not in str(e.value)


def test_complex_values_keep_their_phase() -> None:
    pattern = Pattern.adjacent(4)
    match = match_rows(pattern, pattern.drive[:, ::-1], pattern.measure)
    assert match.apply(np.full(4, 1j)).tolist() == [-1j] * 4


def test_rows_that_drive_a_pair_from_both_ends_stay_themselves() -> None:
    """Their data need not be each other's negative: an instrument may read the signs unlike."""
    drive, measure = np.array([[0, 2], [2, 0]]), np.array([[1, 3], [1, 3]])
    both = Pattern.from_tables(drive, measure)
    match = match_rows(both, drive[::-1], measure)
    np.testing.assert_array_equal(match.apply(np.array([5.0, 7.0])), [7.0, 5.0])
    once = Pattern.from_tables(drive[:1], measure[:1, ::-1])
    np.testing.assert_array_equal(
        match_rows(once, drive, measure).apply(np.array([5.0, 7.0])), [-5.0]
    )


def trigonometric(n: int) -> FloatArray:
    """(n − 1, n) currents that span all that sum to zero."""
    angle = 2.0 * np.pi * np.arange(n) / n
    waves = [f(k * angle) for k in range(1, n // 2 + 1) for f in (np.cos, np.sin)]
    return 3e-4 * np.array(waves[: n - 1])


def test_currents_into_many_electrodes_are_summed_to_pairs() -> None:
    n, pairs = 8, [[(e + 1) % 8, e] for e in range(8)]
    driven = Pattern.from_pairs(n, trigonometric(n), pairs, include_driven=True)
    potentials = driven.currents @ resistance(n)
    plus, minus = driven.measure.T
    read = potentials[driven.drive_index, plus] - potentials[driven.drive_index, minus]
    for pattern in (Pattern.adjacent(n), Pattern.opposite(n)):
        sums = sum_rows(pattern, driven.drive, driven.measure)
        own = voltages(pattern.drive, pattern.measure, n)
        assert sums.apply(np.stack([read, -read])) == pytest.approx(np.stack([own, -own]))


def test_currents_that_do_not_suffice_are_refused_by_the_rows_that_they_lack() -> None:
    pairs = [[e, (e + 1) % 8] for e in range(8)]
    few = Pattern.from_pairs(8, trigonometric(8)[:5], pairs, include_driven=True)
    with pytest.raises(PatternError, match="40 of 40 rows are not in the recording: row 0: source"):
        sum_rows(Pattern.adjacent(8), few.drive, few.measure)
    unread = Pattern.from_pairs(8, trigonometric(8), pairs[1:], include_driven=True)
    with pytest.raises(PatternError, match=r"5 of 40 rows .* plus E1, minus E2"):
        sum_rows(Pattern.adjacent(8), unread.drive, unread.measure)
