"""Touches of the frame before, where they may have gone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS

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
        """Nothing is expected."""
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
    """So many."""
    return (None,) * count


def less(known: Known, number: int) -> Known:
    """Without one of them."""
    return (*known[:number], *known[number + 1 :])
