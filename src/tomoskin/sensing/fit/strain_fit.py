"""The deformation that explains a frame: where folds may be, and the likeliest numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.solver import NuisanceMetric
from tomoskin.sensing.fit.strain import Kind, Strain
from tomoskin.sensing.fit.strain_state import StrainState
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

_STEPS = 8
"""Of Gauss and Newton, at most, each with one exact solve."""

_DAMPING = 0.03
"""Of a step, where the whole leads to a less likely deformation (Marquardt 1963)."""

_SETTLED = 0.3
"""Squared deviations that a further step must gain."""


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
    linear = _Linear(prior, begin.spread.root, data, full, NuisanceMetric.of(others))
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
