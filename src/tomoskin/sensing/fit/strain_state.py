"""How a sheet is deformed, as frames tell it: the likeliest strain, and what is not known of it.

It is an extended Kalman filter (Jazwinski 1970, chapter 8) on the numbers of the strain and on what
the sheet has otherwise than they say. Touches are fitted beside it: what is not known of the strain
is noise of theirs along its directions, and what their fit leaves tells of the strain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.solver import NuisanceMetric
from tomoskin.sensing.fit.strain import Kind, Strain
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

_STEPS = 8
"""Of Gauss and Newton, at most, each with one exact solve."""

_DAMPING = 0.03
"""Of a step, where the whole leads to a less likely deformation (Marquardt 1963)."""

_SETTLED = 0.3
"""Squared deviations that a further step must gain; and those of a move that is linear enough."""

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
        slopes, otherwise = sheet.slopes(at), sheet.otherwise(at, size)
        directions = np.hstack([slopes, otherwise])
        n, k = len(at.numbers), otherwise.shape[1]
        middle = sheet.prior.middle(at.kind)
        if at.kind == "fold":  # all places and axes are as likely
            middle[:2] = at.numbers[:2]
        deviations = np.append(sheet.prior.deviations(at.kind), np.ones(k))
        mean = np.append(middle - at.numbers, np.zeros(k))
        assert n + k == len(deviations)
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
        """Linear about a strain that is a ``step`` (d,) away; what is expected of it is left out."""
        sheet = self.sheet
        there = sheet.prior.held(self.at.moved(step), sheet.reach)
        size = max(self.size, there.size)
        directions = np.hstack([sheet.slopes(there), sheet.otherwise(there, size)])
        change = sheet.change(there)
        return replace(self, at=there, change=change, directions=directions, size=size)

    def linear_again(self, matrix: FloatArray) -> StrainState:
        """About the most likely strain, where that is far from where it is linear, by whitened
        data of ``matrix`` (c, n_meas) 1/V."""
        n = len(self.at.numbers)
        far = matrix @ (self.directions[:, :n] @ self.mean[:n])
        if far @ far < _SETTLED:
            return self
        return self._about(self.sheet.prior.held(self.strain, self.sheet.reach))

    def _about(self, at: Strain) -> StrainState:
        """The same about another strain."""
        n = len(at.numbers)
        mean = self.mean.copy()
        mean[:n] += self.at.numbers - at.numbers
        size = max(self.size, at.size)
        directions = np.hstack([self.sheet.slopes(at), self.sheet.otherwise(at, size)])
        mean[n:] *= self.size / size
        return StrainState(
            self.sheet, at, self.sheet.change(at), directions, mean, self.covariance, size
        )


@dataclass(frozen=True, eq=False)
class Explained:
    """A state that explains a frame, and the logarithm of the evidence for it."""

    state: StrainState
    evidence: float
    misfit: float


def likeliest(
    begin: StrainState, data: FloatArray, full: FloatArray, others: FloatArray
) -> Explained:
    """What ``begin`` expects, linear about the likeliest numbers for ``data`` (n_meas,) V.

    ``full`` (r, n_meas) 1/V whitens; ``others`` (q, r) are directions of what else is not known, of
    touches too.
    """
    prior = begin.mean + np.append(begin.at.numbers, np.zeros(_others(begin)))
    linear = _Linear(prior, begin.root, data, full, NuisanceMetric.of(others))
    best, cost = begin, linear.cost(begin)
    damping = 0.0
    for _ in range(_STEPS):
        state = best.linear_at(linear.step(best, damping))
        found = linear.cost(state)
        if found > cost:
            damping = max(10.0 * damping, _DAMPING)
            continue
        gained, best, cost = cost - found, state, found
        damping = damping / 10.0 if damping > _DAMPING else 0.0
        if gained < _SETTLED:
            break
    return linear.explained(best)


@dataclass(frozen=True, eq=False)
class _Linear:
    """What a frame says of a deformation, linear about one.

    ``prior`` (d + k,) its numbers and what is otherwise as they are expected, ``root`` their
    covariance's; ``data``, ``full`` and the ``metric`` of what else is not known: see
    :func:`likeliest`.
    """

    prior: FloatArray
    root: FloatArray
    data: FloatArray
    full: FloatArray
    metric: NuisanceMetric

    def _solved(self, state: StrainState) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(d + k,) what is expected about a ``state``; (d + k + 1, d + k + 1) products of what its
        numbers do, deviation by deviation, and of what is left; and the first ones' information."""
        expected = self.prior - np.append(state.at.numbers, np.zeros(_others(state)))
        residual = self.full @ (self.data - state.change - state.directions @ expected)
        rows = self.root.T @ (self.full @ state.directions).T
        square = self.metric.products(np.vstack([rows, residual]))
        return expected, square, square[:-1, :-1] + np.eye(len(rows))

    def step(self, state: StrainState, damping: float) -> FloatArray:
        """(d,) from a ``state`` to the likeliest numbers, as far as it is linear (Levenberg 1944).

        The larger the ``damping``, the nearer it stays, each number by what is known of it.
        """
        expected, square, information = self._solved(state)
        here = np.linalg.solve(self.root, -expected)
        held = damping * np.diag(np.diag(information))
        onto = square[:-1, -1] + held @ here
        moved = expected + self.root @ np.linalg.solve(information + held, onto)
        most = _most_step(state.at.kind, state.sheet.breadth)
        return np.clip(moved[: len(most)], -most, most)

    def cost(self, state: StrainState) -> float:
        """Squared deviations of a frame, and of the prior, where the strain is that of ``state``;
        what is otherwise as likely as it can be."""
        n = len(state.at.numbers)
        away = state.at.numbers - self.prior[:n]
        covariance = self.root @ self.root.T
        onto = np.linalg.solve(covariance[:n, :n], covariance[:n, n:])
        left = covariance[n:, n:] - covariance[n:, :n] @ onto
        rows = np.linalg.cholesky(left).T @ (self.full @ state.directions[:, n:]).T
        otherwise = self.prior[n:] + away @ onto
        data = self.data - state.change - state.directions[:, n:] @ otherwise
        square = self.metric.products(np.vstack([rows, self.full @ data]))
        information, along = square[:-1, :-1] + np.eye(len(rows)), square[:-1, -1]
        misfit = square[-1, -1] - along @ np.linalg.solve(information, along)
        return float(misfit + away @ np.linalg.solve(covariance[:n, :n], away))

    def explained(self, state: StrainState) -> Explained:
        """What is expected, linear about ``state``, and what speaks for it."""
        expected, square, information = self._solved(state)
        onto = square[:-1, -1]
        misfit = float(square[-1, -1] - onto @ np.linalg.solve(information, onto))
        log_size = float(np.linalg.slogdet(information)[1]) / 2 + self.metric.log_size
        return Explained(replace(state, mean=expected), -misfit / 2 - log_size, misfit)


