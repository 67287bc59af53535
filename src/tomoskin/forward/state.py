"""The model at one conductivity: factorised once, asked many things."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.forward.factor import factorise, solve_checked
from tomoskin.forward.solution import Solution

if TYPE_CHECKING:
    from tomoskin.forward.model import ForwardModel


@dataclass(frozen=True, eq=False)
class State:
    """A forward model at a conductivity (n_cells,).

    Everything follows from one basis: the fields of 1 A into each electrode and out at the last.
    """

    model: ForwardModel
    conductivity: NDArray[Any]

    @cached_property
    def _basis(self) -> tuple[NDArray[Any], float]:
        assembly = self.model.assembly
        n_basis = assembly.n_electrodes - 1
        matrix = assembly.matrix(self.conductivity, self.model.contact_impedance)
        rhs = np.zeros((assembly.n_unknowns, n_basis), dtype=matrix.dtype)
        rhs[assembly.n_points + np.arange(n_basis), np.arange(n_basis)] = 1.0
        return solve_checked(matrix, factorise(matrix), rhs)

    @cached_property
    def transfer_resistance(self) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω: potentials = R @ currents, for currents that sum to 0.

        Symmetric (reciprocity, Geselowitz 1971); rows and columns sum to zero.
        """
        n = self.model.assembly.n_electrodes
        grounded = np.zeros((n, n), dtype=self._basis[0].dtype)
        grounded[:-1, :-1] = self._basis[0][self.model.assembly.n_points :]
        rows = grounded - grounded.mean(axis=0)
        return np.asarray(rows - rows.mean(axis=1, keepdims=True))

    @cached_property
    def solution(self) -> Solution:
        """Voltages and potentials for every drive of the pattern."""
        model, resistance = self.model, self.transfer_resistance
        electrode = model.current[:, None] * _difference(resistance, model.pattern.drives)
        pattern = model.pattern
        rows, (plus, minus) = pattern.drive_index, pattern.measure.T
        return Solution(
            voltages=electrode[rows, plus] - electrode[rows, minus],
            electrode_potentials=electrode,
            potentials=self._nodal(electrode),
            residual=self._basis[1],
        )

    def _nodal(self, electrode: NDArray[Any]) -> NDArray[Any]:
        """(n_drive, n_points): shifted so that it belongs to ``electrode``'s zero."""
        model = self.model
        fields = np.zeros((model.assembly.n_electrodes, model.assembly.n_points), electrode.dtype)
        fields[:-1] = self._basis[0][: model.assembly.n_points].T
        nodal = model.current[:, None] * _difference(fields.T, model.pattern.drives)
        return np.asarray(nodal + electrode[:, -1:])

    @cached_property
    def _gradient(self) -> NDArray[Any]:
        """(n_electrodes, d, n_cells): √volume-scaled gradient of each basis field."""
        n, operator = self.model.assembly.n_electrodes, self.model.gradient
        fields = self._basis[0][: self.model.assembly.n_points]
        gradient = np.zeros((n, operator.shape[0]), dtype=fields.dtype)
        gradient[:-1] = (operator @ fields).T
        return gradient.reshape(n, -1, len(self.conductivity))

    @cached_property
    def jacobian(self) -> NDArray[Any]:
        """(n_meas, n_cells) V/S: −I ∫ ∇u_drive · ∇u_measure over each cell (Polydorides 2002).

        u_drive and u_measure are the fields of 1 A through the driven and the measured pair.
        """
        model, pattern, gradient = self.model, self.model.pattern, self._gradient
        out = np.empty((pattern.n_meas, gradient.shape[-1]), dtype=gradient.dtype)
        for drive, (source, sink) in enumerate(pattern.drives):
            rows = np.flatnonzero(pattern.drive_index == drive)
            driven = model.current[drive] * (gradient[sink] - gradient[source])
            plus, minus = pattern.measure[rows].T
            projected = np.einsum("edc,dc->ec", gradient, driven)
            out[rows] = projected[plus] - projected[minus]
        return out


def _difference(columns: NDArray[Any], pairs: NDArray[np.int64]) -> NDArray[Any]:
    """(n, n_electrodes) fields → (n_pairs, n): first electrode of each pair minus the second."""
    return np.asarray((columns[:, pairs[:, 0]] - columns[:, pairs[:, 1]]).T)
