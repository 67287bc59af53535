"""What is made once for fitting touches on a skin: the sheet, tables, candidates, a solver."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, SkinError, finished
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit.candidates import Candidates, footprints_of
from tomoskin.sensing.fit.certificate import Certificate, Reduced
from tomoskin.sensing.fit.native import NativeSolver
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.problem import Solver
from tomoskin.sensing.fit.sheet import fields_of, fitting_sheet
from tomoskin.sensing.fit.solver import NumpySolver, SheetDomain
from tomoskin.sensing.fit.spot import Footprints, Response
from tomoskin.sensing.fit.table import ResponseTable
from tomoskin.sensing.fit.tabulate import Tabulation, kept_tabulation

_CELLS = 1500
"""Of the mesh that spots are fitted on: their profile is smooth, and a frame is quick."""


@dataclass(frozen=True, eq=False)
class Adapted:
    """What an even sheet's model became for an uneven one.

    Attributes
    ----------
    table, certificate, candidates
        See :class:`ResponseTable`, :class:`Certificate` and :class:`Candidates`.
    """

    table: ResponseTable
    certificate: Certificate
    candidates: Candidates


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
    adapted
        Of an uneven sheet; None: what there is is made for this one.
    even
        The model that an uneven sheet's began from; None where this is it.
    """

    response: Response
    prior: SpotPrior
    sign: str
    scale: FloatArray
    adapted: Adapted | None = None
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
        response, n_meas = Response(own.at(skin.conductivity)), own.pattern.n_meas
        scale = 1 / np.abs(response.reference) if normalised else np.ones(n_meas)
        return cls(response, SpotPrior.of(own.mesh), skin.touch.sign, scale)

    @cached_property
    def tabulation(self) -> Tabulation:
        """What one spot does, tabulated: seconds of work, unless it is on disk."""
        return kept_tabulation(self.response, self.prior, self.sign)

    @cached_property
    def candidates(self) -> Candidates:
        """Where touches are looked for."""
        if self.adapted is not None:
            return self.adapted.candidates
        return Candidates.of(self.response, self.prior)

    @cached_property
    def _feet(self) -> tuple[Footprints, ...]:
        """Of the candidates, for uneven sheets."""
        return footprints_of(self.response, self.prior)

    @cached_property
    def solver(self) -> Solver:
        """What fits spots by a table of what one does."""
        made = self.tabulation if self.adapted is None else self.adapted
        return _solver(self.response, made.table, self.prior)

    @cached_property
    def reduced(self) -> Reduced:
        """What stands for the exact model on this sheet."""
        made = self.tabulation if self.adapted is None else self.adapted
        return finished(Reduced.making(self.response, made.certificate, self.prior))

    def warm_up(self) -> None:
        """Do what takes seconds the first time, and half a second later on, before frames come."""
        _ = self.tabulation.lattices, self.candidates, self._feet, self.solver, self.reduced
        _ = fields_of(self.response.spots.mesh)

    def changes(self, spots: FloatArray) -> FloatArray:
        """(k, n_meas) V that each of ``spots`` (k, 4) alone adds to the reference, by the table."""
        return np.asarray(self.solver.expanded(spots)[:, 0] @ self.solver.table.basis)

    def fitting(
        self, reference: FloatArray, deviation: FloatArray | float = 0.0
    ) -> Generator[None, None, SpotModel]:
        """The model of the sheet that a ``reference`` (n_meas,) V shows, a piece between yields.

        Itself where that sheet is even. ``deviation`` (n_meas,) V is the reference's own; see
        :mod:`tomoskin.sensing.fit.sheet`.
        """
        state = yield from fitting_sheet(self.response.state, reference, deviation)
        if state is self.response.state:
            return self
        response = Response(state)
        table = yield from self.tabulation.adapted(response)
        certificate = yield from self.tabulation.certificate.adapted(response, table)
        candidates = yield from self.candidates.adapted(self.response, response, self._feet)
        scale = self.scale
        if (scale != 1.0).any():
            scale = 1 / np.abs(response.reference)
        adapted = Adapted(table, certificate, candidates)
        made = replace(self, response=response, scale=scale, adapted=adapted, even=self)
        yield
        made.__dict__["reduced"] = yield from Reduced.making(response, certificate, self.prior)
        yield
        _ = made.solver
        table.__dict__["typical"] = yield from table.typifying()
        return made


def _solver(response: Response, table: ResponseTable, prior: SpotPrior) -> Solver:
    """Of the native engine where that runs."""
    sheet = SheetDomain(response.spots.mesh)
    core = response.state.model.engine.core
    if core is None:
        return NumpySolver(table, sheet, prior)
    return NativeSolver(core, table, sheet, prior)


def _mesh(skin: Skin) -> Mesh:
    """Of its own; the skin's where so few cells do not resolve the electrodes."""
    try:
        return skin.altered({"mesh": {"cells": _CELLS}}).mesh()
    except SkinError:
        return skin.mesh()
