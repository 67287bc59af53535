"""Derivatives of the voltages, and the power, from the fields of a state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import ModelError
from tomoskin.forward.assembly import electrode_forms
from tomoskin.forward.element import barycentric_gradients

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
    assembly, z = state.model.assembly, state.model.contact_impedance
    fields = np.zeros((assembly.n_unknowns + 1, assembly.n_electrodes), state.basis.dtype)
    fields[:-1, :-1] = state.basis  # the ground electrode's row and column are zero
    columns = []
    for number, (unknown, form) in enumerate(electrode_forms(assembly.element)):
        resistance = fields[unknown].T @ form @ fields[unknown] / z[number] ** 2
        columns.append(state.model.voltages(resistance))
    return np.stack(columns, axis=1)


def by_movement(state: State) -> NDArray[Any]:
    """See :attr:`State.movement_jacobian`.

    When the mesh moves with velocity v, linear in each cell, the integral of σ∇u·∇w changes by
    that of σ(div v ∇u·∇w − ∇uᵀ(∇v + ∇vᵀ)∇w); an electrode that moves as a whole keeps its form.
    """
    model, mesh = state.model, state.model.mesh
    if model.order != 1 or state.conductivity.ndim > 1:
        raise ModelError("movement needs elements of order 1 and a scalar conductivity")
    linear = barycentric_gradients(mesh)
    d = mesh.points.shape[1]
    out = np.empty((model.pattern.n_meas, len(mesh.electrodes), d), state.gradient.dtype)
    for number, facets in enumerate(mesh.electrodes):
        moved = np.isin(mesh.cells, facets)
        cells = np.flatnonzero(moved.any(axis=1))
        # (cells, d): gradient of the function that is one on the electrode and zero elsewhere
        weight = np.einsum("ck,ckd->cd", moved[cells].astype(float), linear[cells])
        field = state.gradient[:, :, cells]
        along = np.einsum("cd,edc->ec", weight, field)
        sigma = state.conductivity[cells]
        square = np.einsum("eac,fac,c->efc", field, field, sigma)
        for axis in range(d):
            cross = np.einsum("ec,fc,c->ef", along, field[:, axis], sigma)
            spread = square @ weight[:, axis]
            out[:, number, axis] = model.voltages(cross + cross.T - spread)
    return out


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
