"""The arithmetic of a fit by the native engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.expectation import Known, newcomers
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.refine import Answer, Deficit, Fit, Limits, Problem, Question
from tomoskin.sensing.fit.solver import DIRECTED, RESHAPED, RIDGE, SheetDomain
from tomoskin.sensing.fit.spot import FILLING
from tomoskin.sensing.fit.table import ResponseTable

Fitted = tuple[
    tuple[FloatArray, ...],
    tuple[FloatArray, ...],
    tuple[float, float, float, bool],
    list[int | None],
]
"""Matrices, vectors and numbers of a fit, and who its spots are."""


class NativeSolver:
    """That of ``core``, the module tomoskin_core; see :class:`Solver`."""

    def __init__(
        self, core: Any, table: ResponseTable, sheet: SheetDomain, prior: SpotPrior
    ) -> None:
        self._core, self._prior, self.table = core, prior, table
        self._spots = core.SpotTable(
            table.log_radii,
            np.array([[*grid.origin, grid.step, *grid.shape] for grid in table.grids]),
            table.nodes,
            table.values,
            FILLING,
            np.column_stack([sheet.centroids, sheet.margin]),
            np.array([prior.middle, prior.weights]),
            np.array(prior.log_radii),
        )

    def expanded(self, spots: FloatArray) -> FloatArray:
        """See :class:`Solver`."""
        return np.asarray(self._spots.expanded(spots))

    def keep(
        self, direct: FloatArray, timed: FloatArray, matrix: FloatArray, squares: FloatArray
    ) -> Any:
        """See :class:`Solver`."""
        return self._core.SeenTable(direct, timed, matrix, self.table.basis, squares)

    def settled(
        self,
        problem: Problem,
        spots: FloatArray,
        deficit: Deficit,
        most: int,
        known: Known = (),
    ) -> Fit:
        """See :class:`Solver`."""
        kept, frame = problem.seen.kept, self._frame(problem, deficit)
        known = known or newcomers(len(spots))
        return _fit(problem, deficit, self._spots.settled(kept, frame, spots, known, most))

    def searched(self, question: Question, before: FloatArray) -> Answer | None:
        """See :class:`Solver`."""
        problem, pace = question.problem, question.pace
        if pace.rounds or pace.joint:
            return None
        limits, rules = question.limits, question.rules
        found, bare, others, more = self._spots.searched(
            problem.seen.kept,
            self._frame(problem, question.deficit),
            before,
            question.candidates,
            (limits.low, limits.high, limits.least, limits.useful, RIDGE),
            (
                *(pace.warm, pace.glance, pace.cold, pace.finalists, pace.tries),
                *(question.most, pace.restart),
            ),
            (
                *(rules.least, rules.held, pace.look, rules.sure, pace.rare),
                *(rules.misshapen, rules.within, rules.near, self._prior.log_volume),
            ),
        )
        rank = len(self.table.basis)
        deficit = Deficit.none(rank) if bare else question.deficit
        more = more and _fit(problem, deficit, more)
        return Answer(_fit(problem, deficit, found), others and tuple(others), more)

    def _frame(self, problem: Problem, deficit: Deficit) -> tuple[Any, ...]:
        deviations = (DIRECTED, RESHAPED, problem.reach, problem.grows)
        depths = self._prior.depths(problem.sign)
        data, expected = (problem.data, problem.rest, problem.left), problem.expected
        going_on = expected.spots, expected.covariances, self._prior.log_content
        return *data, deficit.change, deviations, depths, going_on

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        """See :class:`Solver`."""
        parts = fit.each, fit.slopes, fit.unknown, fit.normal
        quality = fit.misfit, float(fit.degrees), uneven
        change = fit.change + fit.deficit.change
        squares, covariance = problem.seen.kept.judged(parts, change, quality, RIDGE)
        return squares, covariance

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        """See :class:`Solver`."""
        return np.asarray(self._core.standing(left, fit.slopes, fit.each, RIDGE))

    def standing_out(
        self, signatures: FloatArray, squares: FloatArray, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        """See :class:`Solver`."""
        numbers = (limits.low, limits.high, limits.least, limits.useful, RIDGE)
        ratio, content = self._core.standing_out(
            signatures, squares, fit.unknown, fit.slopes, fit.residual, numbers
        )
        return ratio, content


def _fit(problem: Problem, deficit: Deficit, fitted: Fitted) -> Fit:
    matrices, vectors, numbers, known = fitted
    found, each, slopes, unknown, normal = matrices
    change, predicted, residual, gradient = vectors
    misfit, log_size, cost, settled = numbers
    return Fit(
        spots=found,
        deficit=deficit,
        change=change,
        each=each,
        predicted=predicted,
        residual=residual,
        slopes=slopes,
        unknown=unknown,
        normal=normal,
        gradient=gradient,
        misfit=misfit,
        log_size=log_size,
        cost=cost,
        degrees=max(len(problem.seen.full) - len(gradient), 1),
        settled=settled,
        known=tuple(known),
    )
