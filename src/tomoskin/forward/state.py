"""The model at one conductivity: factorised once, asked many things."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.forward import derivatives
from tomoskin.forward.accuracy import checked_voltages, error_of_drives
from tomoskin.forward.factor import Compressed, Factor, solve_checked
from tomoskin.forward.movement import by_movement
from tomoskin.forward.pairs import centred, pair_differences
from tomoskin.forward.solution import Solution
from tomoskin.forward.update import LocalUpdate

if TYPE_CHECKING:
    from tomoskin.forward.model import ForwardModel


@dataclass(frozen=True, eq=False)
class State:
    """A forward model at a conductivity, (n_cells,) or a tensor per cell (n_cells, d, d).

    Everything follows from one basis: the fields of 1 A into each electrode and out at the last.
    """

    model: ForwardModel
    conductivity: NDArray[Any]

    @cached_property
    def factor(self) -> Factor:
        """The factorised system."""
        return self.model.factorise(self._matrix.values)

    @cached_property
    def _matrix(self) -> Compressed:
        return self.model.assembly.matrix(self.conductivity, self.model.contacts)

    @cached_property
    def _solved(self) -> tuple[NDArray[Any], NDArray[Any], float]:
        assembly = self.model.assembly
        n_basis = assembly.n_electrodes - 1
        rhs = np.zeros((assembly.n_unknowns, n_basis), dtype=self._matrix.values.dtype)
        rhs[assembly.n_points :].flat[:: n_basis + 1] = 1.0
        matrix = self._matrix
        basis, lost, largest = solve_checked(self.model.engine, matrix, self.factor, rhs)
        voltages = checked_voltages(
            self.model,
            basis[assembly.n_points :],
            lost,
            sharper=lambda: error_of_drives(self.model, matrix.matrix, basis),
        )
        return basis, voltages, largest

    @property
    def basis(self) -> NDArray[Any]:
        """(n_unknowns, n_electrodes − 1) V/A: the last electrode is at zero."""
        return self._solved[0]

    @cached_property
    def transfer_resistance(self) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω: potentials = R @ currents, for currents that sum to 0.

        Symmetric (reciprocity, Geselowitz 1971); rows and columns sum to zero.
        """
        return centred(self.basis[self.model.assembly.n_points :])

    @property
    def voltages(self) -> NDArray[Any]:
        """(n_meas,) V of the pattern."""
        return self._solved[1]

    @property
    def residual(self) -> float:
        """Largest relative residual of the linear solves."""
        return self._solved[2]

    @property
    def solution(self) -> Solution:
        """Voltages and potentials for every drive of the pattern."""
        self._solved  # noqa: B018  # what has no answer is refused now, not at the first look
        return Solution(self)

    @cached_property
    def electrode_potentials(self) -> NDArray[Any]:
        """(n_drive, n_electrodes) V; each row sums to zero, which fixes the free constant."""
        model, resistance = self.model, self.transfer_resistance
        differences = pair_differences(resistance, model.pattern.drives)
        return np.asarray(model.current[:, None] * differences)

    @cached_property
    def potentials(self) -> NDArray[Any]:
        """(n_drive, n_points) V at the mesh's points."""
        model = self.model
        nodal = model.current[:, None] * pair_differences(self._nodal, model.pattern.drives)
        return np.asarray(nodal + self.electrode_potentials[:, -1:])

    @property
    def _nodal(self) -> NDArray[Any]:
        """(n_electrodes, n_points): basis fields at the mesh's points."""
        assembly = self.model.assembly
        fields = np.zeros((assembly.n_electrodes, len(self.model.mesh.points)), self.basis.dtype)
        fields[:-1] = self.basis[: fields.shape[1]].T
        return fields

    @cached_property
    def gradient(self) -> NDArray[Any]:
        """(n_electrodes, d·q, n_cells): scaled gradient of each basis field, see Element."""
        n, operator = self.model.assembly.n_electrodes, self.model.gradient
        fields = self.basis[: self.model.assembly.n_points]
        gradient = np.empty((n, operator.shape[0]), dtype=fields.dtype)
        gradient[-1] = 0.0
        self.model.engine.fields(operator, fields, gradient[:-1])
        return gradient.reshape(n, -1, len(self.conductivity))

    @cached_property
    def jacobian(self) -> NDArray[Any]:
        """(n_meas, n_cells) V/S; for a tensor (n_meas, n_cells, d, d), by each component.

        −I ∫ ∇u_drive · ∇u_measure over each cell (Polydorides & Lionheart 2002): the fields of
        1 A through the driven and the measured pair.
        """
        return derivatives.by_conductivity(self)

    @cached_property
    def contact_jacobian(self) -> NDArray[Any]:
        """(n_meas, n_electrodes): derivative by each contact impedance, V per Ω·m (or Ω·m²)."""
        return derivatives.by_contact_impedance(self)

    @cached_property
    def movement_jacobian(self) -> NDArray[Any]:
        """(n_meas, n_electrodes, n_coordinates) V/m: derivative by the place of each electrode.

        The electrode's points move with it, also those that it shares with another electrode,
        and all others stay (Soleimani, Gómez-Laberge & Adler 2006); only for scalar
        conductivity and elements of order 1.
        """
        return by_movement(self)

    @cached_property
    def power(self) -> NDArray[Any]:
        """(n_drive, n_cells) W: power turned to heat in each cell, its real part."""
        return derivatives.power(self)

    @cached_property
    def local(self) -> LocalUpdate:
        """Exact voltages when few cells change, without a new factorisation."""
        return LocalUpdate(self.model, self.conductivity, basis=self.basis, solve=self.factor.solve)
