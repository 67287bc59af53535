"""What the frames before lead one to expect: touches that go on, and what they left behind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
    def of(cls, spots: FloatArray, covariance: FloatArray, wander: FloatArray) -> Expectation:
        """Of ``spots`` (m, 4) of that ``covariance`` (4m, 4m), with the covariance (3, 3) of what
        they ``wander`` until the next frame; nothing where the covariance is no number."""
        k, n = len(spots), N_PARAMETERS
        own = covariance.reshape(k, n, k, n).diagonal(0, 0, 2)  # (n, n, k)
        own = own[:CONTENT, :CONTENT].transpose(2, 0, 1)
        if not np.isfinite(own).all():
            return cls.none()
        return cls(spots, own + wander)

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


_STRONGER = 1.25
"""A footprint is replaced where a touch is by so much stronger than when it was made."""

_FOOTPRINTS = 16
"""Footprints that are kept, the newest."""


@dataclass(frozen=True, eq=False, slots=True)
class FootprintChange:
    """A footprint: a touch ``spot`` of four numbers, and its ``change`` (n_meas,) V of the rows."""

    spot: tuple[float, ...]
    change: FloatArray

    def is_near(self, spot: Sequence[float]) -> bool:
        """Whether a touch (4,) stands here."""
        x, y = self.spot[0] - spot[0], self.spot[1] - spot[1]
        return x * x + y * y < RESIDUAL.spacing**2

    def stands_for(self, spot: Sequence[float]) -> bool:
        """Whether a touch that stands here needs no footprint of its own."""
        return self.is_near(spot) and _STRONGER * abs(self.spot[3]) >= abs(spot[3])


@dataclass(frozen=True, eq=False)
class ResidualResponse:
    """Where touches have been since the baseline has had time to follow.

    Attributes
    ----------
    feet
        Footprints, the newest last.
    quiet
        Frames without any touch since each was made.
    """

    feet: tuple[FootprintChange, ...] = ()
    quiet: tuple[int, ...] = ()

    def after(
        self, spots: FloatArray, changes: Callable[[FloatArray], FloatArray], frames: int
    ) -> Self:
        """With a frame in which touches ``spots`` (k, 4) were; each is forgotten after so many
        ``frames`` without one. ``changes`` gives (k, n_meas) V of spots (k, 4), each alone."""
        if not len(spots):
            quiet = tuple(q + 1 for q in self.quiet)
            return self._kept([q < frames for q in quiet], quiet)
        newest_first = range(len(self.feet) - 1, -1, -1)
        held = [
            next((n for n in newest_first if self.feet[n].stands_for(spot)), None)
            for spot in spots.tolist()
        ]
        quiet = tuple(0 if n in held else q for n, q in enumerate(self.quiet))
        fresh = spots[[n is None for n in held]]
        if not len(fresh):
            return self._kept([True] * len(quiet), quiet)
        new = fresh.tolist()
        made = map(FootprintChange, map(tuple, new), changes(fresh))
        kept = self._kept([not any(map(foot.is_near, new)) for foot in self.feet], quiet)
        none = len(fresh) * (0,)
        return type(self)((*kept.feet, *made)[-_FOOTPRINTS:], (*kept.quiet, *none)[-_FOOTPRINTS:])

    def _kept(self, stays: list[bool], quiet: tuple[int, ...]) -> Self:
        """The footprints that stay, of which the tuple is the same where all do."""
        if all(stays):
            return self if quiet == self.quiet else replace(self, quiet=quiet)
        return type(self)(tuple(compress(self.feet, stays)), tuple(compress(quiet, stays)))


class ResidualDirections:
    """Residual responses as whitened data see them; what was made for the last ones is kept."""

    def __init__(self) -> None:
        self._matrix = np.zeros((0, 0))
        self._feet: tuple[FootprintChange, ...] = ()
        self._row: dict[FootprintChange, FloatArray] = {}
        self._rows = np.zeros((0, 0))

    def of(self, matrix: FloatArray, feet: tuple[FootprintChange, ...]) -> FloatArray:
        """(k, c) each as long as its deviation; ``matrix`` (c, n_meas) 1/V, from data to whitened
        data."""
        if matrix is not self._matrix or feet is not self._feet:
            before = self._row if matrix is self._matrix else {}
            self._row = {
                foot: before[foot]
                if foot in before
                else RESIDUAL.deviation * (matrix @ foot.change)
                for foot in feet
            }
            self._rows = np.array([*self._row.values()]).reshape(-1, len(matrix))
            self._matrix, self._feet = matrix, feet
        return self._rows