def _others(state: StrainState) -> int:
    return len(state.mean) - len(state.at.numbers)


def _most_step(kind: Kind, breadth: float) -> FloatArray:
    """(d,) the largest step of the numbers."""
    return np.full(3, 0.3) if kind == "stretch" else np.array([0.3, 0.1 * breadth, 0.5, 0.2, 0.2])


def starts(
    sheet: StrainedSheet, data: FloatArray, full: FloatArray, others: FloatArray, count: int
) -> list[Strain]:
    """Where folds may be that explain ``data`` (n_meas,) V: the best of the table, apart.

    See :func:`likeliest`.
    """
    table = sheet.table
    basis = full @ table.basis
    metric = NuisanceMetric.of(others)
    k = basis.shape[1]
    square = metric.products(np.vstack([basis.T, full @ data]))
    inner, onto = square[:k, :k], square[:k, k]
    one, other = table.level, table.deviator
    a, b, c = (
        np.einsum("kn,kn->n", left, inner @ right)
        for left, right in ((one, one), (one, other), (other, other))
    )
    # priors of level and deviator
    p, q = onto @ one, onto @ other
    level, deviator = sheet.prior.deviations("fold")[3:]
    a, c = a + level**-2, c + deviator**-2
    size = a * c - b * b
    gain = (c * p * p - 2 * b * p * q + a * q * q) / size - np.log(size)
    found: list[Strain] = []
    for number in np.argsort(-gain):
        axis, offset, width = table.numbers[number, :3]
        if any(_near(axis, offset, one, sheet.breadth) for one in found):
            continue
        parts = np.array([c[number] * p[number] - b[number] * q[number]])
        parts = np.append(parts, a[number] * q[number] - b[number] * p[number]) / size[number]
        level_, deviator_ = np.clip(parts, -0.5, 0.5)
        found.append(Strain("fold", np.array([axis, offset, width, level_, deviator_])))
        if len(found) == count:
            break
    return found


def _near(axis: float, offset: float, other: Strain, breadth: float) -> bool:
    turned = math.remainder(axis - other.numbers[0], math.pi)
    beside = other.numbers[1] if abs(axis - other.numbers[0]) < math.pi / 2 else -other.numbers[1]
    return abs(turned) < 0.4 and abs(offset - beside) < 0.15 * breadth
