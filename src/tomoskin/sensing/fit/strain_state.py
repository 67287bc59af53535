"""How a sheet is deformed, as frames tell it: the likeliest strain, and what is not known of it.

It is an extended Kalman filter (Jazwinski 1970, chapter 8) on the numbers of the strain and on what
the sheet has otherwise than they say. Touches are fitted beside it: what is not known of the strain
is noise of theirs along its directions, and what their fit leaves tells of the strain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.solver import NuisanceMetric
from tomoskin.sensing.fit.strain import Strain
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

_NEAR = 0.1
"""Squared deviations by which a linear move may be wrong."""

_STRAINED = 0.02
"""Size of a strain from which touches change other voltages than at rest."""

_HELD = (0.01, 0.005, 0.03, 0.002, 0.0015, 0.02)
_MOVES = (0.12, 0.06, 0.25, 0.05, 0.03, 0.3)
"""What a deformation that stands does from frame to frame, and one that moves: deviations of axis,
offset in breadths, logarithm of the width, level, deviator, and of what is otherwise."""


@dataclass(frozen=True, eq=False)
class StrainState:
    """What is known of a sheet's strain.

    Attributes
    ----------
    sheet
        That is strained.
    at
        The strain about which it is linear.
    change, directions
        (n_meas,) V of that, and (n_meas, d + k) V what its numbers, and what is otherwise, do.
    mean, covariance
        (d + k,) and (d + k, d + k) of the numbers less those of ``at``, and of what is otherwise.
    size
        How large it is or has been; see :meth:`Strain.otherwise`.
    """

    sheet: StrainedSheet
    at: Strain
    change: FloatArray
    directions: FloatArray
    mean: FloatArray
    covariance: FloatArray
    size: float

    @classmethod
    def about(cls, sheet: StrainedSheet, at: Strain, size: float = 0.0) -> StrainState:
        """Linear about a strain, before anything is known."""
        size = max(size, at.size)
        directions = sheet.directions(at, size)
        n = len(at.numbers)
        k = directions.shape[1] - n
        middle = sheet.prior.middle(at.kind)
        if at.kind == "fold":  # all places and axes are as likely
            middle[:2] = at.numbers[:2]
        deviations = np.append(sheet.prior.deviations(at.kind), np.ones(k))
        mean = np.append(middle - at.numbers, np.zeros(k))
        covariance = np.diag(deviations**2)
        return cls(sheet, at, sheet.change(at), directions, mean, covariance, size)

    def on(self, sheet: StrainedSheet) -> StrainState:
        """The same on another sheet."""
        return replace(self, sheet=sheet)._about(self.at)

    @property
    def strain(self) -> Strain:
        """The most likely."""
        return self.at.moved(self.mean[: len(self.at.numbers)])

    @property
    def shows_in_touches(self) -> bool:
        """Whether touches change other voltages on it than on the sheet at rest."""
        return self.at.size > _STRAINED

    @cached_property
    def moved(self) -> FloatArray:
        """(n_meas,) V by which the most likely strain has moved the voltages."""
        return np.asarray(self.change + self.directions @ self.mean)

    @cached_property
    def root(self) -> FloatArray:
        """(d + k, d + k) lower root of the covariance."""
        scale = np.sqrt(np.diag(self.covariance))
        even = self.covariance / scale[:, None] / scale
        even[np.diag_indices_from(even)] += 1e-9
        return np.asarray(scale[:, None] * np.linalg.cholesky(even))

    @cached_property
    def rows(self) -> FloatArray:
        """(d + k, n_meas) V: what is not known of it, a deviation each."""
        return np.asarray((self.directions @ self.root).T)

    def after(self, *, moves: bool) -> StrainState:
        """As it is expected in the next frame."""
        angle, offset, *others, otherwise = _MOVES if moves else _HELD
        n, k = len(self.at.numbers), len(self.mean) - len(self.at.numbers)
        level, deviator = others[1:]
        own = [level, deviator, deviator]
        if self.at.kind == "fold":
            own = [angle, offset * self.sheet.breadth, *others]
        wander = np.append(own[:n], np.full(k, otherwise))
        covariance = self.covariance + np.diag(wander**2)
        most = self.sheet.prior.deviations(self.at.kind)
        scale = np.minimum(1.0, np.append(most, np.ones(k)) / np.sqrt(np.diag(covariance)))
        return replace(self, covariance=covariance * scale[:, None] * scale)

    def told(self, residual: FloatArray, rows: FloatArray, others: FloatArray) -> StrainState:
        """What a frame says: it leaves ``residual`` (c,) whitened beside touches and the mean.

        ``rows`` (d + k, c) are :attr:`rows` whitened, ``others`` (q, c) directions of what else is
        not known, a deviation each.
        """
        square = NuisanceMetric.of(others).products(np.vstack([rows, residual]))
        information = square[:-1, :-1] + np.eye(len(rows))
        found = np.linalg.inv(information)
        mean = self.mean + self.root @ (found @ square[:-1, -1])
        n = len(self.at.numbers)
        held = self.sheet.prior.held(self.at.moved(mean[:n]), self.sheet.reach)
        mean[:n] = held.numbers - self.at.numbers
        covariance = self.root @ found @ self.root.T
        return replace(self, mean=mean, covariance=(covariance + covariance.T) / 2)

    def linear_at(self, step: FloatArray) -> StrainState:
        """Linear about a strain that is a ``step`` (d,) away; its mean is left as it was."""
        sheet = self.sheet
        there = sheet.prior.held(self.at.moved(step), sheet.reach)
        size = max(self.size, there.size)
        directions, change = sheet.directions(there, size), sheet.change(there)
        return replace(self, at=there, change=change, directions=directions, size=size)

    def linear_again(self, matrix: FloatArray) -> StrainState:
        """About the most likely strain, where that is so far from where it is linear that whitened
        data of ``matrix`` (c, n_meas) 1/V show it: a sheet that is held is solved once."""
        step = self.mean[: len(self.at.numbers)]
        far = matrix @ (self.directions[:, : len(step)] @ step)
        if far @ far * self.at.bends(step, self.sheet.breadth) ** 2 < _NEAR:
            return self
        return self._about(self.sheet.prior.held(self.strain, self.sheet.reach))

    def _about(self, at: Strain) -> StrainState:
        """The same about another strain."""
        n = len(at.numbers)
        mean = self.mean.copy()
        mean[:n] += self.at.numbers - at.numbers
        size = max(self.size, at.size)
        directions = self.sheet.directions(at, size)
        mean[n:] *= self.size / size
        return StrainState(
            self.sheet, at, self.sheet.change(at), directions, mean, self.covariance, size
        )
