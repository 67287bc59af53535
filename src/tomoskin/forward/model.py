"""The forward model: prepared once per mesh and pattern."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, ModelError
from tomoskin.forward.assembly import Assembly, gradient_operator
from tomoskin.forward.solution import Solution
from tomoskin.forward.state import State
from tomoskin.mesh import Mesh
from tomoskin.pattern import Pattern


class ForwardModel:
    """Complete electrode model (Somersalo, Cheney & Isaacson 1992) with linear elements.

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

    Raises
    ------
    ModelError
        When mesh and pattern have different electrodes, or z or the current is impossible.
    """

    def __init__(
        self,
        mesh: Mesh,
        pattern: Pattern,
        contact_impedance: ArrayLike,
        current: ArrayLike = 1.0,
    ) -> None:
        if len(mesh.electrodes) != pattern.n_electrodes:
            raise ModelError(
                f"the mesh has {len(mesh.electrodes)} electrodes and "
                f"the pattern {pattern.n_electrodes}"
            )
        self.mesh = mesh
        self.pattern = pattern
        self.contact_impedance = _impedance(contact_impedance, pattern.n_electrodes)
        self.current = _current(current, pattern.n_drive)
        self.assembly = Assembly.of(mesh)

    @cached_property
    def gradient(self) -> csr_array:
        """Nodal potentials → √volume-scaled gradients, (d·n_cells, n_points), axis-major."""
        return gradient_operator(self.mesh)

    def at(self, conductivity: ArrayLike) -> State:
        """Return the model at a conductivity, (n_cells,) S or S/m, or one number for all cells.

        Ask the state for ``solution``, ``jacobian`` and ``transfer_resistance``: the
        factorisation is shared between them.
        """
        return State(self, _conductivity(conductivity, len(self.mesh.cells)))

    def solve(self, conductivity: ArrayLike) -> Solution:
        """Voltages and potentials; see :meth:`at`."""
        return self.at(conductivity).solution

    def jacobian(self, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_meas, n_cells) dV/dσ, V/S; see :meth:`at`."""
        return self.at(conductivity).jacobian

    def transfer_resistance(self, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω; see :class:`State`."""
        return self.at(conductivity).transfer_resistance


def _conductivity(value: ArrayLike, n_cells: int) -> NDArray[Any]:
    raw = np.asarray(value)
    if raw.shape not in ((), (n_cells,)):
        raise ModelError(f"expected conductivity of shape ({n_cells},), got {raw.shape}")
    sigma = np.broadcast_to(raw, (n_cells,)).astype(_dtype(raw))
    good = np.isfinite(sigma) & (sigma.real > 0)
    if not good.all():
        cell = int(np.argmin(good))
        raise ModelError(
            f"expected a positive finite conductivity, got {sigma[cell]}", where=f"cell {cell}"
        )
    return sigma


def _impedance(value: ArrayLike, n: int) -> NDArray[Any]:
    raw = np.asarray(value)
    if raw.shape not in ((), (n,)):
        raise ModelError(f"expected one contact impedance or {n}, got shape {raw.shape}")
    z = np.broadcast_to(raw, (n,)).astype(_dtype(raw))
    good = np.isfinite(z) & (z.real > 0)
    if not good.all():
        electrode = int(np.argmin(good))
        raise ModelError(
            f"expected a positive contact impedance, got {z[electrode]}",
            where=f"electrode {electrode}",
        )
    return z


def _current(value: ArrayLike, n_drive: int) -> FloatArray:
    raw = np.asarray(value, dtype=np.float64)
    if raw.shape not in ((), (n_drive,)):
        raise ModelError(f"expected one current or {n_drive}, got shape {raw.shape}")
    if not (np.isfinite(raw).all() and (raw != 0).all()):
        raise ModelError(f"expected currents other than zero, got {raw.tolist()}")
    return np.array(np.broadcast_to(raw, (n_drive,)))


def _dtype(raw: NDArray[Any]) -> type[np.floating[Any] | np.complexfloating[Any, Any]]:
    return np.complex128 if np.iscomplexobj(raw) else np.float64
