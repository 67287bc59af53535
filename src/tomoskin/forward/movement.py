"""Derivative of the voltages by the place of each electrode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.forward.derivatives import grounded
from tomoskin.forward.element import barycentric_gradients

if TYPE_CHECKING:
    from tomoskin.forward.state import State


def by_movement(state: State) -> NDArray[Any]:
    """See :attr:`State.movement_jacobian`.

    When the mesh moves with velocity v, linear in each cell, the integral of σ∇u·∇w changes by
    that of σ(div v ∇u·∇w − ∇uᵀ(∇v + ∇vᵀ)∇w). An electrode that moves as a whole keeps its form;
    one that shares points with it is stretched, and its form with it.
    """
    model, mesh = state.model, state.model.mesh
    if model.order != 1 or state.conductivity.ndim > 1:
        raise ModelError("movement needs elements of order 1 and a scalar conductivity")
    if mesh.metric is not None:
        raise ModelError("movement needs the sheet's true shape, not a metric")
    d = mesh.points.shape[1]
    out = np.empty((model.pattern.n_meas, len(mesh.electrodes), d), state.gradient.dtype)
    for number, facets in enumerate(mesh.electrodes):
        moved = np.zeros(len(mesh.points), dtype=bool)
        moved[facets] = True
        change = _in_cells(state, moved) + _in_contacts(state, moved)
        for axis in range(d):
            out[:, number, axis] = model.voltages(change[axis])
    return out


def _in_cells(state: State, moved: NDArray[np.bool_]) -> NDArray[Any]:
    """(d, n_electrodes, n_electrodes) Ω/m: change of R as the cells at ``moved`` points deform."""
    mesh = state.model.mesh
    corner = moved[mesh.cells]
    cells = np.flatnonzero(corner.any(axis=1))
    slope = _slope(mesh.points, mesh.cells[cells], corner[cells])
    sigma, field = state.conductivity[cells], state.gradient[:, :, cells]
    along = np.einsum("cd,edc->ec", slope, field)
    square = np.einsum("eac,fac,c->efc", field, field, sigma)
    cross = np.einsum("ec,fdc,c->def", along, field, sigma)
    return np.asarray(cross + cross.swapaxes(1, 2) - np.moveaxis(square @ slope, -1, 0))


def _in_contacts(state: State, moved: NDArray[np.bool_]) -> NDArray[Any]:
    """The same as electrodes are stretched of which only some points move."""
    model, mesh, basis = state.model, state.model.mesh, grounded(state)
    element = model.assembly.element
    n_el, d = len(mesh.electrodes), mesh.points.shape[1]
    change = np.zeros((d, n_el, n_el), basis.dtype)
    for number, facets in enumerate(mesh.electrodes):
        corner = moved[facets]
        part = corner.any(axis=1) & ~corner.all(axis=1)
        if part.any():
            slope = _slope(mesh.points, facets[part], corner[part])
            growth = slope * element.facet_sizes[number][part, None]
            drop = basis[facets[part]] - basis[element.n_nodes + number]
            square = np.einsum("kie,ij,kjf->kef", drop, element.facet_mass, drop)
            change -= np.einsum("kef,kd->def", square, growth) / model.contact_impedance[number]
    return change


def _slope(points: FloatArray, simplices: IntArray, moved: NDArray[np.bool_]) -> FloatArray:
    """(n, d) 1/m: gradient of the function that is one at ``moved`` corners and zero elsewhere."""
    return np.asarray(np.einsum("nk,nkd->nd", moved, barycentric_gradients(points[simplices])))
