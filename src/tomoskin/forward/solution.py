"""What a solve gives: the fields of one conductivity, and all that is a product of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.forward.system import System


@dataclass(frozen=True, eq=False)
class Solution:
    """Potentials and voltages for one conductivity; complex where σ or z is.

    What is more than the voltages is computed when it is asked for, once.

    Attributes
    ----------
    model
        What was solved.
    conductivity
        (n_cells,), or a tensor per cell (n_cells, d, d), S or S/m.
    basis
        (n_unknowns, n_electrodes − 1) V/A: fields of 1 A into each electrode and out at the last,
        which is at zero.
    voltages
        (n_meas,) V, in the pattern's order.
    residual
        Largest relative residual of the linear solves.
    """

    model: System
    conductivity: NDArray[Any]
    basis: NDArray[Any]
    voltages: NDArray[Any]
    residual: float

    @cached_property
    def transfer_resistance(self) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω: potentials = R @ currents, for currents that sum to 0.

        Symmetric (reciprocity, Geselowitz 1971); rows and columns sum to zero.
        """
        return centred(self.basis[self.model.assembly.n_points :])

    @cached_property
    def electrode_potentials(self) -> NDArray[Any]:
        """(n_drive, n_electrodes) V; each row sums to zero, which fixes the free constant."""
        return self._of_drives(self.transfer_resistance)

    @cached_property
    def potentials(self) -> NDArray[Any]:
        """(n_drive, n_points) V at the mesh's points."""
        model = self.model
        fields = np.zeros((model.assembly.n_electrodes, len(model.mesh.points)), self.basis.dtype)
        fields[:-1] = self.basis[: fields.shape[1]].T
        return np.asarray(self._of_drives(fields) + self.electrode_potentials[:, -1:])

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
    def power(self) -> NDArray[Any]:
        """(n_drive, n_cells) W: power turned to heat in each cell, its real part."""
        model, gradient = self.model, self.gradient
        source, sink = model.pattern.drives.T
        field = model.current[:, None, None] * (gradient[source] - gradient[sink])
        if self.conductivity.ndim == 1:
            return np.asarray(np.sum(np.abs(field) ** 2, axis=1) * self.conductivity.real)
        n_cells, d, _ = self.conductivity.shape
        field = field.reshape(len(field), d, -1, n_cells)
        flow = np.einsum("cab,kbqc->kaqc", self.conductivity, field)
        return np.asarray(np.einsum("kaqc,kaqc->kc", field.conj(), flow).real)

    def _of_drives(self, fields: NDArray[Any]) -> NDArray[Any]:
        """(n_drive, …): fields (n_electrodes, …) of 1 A → those of each drive's current."""
        source, sink = self.model.pattern.drives.T
        return np.asarray(self.model.current[:, None] * (fields[source] - fields[sink]))


def centred(grounded: NDArray[Any]) -> NDArray[Any]:
    """Transfer resistance against the ground electrode → rows and columns that sum to zero."""
    full = padded(grounded)
    rows = full - full.mean(axis=-2, keepdims=True)
    return np.asarray(rows - rows.mean(axis=-1, keepdims=True))


def padded(grounded: NDArray[Any]) -> NDArray[Any]:
    """Transfer resistance against the ground electrode, with its row and column of zeros.

    Voltages are taken from this one: the means that centring subtracts would carry the digits
    lost to one bad contact into all electrodes.
    """
    n = grounded.shape[-1] + 1
    full = np.zeros((*grounded.shape[:-2], n, n), dtype=grounded.dtype)
    full[..., :-1, :-1] = grounded
    return full
