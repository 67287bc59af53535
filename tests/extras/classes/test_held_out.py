"""What a classifier says of itself comes from repetitions that it was not taught."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import FloatArray, IntArray
from tomoskin.extras.classes import Classifier, Codes, Examples
from tomoskin.extras.classes.held_out import folds_of, runs_of

ROWS, CLASSES = 40, 8


def repeated(
    seed: int, *, classes: IntArray | None = None, runs: int = 5, frames: int = 12
) -> tuple[FloatArray, list[str]]:
    """Each class held ``runs`` times for some frames; a repetition differs far more from the next
    than its frames from each other, as of a hand that makes a gesture again."""
    fixed = np.random.default_rng(99).normal(size=(CLASSES, 12)) @ MODES
    rng, chosen = np.random.default_rng(seed), np.arange(CLASSES) if classes is None else classes
    dv, labels = [], []
    for _ in range(runs):
        for number in rng.permutation(chosen):
            mean = fixed[number] + 0.8 * rng.normal(size=12) @ MODES
            dv.append(mean + 0.05 * rng.normal(size=(frames, ROWS)))
            labels += [str(number)] * frames
    return np.vstack(dv), labels


MODES = np.random.default_rng(98).normal(size=(12, ROWS))


def answered(seed: int, known: Classifier) -> tuple[float, float, float]:
    """Of another day: the part that is right, the mean probability, the part that is unknown."""
    dv, labels = repeated(seed)
    answers = known.predict(dv)
    right = np.mean([a == b for a, b in zip(answers.label, labels, strict=True)])
    return float(right), float(answers.probability.mean()), float(answers.rejected.mean())


def test_what_is_said_is_so_of_repetitions_that_were_not_taught() -> None:
    known = [Classifier.fit(*repeated(seed)) for seed in range(11, 19)]
    days = [answered(seed, one) for seed, one in zip(range(111, 119), known, strict=True)]
    right, said, unknown = np.mean(days, axis=0)
    held_out = np.mean([one.right for one in known])
    assert held_out == pytest.approx(right, abs=0.06)
    assert said == pytest.approx(right, abs=0.06)
    assert unknown < 0.1
    assert held_out < 0.97  # a neighbour in time would give every frame away


def test_classes_that_were_not_taught_are_noticed_about_as_often_as_is_said() -> None:
    taught, strange = np.arange(CLASSES - 2), np.arange(CLASSES - 2, CLASSES)
    said, found = [], []
    for seed in range(4):
        known = Classifier.fit(*repeated(seed, classes=taught))
        said.append(known.noticed)
        found.append(known.predict(repeated(seed + 100, classes=strange)[0]).rejected.mean())
    assert np.mean(said) == pytest.approx(np.mean(found), abs=0.25)


def test_no_run_is_both_taught_and_asked() -> None:
    labels = ["a"] * 4 + ["b"] * 3 + ["a"] * 5 + ["b"] * 3 + ["c"] * 6
    codes = Codes.of_labels(labels)
    examples = Examples.checked(codes, np.zeros((len(labels), 3)), codes.flags_of(labels))
    run = runs_of(examples)
    assert run.tolist() == [0] * 4 + [1] * 3 + [2] * 5 + [3] * 3 + [4] * 6
    fold = folds_of(codes.numbers(examples.flags), run)
    assert all(len(set(fold[run == number])) == 1 for number in range(4))
    assert fold[run == 0][0] != fold[run == 2][0]
    alone = fold[run == 4]  # the only run of its class is cut, in the order of time
    assert len(set(alone)) > 1
    assert (np.diff(alone) >= 0).all()
