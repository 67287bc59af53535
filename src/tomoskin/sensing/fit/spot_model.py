"""What is made once for fitting touches on a skin: the sheet, tables, candidates, a solver."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from tomoskin.core import FloatArray, SkinError, finished
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit.candidates import Candidates, footprints_of
from tomoskin.sensing.fit.certificate import Reduced
from tomoskin.sensing.fit.expectation import Known, newcomers
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.problem import RIDGE, Answer, Limits, Matched, Problem, Solver
from tomoskin.sensing.fit.profile import FILLING, Profile
from tomoskin.sensing.fit.solver import NumpySolver, SheetDomain
from tomoskin.sensing.fit.spot import CONTENT, Footprints, Response
from tomoskin.sensing.fit.spot_fit import Deficit, Fit, SpotPrior
from tomoskin.sensing.fit.strained_sheet import StrainedSheet
from tomoskin.sensing.fit.table import ResponseTable
from tomoskin.sensing.fit.tabulate import Tabulation, kept_tabulation
from tomoskin.sensing.fit.uneven_sheet import fields_of, fitting_sheet


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


_CELLS = 1500
"""Of the mesh that spots are fitted on: their profile is smooth, and a frame is quick."""


@dataclass(frozen=True, eq=False)
class SpotModel:
    """What is made once for a skin and pattern; a table only where touches are fitted on it.

    Attributes
    ----------
    response
        The forward model with spots on it.
    prior
        What is likely of a spot.
    sign
        Of the touches, as in a skin's ``[touch]``.
    scale
        (n_meas,) 1/V by which the model's changes become difference data; ones where these are
        in volts.
    even
        The model that an uneven sheet's began from; None where this is it.
    """

    response: Response
    prior: SpotPrior
    sign: str
    scale: FloatArray
    even: SpotModel | None = None

    @classmethod
    def of(cls, skin: Skin, model: ForwardModel) -> Self:
        """For ``skin`` with the pattern of ``model``, on a mesh of its own.

        Raises
        ------
        ModelError
            When the mesh has no flat coordinates.
        """
        own = ForwardModel(_mesh(skin), model.pattern, model.contact_impedance, model.current)
        normalised = skin.inverse.difference == "normalised"
        state, n_meas = own.at(skin.conductivity), own.pattern.n_meas
        response = Response(state, Profile.on(skin.layer))
        scale = 1 / np.abs(response.reference) if normalised else np.ones(n_meas)
        return cls(response, SpotPrior.of(own.mesh, skin.layer), skin.touch.sign, scale)

    @cached_property
    def tabulation(self) -> Tabulation:
        """What one spot does, tabulated: seconds of work, unless it is on disk."""
        return kept_tabulation(self.response, self.prior, self.sign)

    @cached_property
    def candidates(self) -> Candidates:
        """Where touches are looked for."""
        return Candidates.of(self.response, self.prior)

    @cached_property
    def strained(self) -> StrainedSheet:
        """The sheet with smooth strains all over."""
        return StrainedSheet(self.response)

    @cached_property
    def _feet(self) -> tuple[Footprints, ...]:
        """Of the candidates, for uneven sheets."""
        return footprints_of(self.response, self.prior)

    @cached_property
    def solver(self) -> Solver:
        """What fits spots by a table of what one does."""
        return self._solver_of(self.tabulation.table)

    @cached_property
    def reduced(self) -> Reduced:
        """What stands for the exact model on this sheet."""
        return finished(Reduced.making(self.response, self.tabulation.certificate, self.prior))

    @cached_property
    def sheet(self) -> SheetDomain:
        """The sheet that touches may be on."""
        return SheetDomain(self.response.spots.mesh)

    def _solver_of(self, table: ResponseTable) -> Solver:
        """A solver of the native engine where that runs."""
        core = self.response.state.model.engine.core
        if core is None:
            return NumpySolver(table, self.sheet, self.prior)
        return NativeSolver(core, table, self.sheet, self.prior)

    def warm_up(self) -> None:
        """Do what takes seconds the first time, and half a second later on, before frames come."""
        _ = self.tabulation.lattices, self.candidates, self._feet, self.solver, self.reduced
        _ = fields_of(self.response.spots.mesh)
        self.strained.warm_up()

    def changes(self, spots: FloatArray) -> FloatArray:
        """(k, n_meas) V that each of ``spots`` (k, 4) alone adds to the reference, by the table."""
        return np.asarray(self.solver.expanded(spots)[:, 0] @ self.solver.table.basis)

    def shapes(self, spot: FloatArray) -> FloatArray:
        """(4, n_meas) V: what a ``spot`` (4,) changes, and its slopes by place and radius."""
        own = self.solver.expanded(spot[None])[0, : 1 + CONTENT]
        return np.asarray(own @ self.solver.table.basis)

    def fitting(
        self, reference: FloatArray, deviation: FloatArray | float = 0.0
    ) -> Generator[None, None, SpotModel]:
        """The model of the sheet that a ``reference`` (n_meas,) V shows, a piece between yields.

        Itself where that sheet is even. ``deviation`` (n_meas,) V is the reference's own; see
        :mod:`tomoskin.sensing.fit.uneven_sheet`.
        """
        state = yield from fitting_sheet(self.response.state, reference, deviation)
        if state is self.response.state:
            return self
        response = Response(state, self.response.spots.profile)
        table = yield from self.tabulation.adapted(response)
        certificate = yield from self.tabulation.certificate.adapted(response, table)
        candidates = yield from self.candidates.adapted(self.response, response, self._feet)
        scale = self.scale
        if (scale != 1.0).any():
            scale = 1 / np.abs(response.reference)
        made = replace(self, response=response, scale=scale, even=self)
        yield
        reduced = yield from Reduced.making(response, certificate, self.prior)
        yield
        solver = made._solver_of(table)
        strained = self.strained.adapted(response)
        vars(made).update(candidates=candidates, reduced=reduced, solver=solver, strained=strained)
        table.__dict__["typical"] = yield from table.typifying()
        return made


def _mesh(skin: Skin) -> Mesh:
    """Of its own; the skin's where so few cells do not resolve the electrodes."""
    try:
        return skin.altered({"mesh": {"cells": _CELLS}}).mesh()
    except SkinError:
        return skin.mesh()
