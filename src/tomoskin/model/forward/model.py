"""The forward model, and its states: one conductivity each, factorised once, asked many things."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import derivatives
from tomoskin.model.forward.arguments import checked_conductivity
from tomoskin.model.forward.engine import singular
from tomoskin.model.forward.solution import Solution, System
from tomoskin.model.forward.update import LocalUpdate


class ForwardModel(System):
    """Complete electrode model (Somersalo, Cheney & Isaacson 1992) by finite elements.

    Parameters
    ----------
    mesh
        The domain, with one facet array per electrode.
    pattern
        Drives and measurements on those electrodes.
    contact_impedance
        Scalar or (n_electrodes,): Ω·m on a sheet, Ω·m² on a volume; may be complex.
    current
        Scalar or (n_drive,) A.
    order
        Order of the elements: 1, linear; 2, quadratic.

    Raises
    ------
    ModelError
        When mesh and pattern have different electrodes, or z or the current is impossible.
    """

    def at(self, conductivity: ArrayLike) -> State:
        """Return the model at a conductivity, S or S/m.

        One number for all cells, (n_cells,), or a symmetric tensor per cell (n_cells, d, d) in
        the mesh's coordinates. Ask the state for ``voltages``, ``jacobian`` and more: the
        factorisation is shared between them.
        """
        return State(self, checked_conductivity(conductivity, self.mesh))

    def solve(self, conductivity: ArrayLike) -> State:
        """The same, with voltages and potentials at once; see :meth:`at`."""
        state = self.at(conductivity)
        _ = state.voltages  # which raises where there are none
        return state

    def solve_many(self, conductivities: ArrayLike) -> NDArray[Any]:
        """(…, n_meas) V of many conductivities (…, n_cells), one per cell each; see :meth:`at`."""
        return self._each(conductivities, lambda state: state.voltages)

    def jacobian(self, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_meas, n_cells) dV/dσ, V/S; see :meth:`at`."""
        return self.at(conductivity).jacobian

    def jvp(self, conductivity: ArrayLike, change: ArrayLike) -> NDArray[Any]:
        """(…, n_meas) V: how the voltages change along ``change``; see :meth:`State.jvp`.

        Each of many conductivities (…, n_cells) has changes of the same shape of its own.
        """
        return self._each(conductivity, State.jvp, change)

    def vjp(self, conductivity: ArrayLike, weights: ArrayLike) -> NDArray[Any]:
        """(…, n_cells): the gradient of weighted voltages; see :meth:`State.vjp`.

        Each of many conductivities (…, n_cells) has weights (…, n_meas) of its own.
        """
        return self._each(conductivity, State.vjp, weights)

    def _each(
        self, given: ArrayLike, product: Callable[..., NDArray[Any]], *others: ArrayLike
    ) -> NDArray[Any]:
        """Products of one state, or of one after the other for many conductivities."""
        many = np.asarray(given)
        if many.ndim < 2 or many.shape[-1] != len(self.mesh.cells):
            return product(self.at(many), *others)
        rows = [np.asarray(one) for one in others]
        for row in rows:
            if row.shape[:-1] != many.shape[:-1]:
                raise ModelError(
                    f"expected one vector for each of {many.shape[:-1]} conductivities, got shape "
                    f"{row.shape}"
                )
        flat = [one.reshape(-1, one.shape[-1]) for one in (many, *rows)]
        products = [product(self.at(sigma), *own) for sigma, *own in zip(*flat, strict=True)]
        return np.array(products).reshape(*many.shape[:-1], -1)

    def transfer_resistance(self, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω; see :class:`State`."""
        return self.at(conductivity).transfer_resistance


@dataclass(frozen=True, eq=False)
class State(Solution):
    """A forward model at a conductivity, (n_cells,) or a tensor per cell (n_cells, d, d)."""

    model: ForwardModel

    @cached_property
    def jacobian(self) -> NDArray[Any]:
        """(n_meas, n_cells) V/S; for a tensor (n_meas, n_cells, d, d), by each component.

        −I ∫ ∇u_drive · ∇u_measure over each cell (Polydorides & Lionheart 2002): the fields of
        1 A through the driven and the measured pair.
        """
        return derivatives.by_conductivity(self)

    def jvp(self, change: ArrayLike) -> NDArray[Any]:
        """(…, n_meas) V: the jacobian times changes of conductivity (…, n_cells), S or S/m.

        Without the jacobian, by the fields of the solution. Raises ModelError for tensors.
        """
        return derivatives.along(self, change)

    def vjp(self, weights: ArrayLike) -> NDArray[Any]:
        """(…, n_cells): weights (…, n_meas) of the measurements times the jacobian.

        It is the gradient of Σ weights · voltages. Nothing is conjugated: for a real misfit of
        complex voltages give the conjugate of the residual. Raises ModelError for tensors.
        """
        return derivatives.against(self, weights)

    @cached_property
    def contact_jacobian(self) -> NDArray[Any]:
        """(n_meas, n_electrodes): derivative by each contact impedance, V per Ω·m (or Ω·m²)."""
        return derivatives.by_contact_impedance(self)

    @cached_property
    def movement_jacobian(self) -> NDArray[Any]:
        """(n_meas, n_electrodes, n_coordinates) V/m: derivative by each electrode's position.

        The electrode's points move with it, also those that it shares with another electrode,
        and all others stay (Soleimani, Gómez-Laberge & Adler 2006); only for scalar
        conductivity and elements of order 1.
        """
        return derivatives.by_movement(self)

    @cached_property
    def local(self) -> LocalUpdate:
        """Exact voltages when few cells change, without a new factorisation."""
        return LocalUpdate(self)


class Terminals:
    """What a model's electrodes see of it: the resistance between them, and nothing else.

    The electrodes' unknowns are eliminated last: what the sheet leaves between them is the end of
    the factor, and no field is solved for. It is the transfer resistance of a :class:`State`, but
    for rounding; the fields, with which that checks itself, are not there. Instead each pivot of
    an electrode must keep more than a few of its digits.

    Natively in a third of the time of a state; else, or where a contact is complex, by a state.
    """

    def __init__(self, model: ForwardModel) -> None:
        self._model = model

    def transfer_resistance(self, conductivity: FloatArray) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω for (n_cells,) S or S/m, or a tensor per cell (…, d, d).

        The conductivity is not checked: it must be positive, and a tensor symmetric.

        Raises
        ------
        ModelError
            When the system is singular to working precision.
        """
        if self._model.engine.core is None or np.iscomplexobj(self._model.contacts):
            return np.asarray(State(self._model, conductivity).transfer_resistance)
        if conductivity.ndim == 1:
            network, components = self._scalar, conductivity[None, None]
        else:
            network, components = self._tensor, conductivity.transpose(1, 2, 0)
        try:
            resistance: FloatArray = network.resistance(np.ascontiguousarray(components))
        except ValueError as error:
            raise singular() from error
        return resistance

    @cached_property
    def _scalar(self) -> Any:
        return self._network(self._model.assembly.element.forms(), 1)

    @cached_property
    def _tensor(self) -> Any:
        element = self._model.assembly.element
        return self._network(element.tensor_forms(), element.gradients.shape[3])

    def _network(self, forms: FloatArray, axes: int) -> Any:
        """The native layout, for the ``forms`` (n_cells, k, k, components) of so many axes."""
        assembly = self._model.assembly
        i, j = np.triu_indices(forms.shape[1], 1)
        return self._model.engine.core.Terminals(
            assembly.indptr,
            assembly.indices,
            self._model.contacts,
            np.ascontiguousarray(assembly.position, np.int32),
            np.ascontiguousarray(forms[:, i, j].transpose(2, 1, 0)),
            axes,
            np.arange(assembly.n_points, assembly.n_unknowns, dtype=np.int32),
        )
