"""The one picture to give when there are many: where the similarity expected of it is greatest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray

C1, C2 = 1e-4, 9e-4
"""Constants of the structural similarity, for pictures between 0 and 1."""

WINDOWS = 16
"""Windows along a side: far denser than they are wide."""

_THRESHOLDS = (0.15, 0.25, 0.35, 0.45, 0.55, 0.65)
"""Probabilities above which a pixel is in one of the first pictures."""

_CLIMBED, _ROUNDS = 2, 8
"""How many of the first pictures are improved, and how often at most."""


@dataclass(frozen=True, eq=False)
class SimilarityWindows:
    """Windows of the structural similarity (Wang et al. 2004), Gaussian and cut at two widths.

    Attributes
    ----------
    weights
        (m, n): what the pixels of a row count in each window; they sum to one.
    """

    weights: FloatArray

    @classmethod
    def of(cls, pixels: int, width: float, windows: int | None = None) -> SimilarityWindows:
        """Of a picture ``pixels`` wide; ``width`` is a standard deviation, in pixels.

        With as many windows along a side as are wanted; without, one around each pixel.
        """
        count = pixels if windows is None else windows
        at = (np.arange(count) + 0.5) / count * pixels - 0.5
        away = np.subtract.outer(at, np.arange(pixels)) / width
        weights = np.where(np.abs(away) <= 2.0, np.exp(-0.5 * away**2), 0.0)
        return cls(np.asarray(weights / weights.sum(axis=1, keepdims=True)))

    def mean(self, pictures: NDArray[np.floating]) -> FloatArray:
        """(…, m, m) mean in each window, of (…, n, n)."""
        return np.asarray(self.weights @ pictures @ self.weights.T)

    def similarity(self, one: NDArray[np.bool_], other: NDArray[np.bool_]) -> FloatArray:
        """(…, m, m) of masks (n, n) and (…, n, n)."""
        a, b = one.astype(np.float64), other.astype(np.float64)
        return _Terms.of(self.mean(a), self.mean(b), self.mean(a * b)).similarity


@dataclass(frozen=True, eq=False)
class _Terms:
    """Fractions whose product the similarity of two masks is, window by window."""

    mean: FloatArray
    other: FloatArray
    light: tuple[FloatArray, FloatArray]
    structure: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, mean: FloatArray, other: FloatArray, both: FloatArray) -> _Terms:
        """From the means of either mask and of their product."""
        light = 2.0 * mean * other + C1, mean**2 + other**2 + C1
        structure = (
            2.0 * (both - mean * other) + C2,
            mean - mean**2 + other - other**2 + C2,
        )
        return cls(mean, other, light, structure)

    @property
    def similarity(self) -> FloatArray:
        (a, b), (c, d) = self.light, self.structure
        return np.asarray(a / b * c / d)

    @property
    def slopes(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives by the first mask's mean and by the mean of the product."""
        (a, b), (c, d) = self.light, self.structure
        by_light = (2.0 * self.other - a / b * 2.0 * self.mean) / b
        by_structure = (-2.0 * self.other - c / d * (1.0 - 2.0 * self.mean)) / d
        return by_light * c / d + a / b * by_structure, a / b * 2.0 / d


@dataclass(frozen=True, eq=False)
class _Belief:
    """Masks of equal weight, and their means in the windows."""

    masks: FloatArray
    means: FloatArray
    windows: SimilarityWindows

    def terms(self, mask: FloatArray) -> _Terms:
        windows = self.windows
        return _Terms.of(windows.mean(mask), self.means, windows.mean(self.masks * mask))

    def expected(self, mask: FloatArray) -> float:
        return float(self.terms(mask).similarity.mean())

    def gain(self, mask: FloatArray) -> FloatArray:
        """(n, n) derivative of what is expected by each pixel, but for a factor."""
        weights = self.windows.weights
        by_mean, by_product = self.terms(mask).slopes
        spread = weights.T @ by_product @ weights
        return np.asarray(
            weights.T @ by_mean.sum(axis=0) @ weights + (self.masks * spread).sum(axis=0)
        )

    def climbed(self, mask: FloatArray, value: float) -> tuple[float, FloatArray]:
        """Pixels that raise what is expected are taken, again and again."""
        for _ in range(_ROUNDS):
            trial = (self.gain(mask) > 0).astype(np.float64)
            if (expected := self.expected(trial)) <= value:
                break
            mask, value = trial, expected
        return value, mask


def most_similar(pictures: NDArray[np.uint8], width: float) -> tuple[NDArray[np.uint8], float]:
    """The labels (n, n) whose mean similarity to ``pictures`` (k, n, n) is greatest, and that mean.

    The similarity is that of the masks of each label but the background, 0, and their mean;
    ``width`` is that of its windows, a standard deviation in pixels. For each label it begins with
    an empty mask and those of the pixels above a probability, and goes to the set of pixels that
    each raise the mean, while the mean rises. A pixel in two masks has its likelier label.

    Raises
    ------
    DataError
        When there is no picture, or they are not square.
    """
    if pictures.ndim != 3 or not len(pictures) or pictures.shape[1] != pictures.shape[2]:
        raise DataError(f"expected pictures of shape (k, n, n), got {pictures.shape}")
    windows = SimilarityWindows.of(pictures.shape[1], width, WINDOWS)
    chosen, often = np.zeros(pictures.shape[1:], np.uint8), np.zeros(pictures.shape[1:])
    values = []
    for kind in (int(kind) for kind in np.unique(pictures) if kind):
        masks = (pictures == kind).astype(np.float64)
        mask, value = _best_mask(_Belief(masks, windows.mean(masks), windows))
        likelier = (mask > 0.5) & ((chosen == 0) | (masks.mean(axis=0) > often))
        chosen[likelier] = kind
        often[likelier] = masks.mean(axis=0)[likelier]
        values.append(value)
    return chosen, float(np.mean(values or [1.0]))


def _best_mask(belief: _Belief) -> tuple[FloatArray, float]:
    probability = belief.masks.mean(axis=0)
    first = [np.zeros_like(probability)]
    first += [(probability > least).astype(np.float64) for least in _THRESHOLDS]
    ranked = sorted(((belief.expected(mask), i) for i, mask in enumerate(first)), reverse=True)
    climbed = [belief.climbed(first[i], value) for value, i in ranked[:_CLIMBED]]
    value, mask = max(climbed, key=lambda pair: pair[0])
    return mask, value
