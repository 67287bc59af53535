"""The arithmetic of a fit by the native engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.expectation import Known, newcomers
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.problem import RIDGE, Answer, Limits, Matched, Problem
from tomoskin.sensing.fit.solver import SheetDomain
from tomoskin.sensing.fit.spot import FILLING
from tomoskin.sensing.fit.spot_fit import Deficit, Fit
from tomoskin.sensing.fit.table import ResponseTable


class NativeSolver:
    """That of ``core``, the module tomoskin_core; see :class:`Solver`."""

    def __init__(
        self, core: Any, table: ResponseTable, sheet: SheetDomain, prior: SpotPrior
    ) -> None:
        self._core, self.table = core, table
        self._spots = core.SpotTable(
            log_radii=table.log_radii,
            grids=np.array([[*grid.origin, grid.step, *grid.shape] for grid in table.grids]),
            nodes=table.nodes,
            values=table.values,
            filling=FILLING,
            sheet=np.column_stack([sheet.centroids, sheet.margin]),
            prior=prior,
        )

    def expanded(self, spots: FloatArray) -> FloatArray:
        """What spots do by the table; see :class:`Solver`."""
        return np.asarray(self._spots.expanded(spots))

    def keep(
        self, direct: FloatArray, timed: FloatArray, matrix: FloatArray, squares: FloatArray
    ) -> Any:
        """What the engine keeps of it; see :class:`Solver`."""
        return self._core.SeenTable(direct, timed, matrix, self.table.basis, squares)

    def settled(
        self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()
    ) -> Fit:
        """The minimum near ``spots``; see :class:`Solver`."""
        known = known or newcomers(len(spots))
        kept, offset = problem.seen.kept, deficit.change
        return _fit(
            problem, deficit, self._spots.settled(kept, problem, offset, spots, known, most)
        )

    def searched(
        self,
        problem: Problem,
        matched: Matched,
        policy: DetectionPolicy,
        deficit: Deficit,
        before: FloatArray,
    ) -> Answer | None:
        """The touches in one call; see :class:`Solver`."""
        if policy.pace.rounds or policy.pace.joint:
            return None
        kept, limits = problem.seen.kept, Limits.of(problem.sign)
        fit, bare, others, more = self._spots.searched(
            kept, problem, deficit.change, before, matched, limits, policy
        )
        if bare:
            deficit = Deficit.none(len(self.table.basis))
        more = more and _fit(problem, deficit, more)
        return Answer(_fit(problem, deficit, fit), others and tuple(others), more)

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        """How sure each spot is; see :class:`Solver`."""
        change = fit.change + fit.deficit.change
        squares, covariance = problem.seen.kept.judged(fit, change, uneven, RIDGE)
        return squares, covariance

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        """How far each spot stands out; see :class:`Solver`."""
        return np.asarray(self._core.standing(left, fit.slopes, fit.each, RIDGE))

    def standing_out(
        self, matched: Matched, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        """How far candidates stand out; see :class:`Solver`."""
        signatures, squares = matched.signatures, matched.squares
        ratio, content = self._core.standing_out(
            signatures, squares, fit.unknown, fit.slopes, fit.residual, limits
        )
        return ratio, content


def _fit(problem: Problem, deficit: Deficit, named: dict[str, Any]) -> Fit:
    degrees = max(len(problem.seen.full) - len(named["gradient"]), 1)
    return Fit(deficit=deficit, degrees=degrees, **named)
