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
from tomoskin.sensing.fit.strain_spread import Spread
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

_NEAR = 0.5
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
    change
        (n_meas,) V of that.
    mean, spread
        Of the numbers less those of ``at``, and of what is otherwise: (d + k,), and how well it is
        known.
    size
        How large it is or has been; see :meth:`Strain.otherwise`.
    """

    sheet: StrainedSheet
    at: Strain
    change: FloatArray
    mean: FloatArray
    spread: Spread
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
        spread = Spread(directions, np.diag(deviations**2))
        return cls(sheet, at, sheet.change(at), mean, spread, size)

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

    @property
    def directions(self) -> FloatArray:
        """(n_meas, d + k) V that its numbers, and what is otherwise, do."""
        return self.spread.directions

    @property
    def covariance(self) -> FloatArray:
        """(d + k, d + k) of the mean."""
        return self.spread.covariance

    def after(self, *, moves: bool) -> StrainState:
        """As it is expected in the next frame."""
        n, k = len(self.at.numbers), len(self.mean) - len(self.at.numbers)
        angle, offset, width, level, deviator, otherwise = _MOVES if moves else _HELD
        own = [level, deviator, deviator]
        if self.at.kind == "fold":
            own = [angle, offset * self.sheet.breadth, width, level, deviator]
        wander = np.append(own[:n], np.full(k, otherwise))
        most = np.append(self.sheet.prior.deviations(self.at.kind), np.ones(k))
        step = self.spread.wider if moves else self.spread.held
        return replace(self, spread=step(wander, most))

    def told(self, residual: FloatArray, rows: FloatArray, others: FloatArray) -> StrainState:
        """What a frame says: it leaves ``residual`` (c,) whitened beside touches and the mean.

        ``rows`` (d + k, c) are those of :attr:`spread` whitened, ``others`` (q, c) directions of
        what else is not known, a deviation each.
        """
        square = NuisanceMetric.of(others).products(np.vstack([rows, residual]))
        information = square[:-1, :-1] + np.eye(len(rows))
        step = self.spread.root @ np.linalg.solve(information, square[:-1, -1])
        return self._moved(step, self.spread.narrower(information))

    def told_alone(self, residual: FloatArray, left: FloatArray) -> StrainState:
        """The same of a frame without touches: see :meth:`Spread.learnt`."""
        gain, spread = self.spread.learnt(left)
        return self._moved(gain @ residual, spread)

    def _moved(self, step: FloatArray, spread: Spread) -> StrainState:
        mean, n = self.mean + step, len(self.at.numbers)
        held = self.sheet.prior.held(self.at.moved(mean[:n]), self.sheet.reach)
        mean[:n] = held.numbers - self.at.numbers
        return replace(self, mean=mean, spread=spread)

    def linear_at(self, step: FloatArray) -> StrainState:
        """Linear about a strain that is a ``step`` (d,) away; its mean is left as it was."""
        sheet = self.sheet
        there = sheet.prior.held(self.at.moved(step), sheet.reach)
        size = max(self.size, there.size)
        directions, change = sheet.directions(there, size), sheet.change(there)
        spread = Spread(directions, self.covariance)
        return replace(self, at=there, change=change, spread=spread, size=size)

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
        spread = Spread(directions, self.covariance)
        return StrainState(self.sheet, at, self.sheet.change(at), mean, spread, size)
