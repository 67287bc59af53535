"""What explains a frame, and how sure each touch in it is."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, reach
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.fit.policy import are_distinct
from tomoskin.sensing.fit.selection import ForwardSelection
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS
from tomoskin.sensing.fit.spot_fit import Fit

_UNEVEN = 0.08
"""Part by which each row answers a touch otherwise than the model's, at the least: a sheet is
uneven, contacts and gains differ. A standard deviation, chosen on the twin's seeds 1 to 3."""


@dataclass(frozen=True, eq=False)
class SpotDetections:
    """What explains a frame, and how sure each touch is.

    Attributes
    ----------
    fit
        The most likely spots.
    ratio
        (k,) deviations by which each stands out of the noise, the others given.
    fresh
        (k,) the same out of noise and residual responses: what a new touch needs.
    covariance
        (4k, 4k), noise and a wrong profile together.
    close
        (k,) bool: another touch so near cannot be ruled out.
    """

    fit: Fit
    ratio: FloatArray
    fresh: FloatArray
    covariance: FloatArray
    close: NDArray[np.bool_]


def judged(selection: ForwardSelection, fit: Fit) -> SpotDetections:
    """How sure each touch of a fit is."""
    if not len(fit.spots):
        none = np.zeros(0)
        return SpotDetections(fit, none, none, np.zeros((0, 0)), none.astype(bool))
    reach("covariances")
    problem = selection.problem
    squares, covariance = problem.solver.judged(problem, fit, _UNEVEN)
    ratio = np.sqrt(squares)
    fresh = selection.ratios(fit) if len(problem.left) else ratio
    return SpotDetections(fit, ratio, fresh, covariance, _close(selection, fit))


def _close(selection: ForwardSelection, fit: Fit) -> NDArray[np.bool_]:
    """Where a candidate within a radius of a spot stands out nearly enough."""
    ratio, _ = selection.openings.candidates(fit)
    doubtful = selection.matched.spots[ratio > selection.policy.close(fit), :2]
    if not len(doubtful):
        return np.zeros(len(fit.spots), dtype=bool)
    apart = np.linalg.norm(fit.spots[:, None, :2] - doubtful, axis=2).min(axis=1)
    return np.asarray(apart < 2 * np.exp(fit.spots[:, LOG_RADIUS]))


def joined(detected: SpotDetections) -> SpotDetections:
    """The same with each two touches as one whose positions are not distinct."""
    places = detected.fit.spots[:, :2].tolist()
    variance = detected.covariance.diagonal().tolist()
    for i in range(len(places)):
        for j in range(i + 1, len(places)):
            x, y = (one - other for one, other in zip(places[i], places[j], strict=True))
            both = sum(variance[4 * k] + variance[4 * k + 1] for k in (i, j))
            if are_distinct(x * x + y * y, 2 * both):  # no direction has more than all
                continue
            away = np.array([x, y])
            pick = [4 * i, 4 * i + 1, 4 * j, 4 * j + 1]
            block = detected.covariance[np.ix_(pick, pick)]
            turn = np.concatenate([away, -away])
            if not are_distinct((away @ away) ** 2, turn @ block @ turn):
                return joined(_merged(detected, i, j))
    return detected


def _merged(detected: SpotDetections, i: int, j: int) -> SpotDetections:
    """Touches i and j as one, at the middle of their contents."""
    fit, keep = detected.fit, np.delete(np.arange(len(detected.fit.spots)), j)
    share = np.abs(fit.spots[[i, j], CONTENT])
    share = share / share.sum()
    one = fit.spots[i].copy()
    one[:2] = share @ fit.spots[[i, j], :2]
    one[LOG_RADIUS] = share @ fit.spots[[i, j], LOG_RADIUS]
    one[CONTENT] = fit.spots[[i, j], CONTENT].sum()
    spots = fit.spots.copy()
    spots[i] = one
    mix = np.eye(4 * len(fit.spots))
    for column, part in ((i, share[0]), (j, share[1])):
        mix[4 * i : 4 * i + 2, 4 * column : 4 * column + 2] = part * np.eye(2)
    rows = (4 * keep[:, None] + np.arange(N_PARAMETERS)).ravel()
    covariance = (mix @ detected.covariance @ mix.T)[np.ix_(rows, rows)]
    ratio, fresh = detected.ratio.copy(), detected.fresh.copy()
    for each in (ratio, fresh):
        each[i] = np.hypot(*each[[i, j]])
    close = detected.close.copy()
    close[i] = True
    kept = replace(fit, spots=spots[keep])
    return SpotDetections(kept, ratio[keep], fresh[keep], covariance, close[keep])


_MARGIN = 1 + 1e-9
"""Rounding of a radius."""


@dataclass(frozen=True, eq=False)
class CellDiscs:
    """Cells along the x axis: a disc meets few of them.

    Attributes
    ----------
    cells
        (n,) their numbers.
    middles
        (n,) m, x + iy.
    """

    cells: IntArray
    middles: NDArray[np.complex128]

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """The cells of a mesh, along its x axis."""
        x, y = mesh.centroids.T
        order = np.argsort(x, kind="stable")
        return cls(order, (x + 1j * y)[order])

    def within(self, x: float, y: float, radius: float) -> IntArray:
        """(m,) those whose middles are no farther than ``radius`` m from ``x``, ``y`` m, or the
        nearest one."""
        along, reach = self._along, radius * _MARGIN
        near = slice(bisect_left(along, x - reach), bisect_left(along, x + reach))
        found = np.abs(self.middles[near] - complex(x, y)) <= radius
        if found.any():
            return np.asarray(self.cells[near].compress(found))
        away = np.abs(self.middles - complex(x, y))
        return np.asarray(self.cells[away == away.min()])

    @cached_property
    def _along(self) -> list[float]:
        return list(map(float, self.middles.real))
