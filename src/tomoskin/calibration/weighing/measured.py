"""Newtons from the measurements themselves, for skins without a model: a Gaussian process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm

from tomoskin.calibration.locator.presses import Features, frames
from tomoskin.calibration.locator.process import Process, squared_distances
from tomoskin.core import DataError, FloatArray

_TERMS = (("change", "rest"), ("change",), ("rest",))
_FEWEST = 20
_WHERE = "force labels"
_NINE_IN_TEN = 0.9
_HALF = float(norm.ppf(0.5 + _NINE_IN_TEN / 2))
_RECENT, _LEAST = 8, 30
"""The last eighth of the presses, or so many, tell whether the skin has changed."""

_CHANCE = 1.15
"""By which few presses may be missed farther than all without any change."""


@dataclass(frozen=True, eq=False)
class ForceProcess:
    """Forces of single presses, from what they change and from what the skin was like before.

    What a skin reads at rest holds what it remembers of earlier presses; so a force is learnt from
    both: the press minus the rest, and the rest minus that of the first presses. The interval is
    the process's own, widened so that nine in ten of the left-out presses lie in theirs; the last
    ones count alone where they are missed farther.

    Attributes
    ----------
    change, rest
        Features of both.
    inputs
        Their values (n, k) of the presses, and (n, k).
    units
        Usual squared distances of both.
    process
        What tells the force; ``factor`` is the Cholesky factor of its covariance.
    centre, size
        N: mean and deviation of the labels.
    scale
        By which the process's deviations are widened.
    middle
        (n_meas,) mean rest of the presses.
    """

    change: Features
    rest: Features
    inputs: tuple[FloatArray, FloatArray]
    units: tuple[float, float]
    process: Process
    factor: tuple[FloatArray, bool]
    centre: float
    size: float
    scale: float
    middle: FloatArray

    @classmethod
    def fit(cls, before: ArrayLike, during: ArrayLike, force: ArrayLike) -> Self:
        """Learn from presses in the order of time.

        Parameters
        ----------
        before, during
            (n, n_meas) frames just before and during each press, in any one unit.
        force
            (n,) N.

        Raises
        ------
        DataError
            For shapes that do not belong together, fewer than twenty presses, forces that are not
            finite or all alike, data that never change.
        """
        rest, pressed = frames(before), frames(during)
        newtons = np.asarray(force, dtype=np.float64)
        if rest.shape != pressed.shape or newtons.shape != (len(rest),) or len(rest) < _FEWEST:
            raise DataError(
                f"expected {_FEWEST} or more presses, before, during and force of each; got shapes "
                f"{rest.shape}, {pressed.shape}, {newtons.shape}",
                where=_WHERE,
            )
        if not np.isfinite(newtons).all() or np.ptp(newtons) == 0:
            raise DataError("expected forces that are finite and not all alike", where=_WHERE)
        middle = np.nanmean(rest, axis=0)
        change, resting = Features.of(pressed - rest), Features.of(rest - middle)
        inputs = change(pressed - rest), resting(rest - middle)
        squares = [squared_distances(values, values) for values in inputs]
        units = tuple(float(np.median(square[square > 0])) for square in squares)
        named = _named(squares, units)
        centre, size = float(newtons.mean()), float(newtons.std())
        targets = ((newtons - centre) / size)[:, None]
        process = Process.of(_TERMS, named, targets)
        kernel = process.covariance(named)
        kernel[np.diag_indices(len(kernel))] += process.noise
        factor = cho_factor(kernel, lower=True)
        missed = (process.left_out - targets)[:, 0]
        own = np.sqrt(1 / np.diag(cho_solve(factor, np.eye(len(kernel)))))
        scale = _scale(np.abs(missed) / own)
        return cls(
            change, resting, inputs, (units[0], units[1]), process, factor, centre, size, scale,
            middle,
        )  # fmt: skip

    def predict(
        self, before: ArrayLike, during: ArrayLike
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, 5 % and 95 % point, (n,) N each, of presses as in :meth:`fit`.

        Raises
        ------
        DataError
            For frames of another number of measurements, or without any finite one.
        """
        n_meas = len(self.middle)
        rest, pressed = frames(before, n_meas), frames(during, n_meas)
        values = self.change(pressed - rest), self.rest(rest - self.middle)
        squares = [
            squared_distances(some, known) for some, known in zip(values, self.inputs, strict=True)
        ]
        cross = self.process.covariance(_named(squares, self.units))
        told = (cross * cho_solve(self.factor, cross.T).T).sum(axis=1)
        variance = np.maximum(self.process.variance - told, 0.0) + self.process.noise
        middle = self.centre + self.size * (cross @ self.process.weights)[:, 0]
        half = _HALF * self.scale * self.size * np.sqrt(variance)
        return middle, middle - half, middle + half


def _named(squares: list[FloatArray], units: tuple[float, ...]) -> dict[str, FloatArray]:
    return {
        name: square / unit
        for name, square, unit in zip(("change", "rest"), squares, units, strict=True)
    }


def _scale(away: FloatArray) -> float:
    """Of deviations, by how many of which (n,) each left-out press is missed."""
    last = away[-max(len(away) // _RECENT, _LEAST) :]
    return max(_high(away), _high(last) / _CHANCE) / _HALF


def _high(away: FloatArray) -> float:
    return float(np.quantile(away, min(1.0, _NINE_IN_TEN * (1 + 1 / len(away)))))
