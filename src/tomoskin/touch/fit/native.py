"""The arithmetic of a fit by the native engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.touch.fit.prior import SpotPrior
from tomoskin.touch.fit.refine import Deficit, Fit, Limits, Problem
from tomoskin.touch.fit.solver import DIRECTED, RESHAPED, RIDGE, SheetDomain
from tomoskin.touch.fit.spot import FILLING
from tomoskin.touch.fit.table import ResponseTable


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

    def keep(self, direct: FloatArray, timed: FloatArray) -> Any:
        """See :class:`Solver`."""
        return self._core.SeenTable(direct, timed)

    def settled(self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int) -> Fit:
        """See :class:`Solver`."""
        deviations = (DIRECTED, RESHAPED, problem.reach, problem.grows)
        matrices, vectors, (misfit, log_size, cost, settled) = self._spots.settled(
            problem.seen.kept,
            problem.data,
            problem.rest,
            problem.left,
            deficit.change,
            spots,
            deviations,
            self._prior.depths(problem.sign),
            most,
        )
        found, each, slopes, unknown, normal = matrices
        predicted, residual, gradient = vectors
        return Fit(
            spots=found,
            deficit=deficit,
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
        )

    def projected(self, unknown: FloatArray, free: FloatArray, rows: FloatArray) -> FloatArray:
        """See :class:`Solver`."""
        return np.asarray(self._core.projected(unknown, free, rows, RIDGE))

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
