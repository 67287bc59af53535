"""What is prepared once for a mesh, a pattern and contacts, all but the conductivity; and what a
solve gives: the fields of one conductivity, and all that is a product of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, IntArray, ModelError, numeric
from tomoskin.model.forward.arguments import number_type
from tomoskin.model.forward.assembly import Element, SystemAssembly, gradient_operator
from tomoskin.model.forward.engine import Compressed, Factor, Factorise, singular
from tomoskin.model.forward.engine_choice import choose_engine
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern, signed


class System:
    """The equations of the complete electrode model; parameters as of :class:`ForwardModel`."""

    def __init__(
        self,
        mesh: Mesh,
        pattern: Pattern,
        contact_impedance: ArrayLike,
        current: ArrayLike = 1.0,
        *,
        order: int = 1,
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
        self.most_current = float(np.abs(self.drive_currents).sum(axis=1).max() / 2.0)
        self.order = order
        self.engine = choose_engine()
        self.assembly = SystemAssembly.of(Element.of(mesh, order))

    @cached_property
    def gradient(self) -> csr_array:
        """Nodal potentials → scaled gradients, (d·q·n_cells, n_nodes); see Element."""
        return gradient_operator(self.assembly.element)

    @cached_property
    def factorise(self) -> Factorise:
        """Factorises system matrices; their structure is analysed once."""
        return self.engine.analyse(self.assembly.indptr, self.assembly.indices)

    @cached_property
    def contacts(self) -> NDArray[Any]:
        """What the contacts add to the values of the system matrix."""
        return np.asarray(self.assembly.contact @ (1.0 / self.contact_impedance))

    @cached_property
    def by_drive(self) -> tuple[IntArray, IntArray]:
        """Measurements in the order of their drives, and where in it each drive begins."""
        index = self.pattern.drive_index
        order = np.argsort(index, kind="stable")
        return order, np.flatnonzero(np.diff(index[order], prepend=-1))

    def voltages(self, transfer_resistance: NDArray[Any]) -> NDArray[Any]:
        """(…, n_meas) V of the pattern, from (…, n_electrodes, n_electrodes) Ω."""
        if self.pattern.spread:
            potentials = transfer_resistance @ self.drive_currents.T
            drive, (plus, minus) = self.pattern.drive_index, self.pattern.measure.T
            return np.asarray(potentials[..., plus, drive] - potentials[..., minus, drive])
        entries, current = self._entries
        *many, n, _ = transfer_resistance.shape
        r = transfer_resistance.reshape(*many, n * n).take(entries, axis=-1)
        driven_plus = r[..., 0, :] - r[..., 1, :]
        driven_minus = r[..., 2, :] - r[..., 3, :]
        return np.asarray(current * (driven_plus - driven_minus))

    @cached_property
    def drive_currents(self) -> FloatArray:
        """(n_drive, n_electrodes) A into every electrode."""
        return self.current[:, None] * self.pattern.currents

    @cached_property
    def readers(self) -> FloatArray:
        """(n_meas, n_electrodes) 1 at plus and −1 at minus of each measurement."""
        return signed(self.pattern.measure, self.pattern.n_electrodes)

    @cached_property
    def _entries(self) -> tuple[IntArray, FloatArray]:
        """(4, n_meas) entries of a flat transfer resistance, and each measurement's current."""
        (source, sink), (plus, minus) = self.pattern.drive.T, self.pattern.measure.T
        n = self.pattern.n_electrodes
        entries = [plus * n + source, plus * n + sink, minus * n + source, minus * n + sink]
        return np.stack(entries), self.current[self.pattern.drive_index]


def _impedance(value: ArrayLike, n: int) -> NDArray[Any]:
    raw = numeric(value, ModelError, " as contact impedance")
    if raw.shape not in ((), (n,)):
        raise ModelError(f"expected one contact impedance or {n}, got shape {raw.shape}")
    z = np.broadcast_to(raw, (n,)).astype(number_type(raw))
    good = np.isfinite(z) & (z.real > 0)
    if not good.all():
        electrode = int(np.argmin(good))
        raise ModelError(
            f"expected a positive contact impedance, got {z[electrode]}",
            where=f"E{electrode + 1}",
        )
    return z


def _current(value: ArrayLike, n_drive: int) -> FloatArray:
    raw = numeric(value, ModelError, " as current")
    if raw.shape not in ((), (n_drive,)):
        raise ModelError(f"expected one current or {n_drive}, got shape {raw.shape}")
    if raw.dtype.kind == "c":
        raise ModelError("expected real currents, got complex ones")
    if not (np.isfinite(raw).all() and (raw != 0).all()):
        raise ModelError(f"expected currents other than zero, got {raw.tolist()}")
    return np.array(np.broadcast_to(raw, (n_drive,)), dtype=np.float64)


MOST_RESIDUAL = 1e-6
"""A relative residual above this means that the matrix was singular to working precision."""

_FLOOR = 1e-12
"""Voltages that are zero by symmetry are right to this part of √(R_drive · R_measure)."""


def checked_voltages(
    model: System,
    grounded: NDArray[Any],
    lost: NDArray[Any],
    sharper: Callable[[], NDArray[Any]] | None = None,
) -> NDArray[Any]:
    """(…, n_meas) V, of which the residual leaves six digits of the largest of each drive.

    Parameters
    ----------
    grounded
        (…, k, k) Ω transfer resistance against the ground electrode.
    lost
        (…, k, k) Ω, fields of 1 A into each electrode times their residuals, Σ over nodes: how
        far ``grounded`` may be off.
    sharper
        A dearer estimate of the voltages' errors (n_meas,) V, asked for where that is too large.

    Raises
    ------
    ModelError
        When more than that is lost.
    """
    resistance = padded(grounded)
    voltages = model.voltages(resistance)
    order, starts = model.by_drive
    largest = np.maximum.reduceat(np.abs(voltages[..., order]), starts, axis=-1)
    least = MOST_RESIDUAL * largest.min(axis=-1)
    most = 4.0 * model.most_current * np.abs(lost).max(axis=(-2, -1), initial=0.0)
    if not (most <= least).all():
        for index in np.argwhere(~(most <= least)):
            at = tuple(index)
            _confirm(model, resistance[at], voltages[at], lost[at], sharper)
    return voltages


