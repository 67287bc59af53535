"""What the frames before lead one to expect: touches that go on, and what they left behind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS
from tomoskin.sensing.track import RESIDUAL

Known = tuple[int | None, ...]
"""Of each of some spots which of the touches that are expected it is; None: a newcomer."""


@dataclass(frozen=True, eq=False)
class Expectation:
    """Touches that go on, each normally distributed. Fingers press and let go within a frame: so
    position and size are expected, and the content is not.

    Attributes
    ----------
    spots
        (m, 4) the most likely.
    covariances
        (m, 3, 3) of the other columns.
    """

    spots: FloatArray
    covariances: FloatArray

    @classmethod
    def none(cls) -> Expectation:
        """Nothing is expected of this frame."""
        return cls(np.zeros((0, N_PARAMETERS)), np.zeros((0, CONTENT, CONTENT)))

    @classmethod
    def of(cls, spots: FloatArray, covariance: FloatArray, wander: Sequence[float]) -> Expectation:
        """Of ``spots`` (m, 4) of that ``covariance`` (4m, 4m), with deviations (3,) of what they
        ``wander`` until the next frame; nothing where the covariance is no number."""
        k, n = len(spots), N_PARAMETERS
        own = covariance.reshape(k, n, k, n).diagonal(0, 0, 2)  # (n, n, k)
        own = own[:CONTENT, :CONTENT].transpose(2, 0, 1)
        if not np.isfinite(own).all():
            return cls.none()
        return cls(spots, own + np.diag(np.square(wander)))

    @cached_property
    def weights(self) -> FloatArray:
        """(m, 3, 3) inverse of the covariances."""
        return np.asarray(np.linalg.inv(self.covariances))

    def away(self, spots: FloatArray, known: Known) -> float:
        """The largest squared deviation, along one column, of ``spots`` (k, 4) from where they are
        expected; of newcomers without bound, and 0 where there are none."""
        numbers = [number for number in known if number is not None]
        if len(numbers) < len(spots):
            return math.inf
        off = spots[:, :CONTENT] - self.spots[numbers, :CONTENT]
        variances = self.covariances.diagonal(axis1=1, axis2=2)[numbers]
        return float((off * off / variances).max(initial=0.0))

    @cached_property
    def log_volumes(self) -> FloatArray:
        """(m,) logarithm of one over the density at the most likely."""
        log_dets = np.linalg.slogdet(self.covariances)[1]
        return np.asarray((CONTENT * math.log(2 * math.pi) + log_dets) / 2)


def newcomers(count: int) -> Known:
    """So many spots of which none was there before."""
    return (None,) * count


def less(known: Known, number: int) -> Known:
    """Those that remain without one of them."""
    return (*known[:number], *known[number + 1 :])


_AWAY, _STRONGER, _WEAKER = 1e-3, 1.1, 0.95
"""A footprint is made anew where its touch is by so many m elsewhere or by so much stronger, and no
weaker: a touch that has just begun is known badly, and so is one that is lifted."""

_FOOTPRINTS = 16
"""Footprints that are kept, the newest."""


@dataclass(frozen=True, eq=False, slots=True)
class FootprintChange:
    """A footprint: a touch ``spot`` of four numbers, and its ``change`` (n_meas,) V of the rows.
    ``place``, m, is where the touch was first."""

    spot: tuple[float, ...]
    change: FloatArray
    place: tuple[float, ...]

    def is_near(self, spot: Sequence[float]) -> bool:
        """Whether a touch (4,) stands here."""
        return math.dist(self.place, spot[:2]) < RESIDUAL.spacing

    def is_outdated(self, spot: Sequence[float]) -> bool:
        """Whether the touch that stands here is known better by now."""
        stronger = spot[3] / self.spot[3]
        moved = stronger > _STRONGER or math.dist(self.spot[:2], spot[:2]) > _AWAY
        return moved and stronger > _WEAKER


_FALLS, _CREEPS = 0.1, 10.0
"""Seconds in which what is left is known to have become less; or more, by the sheet's drift."""

_KNOWN = 0.2
"""Part of what is left by which it may be otherwise in the next frame."""


