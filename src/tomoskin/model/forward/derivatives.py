"""Derivatives of the voltages: by conductivity, contact impedance and position of electrodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.forward.assembly import barycentric_gradients, electrode_forms
from tomoskin.model.forward.solution import Solution
from tomoskin.model.pattern import Pattern


def by_conductivity(solution: Solution) -> NDArray[Any]:
    """Derivative of the voltages; see :attr:`State.jacobian`."""
    if solution.conductivity.ndim > 1:
        return _by_tensor(solution)
    model = solution.model
    gradient, pattern = solution.gradient, model.pattern
    if pattern.spread:
        # A drive's field is that of one more electrode, against the last one's, which is zero.
        n, more = len(gradient), pattern.n_drive
        drives = np.column_stack([n + np.arange(more), np.full(more, n - 1)])
        gradient = np.concatenate([gradient, np.tensordot(pattern.currents, gradient, 1)])
        pattern = Pattern(n + more, drives, pattern.drive_index, pattern.measure)
    return model.engine.jacobian(gradient, pattern, model.current)


def along(solution: Solution, change: ArrayLike) -> NDArray[Any]:
    """See :meth:`State.jvp`: −∫ δσ ∇u_i · ∇u_j of all pairs of electrodes, then the voltages."""
    moved = _checked(solution, change, len(solution.model.mesh.cells), "change")
    field = solution.gradient.reshape(len(solution.gradient), -1)
    points = solution.gradient.shape[1]
    flat = moved.reshape(-1, moved.shape[-1])
    parts = [(field * np.tile(one, points)) @ field.T for one in flat]
    return solution.model.voltages(-np.array(parts)).reshape(*moved.shape[:-1], -1)


def against(solution: Solution, weights: ArrayLike) -> NDArray[Any]:
    """See :meth:`State.vjp`: the fields of the weighted measurements, times those of the drives."""
    model, pattern = solution.model, solution.model.pattern
    weight = _checked(solution, weights, pattern.n_meas, "weights")
    field, out = solution.gradient, []
    driven = model.drive_currents[pattern.drive_index].T
    for one in weight.reshape(-1, pattern.n_meas):
        pairs = (driven * one) @ solution.model.readers
        out.append(-np.einsum("eqc,eqc->c", field, np.tensordot(pairs, field, 1)))
    return np.array(out).reshape(*weight.shape[:-1], field.shape[2])


def _checked(solution: Solution, values: ArrayLike, count: int, name: str) -> NDArray[Any]:
    """(…, ``count``) numbers to multiply. Raises ModelError for another shape, what is not finite,
    or a sheet of tensors."""
    array = np.asarray(values)
    if array.ndim < 1 or array.shape[-1] != count:
        raise ModelError(f"expected {name} of shape (…, {count}), got {array.shape}")
    if not np.isfinite(array).all():
        raise ModelError(f"expected finite {name}, got others")
    if solution.conductivity.ndim > 1:
        raise ModelError(
            "expected one conductivity per cell, got tensors",
            hint="take the product with the state's jacobian",
        )
    return array


def _by_tensor(solution: Solution) -> NDArray[Any]:
    """−I ∫ ∂_a u_drive ∂_b u_measure, symmetric in a and b."""
    pattern = solution.model.pattern
    n_cells, d, _ = solution.conductivity.shape
    gradient = solution.gradient.reshape(pattern.n_electrodes, d, -1, n_cells)
    driven = np.tensordot(-solution.model.drive_currents, gradient, 1)[pattern.drive_index]
    read = np.tensordot(solution.model.readers, gradient, 1)
    product = np.einsum("maqc,mbqc->mcab", driven, read)
    return np.asarray((product + product.swapaxes(-1, -2)) / 2.0)


def by_contact_impedance(solution: Solution) -> NDArray[Any]:
    """See :attr:`State.contact_jacobian`.

    ∂R/∂z_l = z_l⁻² ∫_l (u_i − U_i)(u_j − U_j), with the basis fields i and j.
    """
    model, fields, columns = solution.model, _with_ground(solution.basis), []
    for number, (unknown, form) in enumerate(electrode_forms(model.assembly.element)):
        z = model.contact_impedance[number]
        resistance = fields[unknown].T @ form @ fields[unknown] / z**2
        columns.append(model.voltages(resistance))
    return np.stack(columns, axis=1)


def by_movement(solution: Solution) -> NDArray[Any]:
    """See :attr:`State.movement_jacobian`.

    When the mesh moves with velocity v, linear in each cell, the integral of σ∇u·∇w changes by
    that of σ(div v ∇u·∇w − ∇uᵀ(∇v + ∇vᵀ)∇w). An electrode all of whose points move keeps its
    form; one that shares points with it is stretched, and its form with it.
    """
    model, mesh = solution.model, solution.model.mesh
    if model.order != 1 or solution.conductivity.ndim > 1:
        raise ModelError("movement needs elements of order 1 and a scalar conductivity")
    if mesh.metric is not None:
        raise ModelError("movement needs the sheet's true shape, not a metric")
    d = mesh.points.shape[1]
    out = np.empty((model.pattern.n_meas, len(mesh.electrodes), d), solution.gradient.dtype)
    for number, facets in enumerate(mesh.electrodes):
        moved = np.zeros(len(mesh.points), dtype=bool)
        moved[facets] = True
        change = _in_cells(solution, moved) + _in_contacts(solution, moved)
        for axis in range(d):
            out[:, number, axis] = model.voltages(change[axis])
    return out


def _in_cells(solution: Solution, moved: NDArray[np.bool_]) -> NDArray[Any]:
    """(d, n_electrodes, n_electrodes) Ω/m: change of R as the cells at ``moved`` points deform."""
    mesh = solution.model.mesh
    corner = moved[mesh.cells]
    cells = np.flatnonzero(corner.any(axis=1))
    slope = _slope(mesh.points, mesh.cells[cells], corner[cells])
    sigma, field = solution.conductivity[cells], solution.gradient[:, :, cells]
    along = np.einsum("cd,edc->ec", slope, field)
    square = np.einsum("eac,fac,c->efc", field, field, sigma)
    cross = np.einsum("ec,fdc,c->def", along, field, sigma)
    return np.asarray(cross + cross.swapaxes(1, 2) - np.moveaxis(square @ slope, -1, 0))


def _in_contacts(solution: Solution, moved: NDArray[np.bool_]) -> NDArray[Any]:
    """The same as electrodes are stretched of which only some points move."""
    model, mesh = solution.model, solution.model.mesh
    element, fields = model.assembly.element, _with_ground(solution.basis)
    n_el, d = len(mesh.electrodes), mesh.points.shape[1]
    change = np.zeros((d, n_el, n_el), fields.dtype)
    for number, facets in enumerate(mesh.electrodes):
        corner = moved[facets]
        part = corner.any(axis=1) & ~corner.all(axis=1)
        if part.any():
            slope = _slope(mesh.points, facets[part], corner[part])
            growth = slope * element.facet_sizes[number][part, None]
            drop = fields[facets[part]] - fields[element.n_nodes + number]
            square = np.einsum("kie,ij,kjf->kef", drop, element.facet_mass, drop)
            change -= np.einsum("kef,kd->def", square, growth) / model.contact_impedance[number]
    return change


def _with_ground(basis: NDArray[Any]) -> NDArray[Any]:
    """(n_unknowns + 1, n_electrodes) V/A: the basis with the ground electrode, which is zero."""
    rows, columns = basis.shape
    fields = np.zeros((rows + 1, columns + 1), basis.dtype)
    fields[:-1, :-1] = basis
    return fields


def _slope(points: FloatArray, simplices: IntArray, moved: NDArray[np.bool_]) -> FloatArray:
    """(n, d) 1/m: gradient of the function that is one at ``moved`` corners and zero elsewhere."""
    return np.asarray(np.einsum("nk,nkd->nd", moved, barycentric_gradients(points[simplices])))
