"""What is not known of a strain, from frame to frame; computed once while the sheet is held."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.solver import NuisanceMetric

_STEADY = 0.02
"""Part of a deviation up to which what is expected is as it was in the frame before."""


@dataclass(frozen=True, eq=False)
class Spread:
    """What is not known of a strain, and how that shows in voltages.

    It is the covariance of a Kalman filter, which does not depend on the data. So it settles while
    a sheet is held, and frames share one object and what that has computed.

    Attributes
    ----------
    directions
        (n_meas, d + k) V that each number, and each part of what is otherwise, does.
    covariance
        (d + k, d + k).
    before
        What was expected of the frame that told this; None of what is expected itself.
    """

    directions: FloatArray
    covariance: FloatArray
    before: Spread | None = None
    _seen: list[tuple[FloatArray, FloatArray]] = field(default_factory=list, init=False)
    _learnt: list[tuple[FloatArray, FloatArray, Spread]] = field(default_factory=list, init=False)
    _next: list[Spread] = field(default_factory=list, init=False)

    @cached_property
    def root(self) -> FloatArray:
        """(d + k, d + k) lower root of the covariance."""
        scale = np.sqrt(np.diag(self.covariance))
        even = self.covariance / scale[:, None] / scale
        even.flat[:: len(even) + 1] += 1e-9
        return np.asarray(scale[:, None] * np.linalg.cholesky(even))

    @cached_property
    def rows(self) -> FloatArray:
        """(d + k, n_meas) V: what is not known, a deviation each."""
        return np.asarray((self.directions @ self.root).T)

    def seen(self, matrix: FloatArray) -> FloatArray:
        """(d + k, c) the rows as whitened by a ``matrix`` (c, n_meas) 1/V."""
        if not self._seen or self._seen[0][0] is not matrix:
            self._seen[:] = [(matrix, self.rows @ matrix.T)]
        return self._seen[0][1]

    def wider(self, wander: FloatArray, most: FloatArray) -> Spread:
        """As it is expected in the next frame, after a ``wander`` of (d + k,) deviations; no
        deviation is larger than ``most`` (d + k,)."""
        covariance = self.covariance + np.diag(wander**2)
        scale = np.minimum(1.0, most / np.sqrt(np.diag(covariance)))
        return Spread(self.directions, covariance * scale[:, None] * scale)

    def held(self, wander: FloatArray, most: FloatArray) -> Spread:
        """The same where the sheet stands: with what was expected of the last frame, where that
        is as wide."""
        if not self._next:
            wider, before = self.wider(wander, most), self.before
            self._next.append(before if before is not None and wider._is_as(before) else wider)
        return self._next[0]

    def _is_as(self, other: Spread) -> bool:
        if self.directions is not other.directions:
            return False
        ratio = np.diag(self.covariance) / np.diag(other.covariance)
        return bool(np.abs(ratio - 1).max() < 2 * _STEADY)

    def narrower(self, information: FloatArray) -> Spread:
        """After a frame that tells the ``information`` (d + k, d + k) along the rows."""
        covariance = self.root @ np.linalg.inv(information) @ self.root.T
        return Spread(self.directions, (covariance + covariance.T) / 2, self)

    def learnt(self, left: FloatArray) -> tuple[FloatArray, Spread]:
        """What a frame without touches tells.

        (d + k, c): how what it leaves moves the mean, and what is not known afterwards. ``left``
        (q, c) are all of its unknown directions; the first are :meth:`seen`.
        """
        if not self._learnt or self._learnt[0][0] is not left:
            n, c = len(self.covariance), left.shape[1]
            rows = np.vstack([left[:n], np.eye(c)])
            products = NuisanceMetric.of(left[n:]).products(rows)
            information = products[:n, :n] + np.eye(n)
            gain = self.root @ np.linalg.solve(information, products[:n, n:])
            self._learnt[:] = [(left, gain, self.narrower(information))]
        return self._learnt[0][1:]