class ResidualResponse:
    """What touches have left since the baseline has had time to follow: a part of each footprint's
    change, unknown until frames come in which nothing touches.

    Parameters
    ----------
    seconds
        Between frames.
    fading
        Seconds without a touch after which nothing is left.

    Attributes
    ----------
    feet
        Footprints, the newest last.
    """

    def __init__(self, seconds: float, fading: float) -> None:
        self._seconds, self._fading = seconds, fading
        self.feet: tuple[FootprintChange, ...] = ()
        self._parts, self._doubts, self._quiet = np.zeros((3, 0))
        self._forget_rows()

    def _forget_rows(self) -> None:
        self._matrix = self._rows = self._left = np.zeros((0, 0))

    def after(self, spots: FloatArray, changes: Callable[[FloatArray], FloatArray]) -> None:
        """Take a frame in which touches ``spots`` (k, 4) were: what they will leave is unknown.

        ``changes`` gives (k, n_meas) V of spots (k, 4), each alone.
        """
        newest_first = range(len(self.feet) - 1, -1, -1)
        places: dict[int, tuple[float, ...]] = {}
        for spot in map(tuple, spots.tolist()):
            own = next((n for n in newest_first if self.feet[n].is_near(spot)), None)
            if own is None:
                self._new(spot, changes)
            else:
                self._again(own, spot, changes)

    def _new(self, spot, changes) -> None:
        foot = FootprintChange(spot, changes(np.array([spot]))[0], spot[:2])
        self.feet = (*self.feet, foot)[-_FOOTPRINTS:]
        new = [[0.0], [RESIDUAL.deviation], [0.0]]
        each = np.hstack([[self._parts, self._doubts, self._quiet], new])
        self._parts, self._doubts, self._quiet = each[:, -_FOOTPRINTS:].copy()
        self._forget_rows()

    def _again(self, own: int, spot, changes) -> None:
        foot = self.feet[own]
        self._quiet[own] = 0.0
        if self._doubts[own] != RESIDUAL.deviation:
            self._doubts[own] = RESIDUAL.deviation
            self._left = np.zeros((0, 0))
        if foot.is_outdated(spot):
            foot = FootprintChange(spot, changes(np.array([spot]))[0], foot.place)
            self.feet = (*self.feet[:own], foot, *self.feet[own + 1 :])
            self._forget_rows()

    def _keep(self, stays: list[bool]) -> None:
        """The footprints that stay."""
        if not all(stays):
            self.feet = tuple(compress(self.feet, stays))
            each = np.array([self._parts, self._doubts, self._quiet])
            self._parts, self._doubts, self._quiet = each[:, stays].copy()
            self._forget_rows()

    def taken_from(self, data: FloatArray) -> FloatArray:
        """What of ``data`` (n_meas,) V is not known to be left."""
        for foot, part in zip(self.feet, self._parts.tolist(), strict=True):
            if part:
                data = data - part * foot.change
        return data

    def directions(self, matrix: FloatArray) -> FloatArray:
        """(k, c) of what may be left besides, each as long as its deviation; ``matrix``
        (c, n_meas) 1/V, from data to whitened data."""
        if matrix is not self._matrix:
            self._matrix = matrix
            rows = [matrix @ foot.change for foot in self.feet]
            self._rows = np.array(rows).reshape(-1, len(matrix))
            self._left = self._rows[:0]
        if len(self._left) != len(self._rows):
            self._left = self._doubts[:, None] * self._rows
        return self._left

    def idle(self, matrix: FloatArray, data: FloatArray) -> None:
        """Nothing touched in a frame of such ``data`` (n_meas,) V: see what is left."""
        if not self.feet:
            return
        left = self.directions(matrix)
        onto = np.linalg.solve(np.eye(len(left)) + left @ left.T, left @ (matrix @ data))
        step = self._doubts * onto
        known = self._doubts != RESIDUAL.deviation
        falls, creeps = (-math.expm1(-self._seconds / time) for time in (_FALLS, _CREEPS))
        step[known] *= np.where(step[known] < 0, falls, creeps)
        self._parts = np.maximum(self._parts + step, 0.0)
        size = np.sqrt(np.einsum("kc,kc->k", self._rows, self._rows))
        doubts = np.maximum(_KNOWN * self._parts, 1.0 / size)
        doubts = np.minimum(2.0 ** np.ceil(np.log2(doubts)), 0.9 * RESIDUAL.deviation)
        if (doubts != self._doubts).any():
            self._doubts, self._left = doubts, self._rows[:0]
        self._quiet = self._quiet + self._seconds
        self._keep((self._quiet < self._fading).tolist())
