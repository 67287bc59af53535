"""Frames with holes: what can be used becomes images, what cannot is named."""

from __future__ import annotations

import numpy as np
import pytest

from golden import mismatch
from shapes import disc
from tomoskin.core import DataError, FloatArray
from tomoskin.imaging import OneStep, image_series
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

PATTERN = Pattern.adjacent(8)
OPERATOR = OneStep(ForwardModel(disc(8), PATTERN, 0.01), "laplace", alpha=0.05)


@pytest.fixture
def changes() -> FloatArray:
    return np.random.default_rng(0).standard_normal((10, 40))


def test_whole_frames_are_the_operators_images(changes: FloatArray) -> None:
    found = image_series(OPERATOR, changes, PATTERN)
    assert found.report == ""
    for frame in range(10):
        image, expected = found.image(frame), OPERATOR(changes[frame])
        assert mismatch(image.values, expected.values) < 1e-12
        assert (image.unit, image.mesh_id) == (expected.unit, expected.mesh_id)


def test_a_dead_channel_leaves_every_frame_and_is_named(changes: FloatArray) -> None:
    changes[:, 17] = np.nan
    changes[:6, 4] = np.inf
    found = image_series(OPERATOR, changes, PATTERN)
    assert found.dropped.tolist() == [4, 17]
    assert found.left_out[:, [4, 17]].all()
    assert found.left_out.sum() == 20
    assert found.report == f"rows left out: {PATTERN.row_text(4)}; {PATTERN.row_text(17)}"
    expected = OPERATOR.without([4, 17])
    for frame in range(10):
        assert mismatch(found.values[frame], expected(changes[frame]).values) < 1e-12


def test_a_row_that_is_railed_in_one_frame_is_left_out_of_that_one(changes: FloatArray) -> None:
    railed = np.zeros(changes.shape, bool)
    railed[3, [5, 6]] = True
    found = image_series(OPERATOR, changes, PATTERN, railed)
    assert found.report == "1 frames lack further rows"
    assert np.array_equal(found.left_out, railed)
    assert mismatch(found.values[3], OPERATOR.without([5, 6])(changes[3]).values) < 1e-10
    assert mismatch(found.values[2], OPERATOR(changes[2]).values) < 1e-12


def test_a_frame_that_lacks_too_much_gives_no_image(changes: FloatArray) -> None:
    changes[2, :11] = np.nan
    changes[4, :10] = np.nan
    found = image_series(OPERATOR, changes, PATTERN)
    assert found.frames.tolist() == [0, 1, 3, 4, 5, 6, 7, 8, 9]
    assert found.report == (
        "1 frames lack further rows; 1 frames lack too many rows and give no image"
    )
    assert mismatch(found.image(3).values, OPERATOR.without(range(10))(changes[4]).values) < 1e-9


def test_no_frame_with_rows_enough(changes: FloatArray) -> None:
    changes[:, :11] = np.nan
    with pytest.raises(
        DataError, match=r"no frame has 75% of its rows; most frames lack row 0: source"
    ):
        image_series(OPERATOR, changes, PATTERN)


def test_data_of_another_pattern_are_refused_by_identity(changes: FloatArray) -> None:
    """As many rows on as many electrodes, in another order or with one sign turned."""
    order = np.roll(np.arange(40), 1)
    turned = PATTERN.measure.copy()
    turned[5] = turned[5][::-1]
    for other in (
        Pattern.from_tables(PATTERN.drive[order], PATTERN.measure[order]),
        Pattern.from_tables(PATTERN.drive, turned),
    ):
        with pytest.raises(
            DataError, match=f"of pattern {PATTERN.identity} .* got {other.identity}"
        ):
            image_series(OPERATOR, changes, other)
    image_series(OPERATOR, changes, Pattern.from_tables(PATTERN.drive, PATTERN.measure))


@pytest.mark.parametrize("shape", [(40,), (3, 39), (0, 40)])
def test_changes_of_another_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(DataError, match=r"expected changes \(n_frames, 40\), got"):
        image_series(OPERATOR, np.zeros(shape), PATTERN)


def test_operators_that_differ_in_anything_have_identities_of_their_own() -> None:
    model = OPERATOR.model
    moved = ForwardModel(disc(8, 300), PATTERN, 0.01)
    made = [
        OPERATOR,
        OneStep(model, "laplace", alpha=0.06),
        OneStep(model, "laplace", alpha=0.05, difference="normalised"),
        OneStep(model, "noser", alpha=0.05),
        OneStep(moved, "laplace", alpha=0.05),
        OPERATOR.without([3]),
    ]
    assert len({operator.identity for operator in made}) == len(made)
    assert OneStep(model, "laplace", alpha=0.05).identity == OPERATOR.identity
