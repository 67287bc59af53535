"""What is prepared once for a mesh, a pattern and contacts: all but the conductivity."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, IntArray, ModelError, numeric
from tomoskin.model.forward.arguments import number_type
from tomoskin.model.forward.assembly import Element, SystemAssembly, gradient_operator
from tomoskin.model.forward.engine import Factorise
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
        return self.assembly.contacts(self.contact_impedance)

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
