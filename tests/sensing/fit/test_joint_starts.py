"""Touches that are looked for together."""

from __future__ import annotations

import numpy as np
import pytest

from sensing.fit.scene import noise
from sensing.fit.test_finder import data, finder, model, press
from sensing.fit.test_table import whitened
from tomoskin.core import FloatArray
from tomoskin.sensing.fit.candidates import JointStarts

THREE = np.concatenate(
    [press(*at, depth=-0.1) for at in ((-0.05, 0.03), (0.0, 0.03), (0.05, -0.04))]
)
NOTHING = np.zeros((208, 0))


def starts(spots: FloatArray, sign: str = "decrease") -> JointStarts:
    seen = whitened(model().solver)
    volts = seen.matrix[: seen.narrow] @ (data(spots) + noise(16, 1, 1)[0])
    return JointStarts.of(model().candidates.matched(seen), volts, model().prior, sign)


def missed(found: FloatArray, spots: FloatArray) -> float:
    """Of the touch that is farthest from all that was found, m."""
    return float(np.linalg.norm(spots[:, None, :2] - found[:, :2], axis=2).min(axis=1).max())


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_first_sets_hold_the_touches(count: int) -> None:
    found = starts(THREE[:count]).sets(count, 3)
    assert all(len(each) == count for each in found)
    assert min(missed(each, THREE[:count]) for each in found) < 0.015


def test_sets_differ_from_each_other() -> None:
    found = starts(THREE).sets(3, 5)
    assert len(found) == 5
    for number, one in enumerate(found):
        for other in found[:number]:
            assert max(missed(one, other), missed(other, one)) > model().prior.radius


def test_only_the_sign_that_counts() -> None:
    found = starts(THREE[:2]).sets(2, 4)
    assert all((each[:, 3] < 0).all() for each in found)
    assert starts(THREE[:2], "increase").sets(2, 4) == [] or all(
        (each[:, 3] > 0).all() for each in starts(THREE[:2], "increase").sets(2, 4)
    )


def test_three_close_together_are_three() -> None:
    """At half a radius of the sheet from each other, where one after the other may end between."""
    at = ((0.0, 0.0), (0.05, 0.0), (0.025, 0.05))
    near = np.concatenate([press(*place, radius=0.016, depth=-0.4) for place in at])
    for n in noise(16, 3, 4):
        found = finder().push(data(near) + n, NOTHING)
        assert len(found) == 3
        assert missed(np.array([[d.x, d.y] for d in found]), near) < 0.015
