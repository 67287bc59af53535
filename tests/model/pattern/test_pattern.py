"""The table of drives and measurements: order, signs, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import PatternError
from tomoskin.model.pattern import Pattern, named
from tomoskin.model.pattern.pattern import NAMED

counts = st.integers(4, 24)


def rows(pattern: Pattern) -> list[tuple[int, ...]]:
    return [tuple(r) for r in np.hstack([pattern.drive, pattern.measure]).tolist()]


def test_adjacent_by_hand() -> None:
    """Source, sink, plus, minus; pairs ascend from electrode 0."""
    assert rows(Pattern.adjacent(4)) == [
        (1, 0, 2, 3),
        (2, 1, 3, 0),
        (3, 2, 0, 1),
        (0, 3, 1, 2),
    ]
    assert rows(Pattern.adjacent(5))[:4] == [(1, 0, 2, 3), (1, 0, 3, 4), (2, 1, 3, 4), (2, 1, 4, 0)]


@given(counts)
def test_adjacent_leaves_out_what_touches_the_drive(n: int) -> None:
    pattern = Pattern.adjacent(n)
    assert pattern.n_meas == n * (n - 3)
    assert pattern.n_drive == n
    for drive, measure in zip(pattern.drive.tolist(), pattern.measure.tolist(), strict=True):
        assert not set(drive) & set(measure)
        assert drive[0] == (drive[1] + 1) % n
        assert measure[1] == (measure[0] + 1) % n


@given(counts)
def test_including_driven_electrodes_gives_every_pair(n: int) -> None:
    pattern = Pattern.adjacent(n, include_driven=True)
    assert pattern.n_meas == n * n
    assert set(rows(Pattern.adjacent(n))) < set(rows(pattern))


@given(counts, st.data())
def test_skip(n: int, data: st.DataObject) -> None:
    k = data.draw(st.integers(0, n - 2).filter(lambda k: 2 * (k + 1) != n))
    pattern = Pattern.skip(n, k)
    assert pattern.drives.tolist() == [[(i + k + 1) % n, i] for i in range(n)]
    per_drive = n - 3 if k in (0, n - 2) else n - 4
    assert pattern.n_meas == n * per_drive


@given(st.integers(3, 12).map(lambda half: 2 * half))
def test_opposite(n: int) -> None:
    pattern = Pattern.opposite(n)
    assert pattern.drives.tolist() == [[i + n // 2, i] for i in range(n // 2)]
    assert pattern.n_meas == n // 2 * (n - 4)


@given(counts)
def test_all_pairs(n: int) -> None:
    pattern = Pattern.all_pairs(n, include_driven=True)
    assert pattern.n_drive == n * (n - 1) // 2
    assert {tuple(d) for d in pattern.drives.tolist()} == {
        (b, a) for a in range(n) for b in range(a + 1, n)
    }


@given(counts)
def test_rows_are_ordered_by_drive_then_by_pair(n: int) -> None:
    for pattern in (Pattern.adjacent(n), Pattern.all_pairs(n, include_driven=True)):
        order = np.lexsort((pattern.measure[:, 0], pattern.drive_index))
        assert np.array_equal(order, np.arange(pattern.n_meas))


@given(counts)
def test_tables_give_the_pattern_back(n: int) -> None:
    pattern = Pattern.adjacent(n)
    again = Pattern.from_tables(pattern.drive, pattern.measure)
    assert again.identity == pattern.identity
    assert np.array_equal(again.drives, pattern.drives)
    assert np.array_equal(again.drive_index, pattern.drive_index)


@given(st.randoms())
def test_tables_keep_their_order(random: Any) -> None:
    table = rows(Pattern.adjacent(8))
    random.shuffle(table)
    drive = [r[:2] for r in table]
    pattern = Pattern.from_tables(drive, [r[2:] for r in table])
    assert rows(pattern) == table
    assert [tuple(d) for d in pattern.drives.tolist()] == list(dict.fromkeys(drive))


def test_identity_tells_order_sign_and_count_apart() -> None:
    drive, measure = [[1, 0], [1, 0]], [[2, 3], [3, 4]]
    variants = [
        Pattern.from_tables(drive, measure),
        Pattern.from_tables(drive, measure, 6),
        Pattern.from_tables(drive, measure[::-1]),
        Pattern.from_tables([[0, 1], [0, 1]], measure),
        Pattern.from_tables(drive, [[3, 2], [3, 4]]),
    ]
    assert len({p.identity for p in variants}) == len(variants)


def test_tables_cannot_be_written() -> None:
    pattern = Pattern.adjacent(8)
    for table in (pattern.drives, pattern.drive_index, pattern.measure):
        with pytest.raises(ValueError, match="read-only"):
            table[0] = 0


@pytest.mark.parametrize("name", NAMED)
def test_named(name: str) -> None:
    assert named(name, 8).identity == NAMED[name](8).identity
    assert named(f" {name} ", 8).identity == NAMED[name](8).identity


def test_named_skip() -> None:
    assert named("skip:2", 16).identity == Pattern.skip(16, 2).identity


@pytest.mark.parametrize(
    "names", ["adjacent+opposite", "adjacent+all_pairs", "skip:1+skip:2+opposite", "skip:1+skip:5"]
)
def test_a_mixture_measures_each_thing_once(names: str) -> None:
    mixed = named(names, 8)
    parts = [named(name, 8) for name in names.split("+")]
    assert rows(mixed)[: parts[0].n_meas] == rows(parts[0])
    seen = {undirected(r) for r in rows(mixed)}
    assert len(seen) == mixed.n_meas
    assert seen == {undirected(r) for part in parts for r in rows(part)}


def undirected(row: tuple[int, ...]) -> tuple[frozenset[int], frozenset[int]]:
    return frozenset(row[:2]), frozenset(row[2:])


@pytest.mark.parametrize("name", ["", "neighbouring", "skip", "skip:", "skip:-1", "adjacent+", "+"])
def test_unknown_name_lists_the_known_ones(name: str) -> None:
    with pytest.raises(PatternError, match="among adjacent, opposite, all_pairs"):
        named(name, 8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pattern.adjacent(3), "at least 4 electrodes, got 3"),
        (lambda: Pattern.opposite(4), "every measuring pair touches a driven electrode"),
        (lambda: Pattern.opposite(7), "an even number of electrodes, got 7"),
        (lambda: Pattern.skip(8, 7), "expected k from 0 to 6"),
        (lambda: Pattern.skip(8, -1), "expected k from 0 to 6"),
        (lambda: Pattern.skip(8, 3), "drives every pair twice.*opposite"),
        (lambda: Pattern.from_tables([[0, 1]], [[2, 3], [3, 4]]), "as many drive rows.*1 and 2"),
        (lambda: Pattern.from_tables([], []), "expected a drive table"),
        (lambda: Pattern.from_tables([0, 1], [2, 3]), "expected a drive table"),
        (lambda: Pattern.from_tables([[0, 1, 2]], [[2, 3]]), "expected a drive table"),
        (lambda: Pattern.from_tables([[0, 1]], [[2, 3.5]]), "whole electrode numbers.*measure"),
        (lambda: Pattern.from_tables([[0, 1]], [[2, np.nan]]), "whole electrode numbers.*measure"),
        (lambda: Pattern(4, [[0, 1]], [0, 0], [[2, 3]]), "one drive for each of 1 rows, got 2"),
    ],
)
def test_refused(make: Callable[[], Pattern], message: str) -> None:
    with pytest.raises(PatternError, match=message):
        make()


@pytest.mark.parametrize(
    ("change", "where", "message"),
    [
        ({"drive": [5, 5]}, "drive row 2", "source and sink are both E6"),
        ({"measure": [7, 7]}, "measurement row 2", "plus and minus are both E8"),
        ({"drive": [9, 0]}, "drive row 2", r"expected electrodes from 0 \(E1\) to 7, got \[9, 0\]"),
        ({"measure": [2, -1]}, "measurement row 2", r"expected electrodes from 0 \(E1\) to 7"),
    ],
)
def test_refused_rows_are_named(change: dict[str, Any], where: str, message: str) -> None:
    good = Pattern.adjacent(8)
    tables = {"drive": good.drive.copy(), "measure": good.measure.copy()}
    for key, row in change.items():
        tables[key][2] = row
    with pytest.raises(PatternError, match=message) as caught:
        Pattern.from_tables(tables["drive"], tables["measure"], 8)
    assert caught.value.where == where


@pytest.mark.parametrize("flip", [1, -1])
def test_a_row_that_stands_twice_is_named(flip: int) -> None:
    drive, measure = [[1, 0], [2, 1], [1, 0]], [[2, 3], [3, 0], [2, 3][::flip]]
    with pytest.raises(PatternError, match="rows 0 and 2 measure the same pair"):
        Pattern.from_tables(drive, measure)


def test_a_drive_that_does_not_exist() -> None:
    with pytest.raises(PatternError, match="expected a drive from 0 to 0, got 1") as caught:
        Pattern(5, [[1, 0]], [0, 1], [[2, 3], [3, 4]])  # type: ignore[arg-type]
    assert caught.value.where == "measurement row 1"


@pytest.mark.parametrize("electrode", range(8))
def test_rows_of_an_electrode_are_those_that_drive_or_read_it(electrode: int) -> None:
    pattern = Pattern.adjacent(8)
    rows = pattern.rows_of(electrode)
    assert len(rows) == 2 * 5 + 2 * 5  # two drives with five pairs; two pairs in five drives each
    used = np.hstack([pattern.drive, pattern.measure])
    assert (used[rows] == electrode).any(axis=1).all()
    assert not (np.delete(used, rows, axis=0) == electrode).any()


@pytest.mark.parametrize("electrode", [-1, 8])
def test_rows_of_an_electrode_that_does_not_exist(electrode: int) -> None:
    with pytest.raises(
        PatternError, match=rf"expected an electrode from 0 \(E1\) to 7, got {electrode}"
    ):
        Pattern.adjacent(8).rows_of(electrode)
