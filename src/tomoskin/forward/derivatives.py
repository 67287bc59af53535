"""Derivatives of the voltages, and the power, from the fields of a state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.forward.assembly import electrode_forms

if TYPE_CHECKING:
    from tomoskin.forward.state import State


def by_conductivity(state: State) -> NDArray[Any]:
    """See :attr:`State.jacobian`."""
    if state.conductivity.ndim > 1:
        return _by_tensor(state)
    model = state.model
    return model.engine.jacobian(state.gradient, model.pattern, model.current)


def _by_tensor(state: State) -> NDArray[Any]:
    """−I ∫ ∂_a u_drive ∂_b u_measure, symmetric in a and b."""
    pattern = state.model.pattern
    d = state.conductivity.shape[1]
    n_cells = len(state.conductivity)
    gradient = state.gradient.reshape(len(state.gradient), d, -1, n_cells)
    driven = gradient[pattern.drive[:, 1]] - gradient[pattern.drive[:, 0]]
    read = gradient[pattern.measure[:, 0]] - gradient[pattern.measure[:, 1]]
    product = np.einsum("maqc,mbqc->mcab", driven, read)
    current = state.model.current[pattern.drive_index][:, None, None, None]
    return np.asarray(current * (product + product.swapaxes(-1, -2)) / 2.0)


def by_contact_impedance(state: State) -> NDArray[Any]:
    """See :attr:`State.contact_jacobian`.

    ∂R/∂z_l = z_l⁻² ∫_l (u_i − U_i)(u_j − U_j), with the basis fields i and j.
    """
    z, fields, columns = state.model.contact_impedance, grounded(state), []
    for number, (unknown, form) in enumerate(electrode_forms(state.model.assembly.element)):
        resistance = fields[unknown].T @ form @ fields[unknown] / z[number] ** 2
        columns.append(state.model.voltages(resistance))
    return np.stack(columns, axis=1)


def grounded(state: State) -> NDArray[Any]:
    """(n_unknowns + 1, n_electrodes) V/A: the basis with the ground electrode, which is zero."""
    assembly = state.model.assembly
    fields = np.zeros((assembly.n_unknowns + 1, assembly.n_electrodes), state.basis.dtype)
    fields[:-1, :-1] = state.basis
    return fields


def power(state: State) -> NDArray[Any]:
    """See :attr:`State.power`."""
    model, gradient = state.model, state.gradient
    n_cells = len(state.conductivity)
    drives = model.pattern.drives
    field = model.current[:, None, None] * (gradient[drives[:, 0]] - gradient[drives[:, 1]])
    if state.conductivity.ndim == 1:
        return np.asarray(np.sum(np.abs(field) ** 2, axis=1) * state.conductivity.real)
    d = state.conductivity.shape[1]
    field = field.reshape(len(field), d, -1, n_cells)
    flow = np.einsum("cab,kbqc->kaqc", state.conductivity, field)
    return np.asarray(np.einsum("kaqc,kaqc->kc", field.conj(), flow).real)
