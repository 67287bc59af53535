"""States and flags of frames, learnt from examples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tomoskin.core import DataError, FloatArray
from tomoskin.extras.classes import Classifier, Codes, Examples, against_rest
from tomoskin.model.pattern import Pattern

ROWS = 40
NAMES = ("bend", "idle", "touch")


def sheet(seed: int, flags: FloatArray, size: float = 1.0, turn: float = 0.0) -> FloatArray:
    """Frames of flags (n, f): a template for each that a session turns a little, and noise."""
    fixed = np.random.default_rng(99).normal(size=(flags.shape[1], ROWS))
    rng = np.random.default_rng(seed)
    templates = size * (fixed + turn * rng.normal(size=fixed.shape))
    shift = turn * rng.normal(size=ROWS)
    return np.asarray(shift + flags @ templates + 0.3 * rng.normal(size=(len(flags), ROWS)))


def random_flags(n: int, f: int, seed: int) -> FloatArray:
    return np.random.default_rng(seed).integers(0, 2, (n, f)).astype(float)


def one_of(n: int, seed: int) -> tuple[FloatArray, list[str]]:
    number = np.arange(n) % len(NAMES)
    number = np.random.default_rng(seed).permutation(number)
    return np.eye(len(NAMES))[number], [NAMES[k] for k in number]


def hit(told: FloatArray, truth: FloatArray) -> float:
    return float((told == truth).all(axis=1).mean())


@pytest.mark.parametrize("each", [3, 10, 50])
def test_classes_are_told_from_few_examples(each: int) -> None:
    flags, labels = one_of(3 * each, 0)
    known = Classifier.fit(sheet(0, flags), labels)
    asked, names = one_of(90, 1)
    answers = known.predict(sheet(1, asked))
    assert known.examples.codes.names == NAMES
    assert np.mean([a == b for a, b in zip(answers.label, names, strict=True)]) > 0.97
    assert answers.rejected.mean() < 0.1
    np.testing.assert_allclose(answers.each.sum(axis=1), 1)
    assert (answers.probability == answers.each.max(axis=1)).all()


def test_an_unknown_state_is_rejected() -> None:
    flags, labels = one_of(60, 0)
    known = Classifier.fit(sheet(0, flags), labels)
    strange = 3 * np.random.default_rng(5).normal(size=(30, ROWS))
    assert known.predict(strange).rejected.mean() > 0.9
    assert known.predict(np.full((1, ROWS), np.nan)).rejected.all()


def test_any_set_of_flags_is_told() -> None:
    flags = random_flags(200, 5, 0)
    known = Classifier.fit(sheet(0, flags), flags, names=tuple("abcde"))
    asked = random_flags(200, 5, 1)
    answers = known.predict(sheet(1, asked))
    assert hit(answers.flags, asked) > 0.97
    assert known.right > 0.95
    row = int(np.argmax(asked.sum(axis=1) == 2))
    told = [n for n, on in zip("abcde", asked[row], strict=True) if on]
    assert answers.label[row] == "+".join(told)
    np.testing.assert_allclose(answers.each[row], asked[row], atol=0.2)


def test_another_session_is_fitted_without_labels() -> None:
    """Half as large again, with other templates: what was learnt before is right in part only."""
    flags, asked = random_flags(300, 4, 0), random_flags(300, 4, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    today = sheet(2, asked, size=0.5, turn=0.5)
    before, fitted = known.predict(today), known.in_session(today)
    after = fitted.predict(today)
    assert hit(before.flags, asked) < 0.7
    assert hit(after.flags, asked) > 0.95
    assert after.rejected.mean() < 0.05
    assert len(fitted.examples) == 600


def test_labels_of_a_new_session_count() -> None:
    flags, asked = random_flags(200, 4, 0), random_flags(120, 4, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    today = sheet(3, asked, size=0.5, turn=0.6)
    fitted = known.in_session(today)
    some = np.full(asked.shape, np.nan)
    chosen = np.arange(6, 120, 12)
    some[chosen] = asked[chosen]
    told = known.in_session(today, some).predict(today)
    assert hit(told.flags, asked) >= hit(fitted.predict(today).flags, asked)
    everything = known.in_session(today, asked)
    assert hit(everything.predict(today).flags, asked) > 0.95


def test_two_sessions_teach_together() -> None:
    flags = random_flags(100, 3, 0)
    known = Classifier.fit(sheet(0, flags), flags)
    both = known.in_session(sheet(4, flags, turn=0.3), flags)
    assert both.examples.session.tolist() == [0] * 100 + [1] * 100
    assert hit(both.predict(sheet(4, flags, turn=0.3)).flags, flags) > 0.95


@settings(max_examples=20)
@given(st.integers(0, 2**16))
def test_the_unit_and_missing_values_do_not_matter(seed: int) -> None:
    flags = random_flags(60, 2, 0)
    dv = sheet(seed, flags)
    asked = dv.copy()
    asked[:, 7] = np.nan
    small = Classifier.fit(1e-6 * dv, flags).predict(1e-6 * asked)
    large = Classifier.fit(dv, flags).predict(asked)
    np.testing.assert_array_equal(small.flags, large.flags)
    np.testing.assert_allclose(small.probability, large.probability, atol=1e-6)


def test_probabilities_are_honest() -> None:
    flags = random_flags(400, 3, 0)
    hard = 4.0 * np.random.default_rng(1).normal(size=(400, ROWS)) + 1.0 * sheet(0, flags)
    known = Classifier.fit(hard, flags)
    asked = random_flags(400, 3, 2)
    more = 4.0 * np.random.default_rng(3).normal(size=(400, ROWS)) + 1.0 * sheet(0, asked)
    answers = known.predict(more)
    right = (answers.flags == asked).all(axis=1)
    assert abs(answers.probability.mean() - right.mean()) < 0.1
    assert abs(known.right - right.mean()) < 0.1


def test_frames_at_rest_share_their_noise() -> None:
    rng = np.random.default_rng(0)
    level = 5 + np.cumsum(0.02 * rng.normal(size=(400, ROWS)), axis=0)
    rest, pressed = (level + rng.normal(size=level.shape) for _ in range(2))
    plain, better = pressed - rest, against_rest(pressed, rest)
    assert better.std() < 0.78 * plain.std()
    np.testing.assert_array_equal(against_rest(level[:2], level[:2]), 0)
    jumps = np.cumsum(rng.normal(size=(50, ROWS)), axis=0)
    assert against_rest(jumps, jumps).std() < 0.5  # nothing to average: each has its own


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (["a"] * 6, 'two classes, got only "a"'),
        (["a"] * 5 + ["b"], "at least 3 labelled frames with b"),
        (["a"] * 4 + ["b"] * 3, "flags of shape"),
        (np.full((6, 2), 0.5), "expected 0 or 1"),
        (np.zeros((6, 12)), "1 to 10 flags"),
        (np.zeros((6, 1, 1)), "1 to 10 flags, got 0"),
        (np.ones((6, 2)), "labelled frames without 1, got 0"),
        (np.full((6, 2), np.nan), "got none"),
    ],
)
def test_what_cannot_teach_is_refused(labels: object, words: str) -> None:
    with pytest.raises(DataError, match=words):
        Classifier.fit(np.random.default_rng(0).normal(size=(6, ROWS)), labels)  # type: ignore[arg-type]


def test_what_does_not_belong_together_is_refused() -> None:
    flags = random_flags(20, 2, 0)
    dv = sheet(0, flags)
    known = Classifier.fit(dv, flags)
    with pytest.raises(DataError, match="shape"):
        known.predict(dv[:, :5])
    with pytest.raises(DataError, match="at least 10 frames"):
        known.in_session(dv[:5])
    with pytest.raises(DataError, match="frames that are all the same"):
        Classifier.fit(np.ones((20, ROWS)), flags)
    with pytest.raises(DataError, match="twice"):
        Codes(("a", "a"), exclusive=False)
    with pytest.raises(DataError, match="unknown state c"):
        Codes(("a", "b"), exclusive=True).flags_of(["a", "c"])
    with pytest.raises(DataError, match="finite untouched"):
        against_rest(dv, dv[:5])
    examples = known.examples
    with pytest.raises(DataError, match="expected the classes"):
        examples.and_then(replace(examples, codes=Codes(("x", "y"), exclusive=False)))
    with pytest.raises(DataError, match="rows"):
        examples.and_then(Examples.checked(examples.codes, dv[:, :5], flags))
    pattern = Pattern.adjacent(8)
    with pytest.raises(DataError, match="dv of shape"):
        Classifier.fit(dv[:, :39], flags, pattern=pattern)


@pytest.mark.data
@pytest.mark.parametrize(("old", "new"), [(1, 2), (2, 1)])
def test_six_points_on_another_day(data_dir: Path, old: int, new: int) -> None:
    """All six flags of a public membrane, another day and depth, without a label of that day."""
    (learnt, flags), (asked, truth) = (six_points(data_dir, number) for number in (old, new))
    known = Classifier.fit(learnt, flags)
    assert hit(known.predict(asked).flags, truth) < 0.6
    answers = known.in_session(asked).predict(asked)
    assert hit(answers.flags, truth) > 0.85
    assert abs(answers.probability.mean() - hit(answers.flags, truth)) < 0.06
    assert answers.rejected.mean() < 0.06


def six_points(data_dir: Path, number: int) -> tuple[FloatArray, FloatArray]:
    """Changes (n, 210): the eight rows that a reading stands in are averaged."""
    with np.load(data_dir / "eskin_membrane8_sixpoint" / f"batch{number}.npz") as kept:
        pairs = np.sort(np.stack([kept["inj"], kept["meas"]], axis=1), axis=2) @ [8, 1]
        _, reading = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
        mean = np.eye(reading.max() + 1)[reading.ravel()] / 8
        before, after = (kept[key].astype(float) @ mean for key in ("rms_before", "rms_after"))
        return against_rest(after, before), kept["pressed"].astype(float)


def test_a_session_whose_names_cannot_be_carried_over_is_said_to_be_so() -> None:
    """Every response has another sign: without labels each flag would be named by its opposite."""
    flags, asked = random_flags(300, 4, 0), random_flags(300, 4, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    today = -sheet(2, asked)
    lost = known.in_session(today)
    answers = lost.predict(today)
    assert lost.alignment is not None
    assert not lost.alignment.holds
    assert "untouched frame would have flags set" in lost.alignment.text
    assert answers.rejected.all()
    assert answers.probability.max() < 0.1
    np.testing.assert_array_equal(answers.flags, known.predict(today).flags)


def test_ten_labels_mend_a_session_that_cannot_be_aligned() -> None:
    flags, asked = random_flags(300, 4, 0), random_flags(300, 4, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    today = np.roll(sheet(2, asked), 7, axis=1)  # the rows of another electrode order
    assert hit(known.in_session(today).predict(today).flags, asked) < 0.3
    some = np.full(asked.shape, np.nan)
    some[:10] = asked[:10]
    mended = known.in_session(today, some)
    answers = mended.predict(today)
    assert mended.alignment is not None
    assert mended.alignment.holds
    assert hit(answers.flags, asked) > 0.9
    assert abs(answers.probability.mean() - hit(answers.flags, asked)) < 0.1


def test_what_is_said_after_ten_labels_is_right_as_often() -> None:
    """A day that has little in common with the one before, and whose classes are well apart."""
    flags, asked = random_flags(300, 6, 0), random_flags(150, 6, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    for seed in range(3):
        today = np.roll(sheet(2 + seed, asked, size=0.7), 7, axis=1)
        some = np.full(asked.shape, np.nan)
        some[:10] = asked[:10]
        answers = known.in_session(today, some).predict(today[10:])
        right = hit(answers.flags, asked[10:])
        assert answers.rejected.all() or abs(answers.probability.mean() - right) < 0.1


def test_classes_of_which_one_holds_are_named_by_labels() -> None:
    flags, _ = one_of(150, 0)
    known = Classifier.fit(sheet(0, flags), [NAMES[k] for k in flags.argmax(axis=1)])
    asked, names = one_of(150, 1)
    today = np.roll(sheet(1, asked), 11, axis=1)
    some = np.full(asked.shape, np.nan)
    some[:10] = asked[:10]
    told = known.in_session(today, some).predict(today).label
    assert np.mean([a == b for a, b in zip(told, names, strict=True)]) > 0.9


def test_a_session_that_aligns_says_how_sure_that_is() -> None:
    flags, asked = random_flags(300, 4, 0), random_flags(300, 4, 1)
    known = Classifier.fit(sheet(0, flags), flags)
    fitted = known.in_session(sheet(2, asked, size=0.5, turn=0.4))
    assert known.alignment is None
    assert fitted.alignment is not None
    assert fitted.alignment.holds
    assert fitted.alignment.reliability > 0.9
    assert 0.3 < fitted.alignment.grown < 0.8
    assert "aligned" in fitted.alignment.text


@pytest.mark.data
def test_six_points_whose_rows_are_those_of_other_electrodes(data_dir: Path) -> None:
    """Turned by half a round, nothing fits: it is said, and ten labels are enough."""
    (learnt, flags), (asked, truth) = (six_points(data_dir, number) for number in (1, 2))
    today = turned_by_four(data_dir, asked)
    known = Classifier.fit(learnt, flags)
    lost = known.in_session(today)
    assert lost.alignment is not None
    assert not lost.alignment.holds
    assert lost.predict(today).rejected.all()
    some = np.full(truth.shape, np.nan)
    chosen = np.random.default_rng(0).permutation(len(truth))[:10]
    some[chosen] = truth[chosen]
    answers = known.in_session(today, some).predict(today)
    rest = np.setdiff1d(np.arange(len(truth)), chosen)
    assert hit(answers.flags[rest], truth[rest]) > 0.8
    assert abs(answers.probability.mean() - hit(answers.flags[rest], truth[rest])) < 0.1


def turned_by_four(data_dir: Path, dv: FloatArray) -> FloatArray:
    """Readings (n, 210) as if each electrode stood where the opposite one was."""
    with np.load(data_dir / "eskin_membrane8_sixpoint" / "batch1.npz") as kept:
        pairs = np.sort(np.stack([kept["inj"], kept["meas"]], axis=1), axis=2) @ [8, 1]
    codes = np.unique(np.sort(pairs, axis=1), axis=0)
    electrodes = (np.stack([codes // 8, codes % 8], axis=-1) + 4) % 8
    turned = np.sort(np.sort(electrodes, axis=2) @ [8, 1], axis=1)
    row = {tuple(code): k for k, code in enumerate(codes.tolist())}
    out = np.empty_like(dv)
    out[:, [row[tuple(code)] for code in turned.tolist()]] = dv
    return out