def _confirm(
    model: System,
    resistance: NDArray[Any],
    voltages: NDArray[Any],
    lost: NDArray[Any],
    sharper: Callable[[], NDArray[Any]] | None,
) -> None:
    """Refuse voltages (n_meas,) that the residual may have spoilt, one by one."""
    pattern = model.pattern
    largest = np.zeros(pattern.n_drive)
    np.maximum.at(largest, pattern.drive_index, np.abs(voltages))
    driven = _inner(model, resistance, pattern.currents)[pattern.drive_index]
    inner = driven * _inner(model, resistance, model.readers)
    floor = _FLOOR * np.abs(model.current[pattern.drive_index]) * np.sqrt(inner)
    allowed = np.maximum(MOST_RESIDUAL * largest[pattern.drive_index], floor)
    if (np.abs(model.voltages(padded(lost))) <= allowed).all():
        return
    if sharper is None or not (np.abs(sharper()) <= allowed).all():
        raise singular()


def _inner(model: System, resistance: NDArray[Any], currents: FloatArray) -> FloatArray:
    """(n,) Ω that ``currents`` (n, n_electrodes) meet, without what the contacts have at least."""
    sizes = np.array([size.sum() for size in model.assembly.element.facet_sizes])
    contact = np.abs(model.contact_impedance) / sizes
    between = np.abs(np.einsum("ke,ef,kf->k", currents, resistance, currents))
    return np.asarray(np.maximum(between - currents**2 @ contact, 0.0))


def error_of_drives(model: System, matrix: Any, basis: NDArray[Any]) -> NDArray[Any]:
    """(n_meas,) V that the residual of each drive's own field may cost.

    Sharper, and dearer, where all fields of the basis share the large potential of a bad ground
    electrode: that of a drive between others has none of it, and loses no digits to it.
    """
    pattern, n_points = model.pattern, model.assembly.n_points
    fields = np.zeros((len(basis), basis.shape[1] + 1), basis.dtype)
    fields[:, :-1] = basis
    error = np.empty(pattern.n_meas, basis.dtype)
    for drive, currents in enumerate(pattern.currents):
        residual = -(matrix @ (fields @ currents))
        residual[n_points:] += currents[:-1]
        rows = np.flatnonzero(pattern.drive_index == drive)
        plus, minus = pattern.measure[rows].T
        error[rows] = (fields[:, plus] - fields[:, minus]).T @ residual * model.current[drive]
    return error


@dataclass(frozen=True, eq=False)
class Solution:
    """Potentials and voltages for one conductivity; complex where σ or z is.

    Everything follows from one basis, and is computed when it is asked for, once.

    Attributes
    ----------
    model
        What is solved.
    conductivity
        (n_cells,), or a tensor per cell (n_cells, d, d), S or S/m.
    """

    model: System
    conductivity: NDArray[Any]

    @cached_property
    def factor(self) -> Factor:
        """The system matrix, factorised."""
        return self.model.factorise(self._matrix.values)

    @cached_property
    def _matrix(self) -> Compressed:
        return self.model.assembly.matrix(self.conductivity, self.model.contacts)

    @cached_property
    def _solved(self) -> tuple[NDArray[Any], NDArray[Any], float]:
        """Basis, voltages and residual; ModelError where rounding has spoilt them."""
        model, matrix, assembly = self.model, self._matrix, self.model.assembly
        electrodes = np.arange(assembly.n_points, assembly.n_unknowns)
        basis, lost, largest = self.factor.checked_columns(matrix.values, electrodes)
        if not largest < MOST_RESIDUAL:
            raise singular()
        voltages = checked_voltages(
            model,
            basis[assembly.n_points :],
            lost,
            sharper=lambda: error_of_drives(model, matrix.matrix, basis),
        )
        return basis, voltages, largest

    @property
    def basis(self) -> NDArray[Any]:
        """(n_unknowns, n_electrodes − 1) V/A: fields of 1 A into each electrode and out at the
        last, which is at zero."""
        return self._solved[0]

    @property
    def voltages(self) -> NDArray[Any]:
        """(n_meas,) V, in the pattern's order."""
        return self._solved[1]

    @property
    def residual(self) -> float:
        """Largest relative residual of the linear solves."""
        return self._solved[2]

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
        field = model.current[:, None, None] * np.tensordot(model.pattern.currents, gradient, 1)
        if self.conductivity.ndim == 1:
            return np.asarray(np.sum(np.abs(field) ** 2, axis=1) * self.conductivity.real)
        n_cells, d, _ = self.conductivity.shape
        field = field.reshape(len(field), d, -1, n_cells)
        flow = np.einsum("cab,kbqc->kaqc", self.conductivity, field)
        return np.asarray(np.einsum("kaqc,kaqc->kc", field.conj(), flow).real)

    def _of_drives(self, fields: NDArray[Any]) -> NDArray[Any]:
        """(n_drive, …): fields (n_electrodes, …) of 1 A → those of each drive's current."""
        model = self.model
        return np.asarray(model.current[:, None] * (model.pattern.currents @ fields))


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
