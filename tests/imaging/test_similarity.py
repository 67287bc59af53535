"""Structural similarity of masks."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.imaging import SimilarityWindows

WINDOWS = SimilarityWindows.of(64, 20.0)


def square(row: int, column: int) -> np.ndarray:
    mask = np.zeros((64, 64), bool)
    mask[row : row + 14, column : column + 14] = True
    return mask


def test_a_mask_is_like_itself_and_less_like_what_is_farther_away() -> None:
    means = [WINDOWS.similarity(square(20, 20), square(20, 20 + by)).mean() for by in (0, 2, 8, 25)]
    assert means[0] == pytest.approx(1.0)
    assert means == sorted(means, reverse=True)
    assert means[3] < 0.3


def test_it_is_symmetric_and_nothing_is_like_nothing() -> None:
    one, other = square(20, 20), square(30, 25)
    assert WINDOWS.similarity(one, other) == pytest.approx(WINDOWS.similarity(other, one))
    assert WINDOWS.similarity(one & False, one & False) == pytest.approx(1.0)


def test_windows_weigh_the_mean() -> None:
    assert WINDOWS.weights.sum(axis=1) == pytest.approx(1.0)
    assert WINDOWS.mean(np.full((64, 64), 0.3)) == pytest.approx(0.3)
