"""Amounts from the measurements themselves, for skins without a model: a Gaussian process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from tomoskin.core import DataError, FloatArray
from tomoskin.learning.touch import gaussian_process as gp
from tomoskin.learning.touch.presses import Features, frames

_TERMS = (("change", "rest"), ("pressed",), ("rest",))
_COMPONENTS = {"change": 60, "pressed": 60, "rest": 10}
"""Principal components of each block that count; chosen by left-out presses of one skin."""

_FEWEST = 20
_WHERE = "labels of presses"
HALF = float(ndtri(0.95))
"""Deviations in half of a 90 % interval."""

_RECENT, _LEAST = 8, 30
"""The last eighth of the presses, or so many, tell whether the skin has changed."""

_CHANCE = 1.15
"""By which few presses may be missed farther than all without any change."""


@dataclass(frozen=True, eq=False)
class FeatureBlock:
    """Principal components of what presses read, and how far apart two presses are in them.

    ``middle`` (n_meas,) is taken off where a block is no change by itself; ``mean`` (k,) and
    ``axes`` (k, c) are of its features; ``inputs`` (n, c) of the presses; ``unit`` their usual
    squared distance.
    """

    features: Features
    middle: FloatArray
    mean: FloatArray
    axes: FloatArray
    inputs: FloatArray
    unit: float

    @classmethod
    def of(cls, data: FloatArray, components: int, *, is_change: bool) -> Self:
        """Of presses ``data`` (n, n_meas); a change has its own zero."""
        middle = np.zeros(data.shape[1]) if is_change else np.nanmean(data, axis=0)
        features = Features.of(data - middle)
        values = features(data - middle)
        mean = values.mean(axis=0)
        axes = gp.leading(values - mean, components)
        inputs = (values - mean) @ axes
        square = gp.squared_distances(inputs, inputs)
        unit = float(np.median(square[square > 0]))
        return cls(features, middle, mean, axes, inputs, unit)

    def __call__(self, data: FloatArray) -> FloatArray:
        """(m, c) components of frames (m, n_meas)."""
        return np.asarray((self.features(data - self.middle) - self.mean) @ self.axes)

    def squares(self, inputs: FloatArray) -> FloatArray:
        """(m, n) squared distances of ``inputs`` (m, c) from the presses."""
        return gp.squared_distances(inputs, self.inputs) / self.unit


@dataclass(frozen=True, eq=False)
class AmountProcess:
    """Forces or depths of single presses, from their change and what the skin was like before.

    What a skin reads at rest holds what it remembers of earlier presses; so an amount is learnt
    from what a press changes, from the pressed frame and from the rest before it. The interval is
    the process's own, widened so that nine in ten of the left-out presses lie in theirs; the last
    ones count alone where they are missed farther.

    Attributes
    ----------
    blocks
        What is read of each of these, by name.
    process
        What tells the amount.
    scale
        By which the process's deviations are widened.
    """

    blocks: Mapping[str, FeatureBlock]
    process: gp.Process
    scale: float

    @classmethod
    def fit(cls, before: ArrayLike, during: ArrayLike, amount: ArrayLike) -> Self:
        """Learn from presses in the order of time.

        Parameters
        ----------
        before, during
            (n, n_meas) frames just before and during each press, in any one unit.
        amount
            (n,) in any one unit.

        Raises
        ------
        DataError
            For shapes that do not belong together, fewer than twenty presses, amounts that are not
            finite or all alike, data that never change.
        """
        rest, pressed = frames(before), frames(during)
        labels = np.asarray(amount, dtype=np.float64)
        if rest.shape != pressed.shape or labels.shape != (len(rest),) or len(rest) < _FEWEST:
            raise DataError(
                f"expected before, during and amount of at least {_FEWEST} presses, got shapes "
                f"{rest.shape}, {pressed.shape}, {labels.shape}",
                where=_WHERE,
            )
        if not np.isfinite(labels).all() or np.ptp(labels) == 0:
            raise DataError(
                f"expected finite amounts that differ, got {labels.min():g} to {labels.max():g}",
                where=_WHERE,
            )
        blocks = {
            name: FeatureBlock.of(data, _COMPONENTS[name], is_change=name == "change")
            for name, data in _named(rest, pressed).items()
        }
        squares = {name: block.squares(block.inputs) for name, block in blocks.items()}
        process = gp.Process.of(_TERMS, squares, labels[:, None])
        return cls(blocks, process, _scale(np.abs(process.missed[:, 0])))

    @property
    def left_out(self) -> FloatArray:
        """(n,) amount of each press as the others tell it."""
        return self.process.left_out[:, 0]

    def predict(
        self, before: ArrayLike, during: ArrayLike
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Amount, 5 % and 95 % point, (n,) each, of presses as in :meth:`fit`.

        Raises
        ------
        DataError
            For frames of another number of measurements, or without any finite one.
        """
        n_meas = len(self.blocks["rest"].middle)
        data = _named(frames(before, n_meas), frames(during, n_meas))
        squares = {name: block.squares(block(data[name])) for name, block in self.blocks.items()}
        middle = self.process(squares)[:, 0]
        half = HALF * self.scale * self.process.deviation(squares)
        return middle, middle - half, middle + half


def _named(rest: FloatArray, pressed: FloatArray) -> dict[str, FloatArray]:
    return {"change": pressed - rest, "pressed": pressed, "rest": rest}


def _scale(away: FloatArray) -> float:
    """Of deviations, by how many of which (n,) each left-out press is missed."""
    last = away[-max(len(away) // _RECENT, _LEAST) :]
    return max(gp.nine_in_ten(away), gp.nine_in_ten(last) / _CHANCE) / HALF
