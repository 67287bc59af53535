"""What stands for the exact model live: the interaction of spots, and how wrong that may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from sensing.fit.test_finder import model, press
from sensing.fit.test_table import by_table, problem
from tomoskin.core import FloatArray
from tomoskin.sensing.fit import LIVE
from tomoskin.sensing.fit.certificate import drawn_spots
from tomoskin.sensing.fit.problem import Problem
from tomoskin.sensing.fit.spot_fit import Deficit, Fit

APART = np.concatenate([press(-0.045, 0.0, 0.018, -0.15), press(0.045, 0.0, 0.018, -0.15)])
STRONG = np.concatenate([press(-0.02, 0.0, 0.025, -1.5), press(0.025, 0.0, 0.025, -1.5)])


def beyond(spots: FloatArray) -> FloatArray:
    """(n_meas,) V that spots do to each other, by the exact model."""
    changes = model().response.changes([spots, *spots[:, None]])
    return np.asarray(changes[0] - changes[1:].sum(axis=0))


def fitted(spots: FloatArray) -> tuple[Problem, Fit]:
    """A frame with these spots, by the table alone."""
    frame = problem(model().solver, spots, 0.0)
    return frame, frame.refined(spots, Deficit.none(len(frame.solver.table.basis)), 2)


def live(frame: Problem, fit: Fit) -> Fit:
    return frame.corrected(fit, LIVE, LIVE.closing)


@pytest.mark.parametrize(("apart", "most"), [(0.045, 0.3), (0.07, 0.2)])
def test_the_interaction_is_nearly_what_the_exact_model_has(apart: float, most: float) -> None:
    for turn in (0.0, 1.0, 2.0):
        x, y = apart / 2 * float(np.cos(turn)), apart / 2 * float(np.sin(turn))
        spots = np.concatenate([press(-x, -y, 0.016, -0.4), press(x, y, 0.022, -0.2)])
        exact, ours = beyond(spots), model().reduced.interaction.change(spots)
        assert np.linalg.norm(ours - exact) < most * np.linalg.norm(exact)


def test_three_interact_as_pairs_do_whatever_their_order() -> None:
    three = np.concatenate([APART, press(0.0, 0.05)])
    change = model().reduced.interaction.change
    pairs = sum(change(three[[i, j]]) for i, j in ((0, 1), (0, 2), (1, 2)))
    together = change(three)
    size = np.abs(together).max()
    np.testing.assert_allclose(together, pairs, atol=1e-5 * size)
    np.testing.assert_allclose(change(three[::-1]), together, atol=1e-5 * size)
    assert not change(three[:1]).any()


def test_no_more_is_wrong_than_is_certified() -> None:
    ours = model()
    spots = drawn_spots(np.random.default_rng(3), ours.response, ours.prior, "decrease", 80)
    exact = ours.response.changes(list(spots[:, None]))
    sizes = np.linalg.norm(exact, axis=1)
    errors = np.linalg.norm(by_table(spots)[:, 0] - exact, axis=1)
    said = np.array(
        [
            ours.reduced.lacking(spot[None], size[None])[0]
            for spot, size in zip(spots, sizes, strict=True)
        ]
    )
    assert np.mean(errors <= said) >= 0.9
    assert np.median(said) < 6 * np.median(errors), "and not for want of saying much"


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_the_native_engine_says_what_numpy_does(count: int) -> None:
    ours, random = model(), np.random.default_rng(5)
    reduced = ours.reduced
    for _ in range(5):
        spots = drawn_spots(random, ours.response, ours.prior, "decrease", count)
        sizes = random.uniform(1.0, 50.0, count)
        alone, change = reduced.lacking(spots, sizes)
        assert alone == pytest.approx(reduced.certificate.error(reduced.rim.like(spots), sizes))
        other = reduced.interaction.change(spots)
        np.testing.assert_allclose(change, other, atol=1e-5 * np.abs(other).max())


def test_a_live_frame_asks_the_exact_model_where_more_may_be_wrong() -> None:
    asked: list[int] = []

    def counted(sets: Sequence[FloatArray]) -> FloatArray:
        asked.append(len(sets))
        return model().response.changes(sets)

    for spots, often in ((APART, 0), (STRONG, 1)):
        frame, fit = fitted(spots)
        asked.clear()
        found = live(replace(frame, exact=counted), fit)
        assert len(asked) == often
        table = by_table(found.spots)[:, 0].sum(axis=0)
        exact = model().response.changes([found.spots])[0] - table
        lacking = found.deficit.change @ frame.solver.table.basis
        wrong = np.linalg.norm(frame.seen.full @ (lacking - exact))
        # of an exact one the spots have moved by two steps since
        allowed = LIVE.tolerance * np.sqrt(len(frame.seen.full))
        assert wrong < (3 if often else 1) * allowed


def test_near_the_rim_a_place_is_doubted_towards_the_middle_and_outwards() -> None:
    rim = model().reduced.rim
    radius, size = 0.02, float(np.abs(rim.tree.data).max())
    middle, near, at = (rim.doubt(x, 0.0, radius) for x in (0.0, 0.75 * size, 0.9 * size))
    assert np.sqrt(np.trace(middle)) < 1e-4
    assert np.trace(middle) < np.trace(near) < np.trace(at)
    across, along = np.linalg.eigh(at)[0]
    assert across < 1e-12 < along
    assert abs(np.linalg.eigh(at)[1][0, 1]) > 0.99  # along the way to the rim
