"""The engine of scipy and numpy: runs everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU, splu

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward.arguments import Touches
from tomoskin.model.forward.engine import (
    BaseState,
    Compressed,
    Factor,
    Factorise,
    Patches,
    singular,
)
from tomoskin.model.pattern import Pattern


@dataclass(frozen=True)
class Scipy:
    """SuperLU, sparse products and einsum."""

    reason: str
    name: str = "scipy"
    core: None = None
    vectors: str = "those of scipy's build"

    def analyse(
        self,
        indptr: NDArray[np.int32],
        indices: NDArray[np.int32],
    ) -> Factorise:
        """See :class:`Engine`; SuperLU keeps no analysis."""
        return lambda values: _factorise(Compressed(values, indices, indptr))

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """Write the product of operator and vectors, transposed, into ``out``."""
        out[...] = (operator @ vectors).T

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """The Jacobian of the pattern, one drive after the other."""
        out = np.empty((pattern.n_meas, gradient.shape[-1]), dtype=gradient.dtype)
        for drive, (source, sink) in enumerate(pattern.drives):
            rows = np.flatnonzero(pattern.drive_index == drive)
            driven = current[drive] * (gradient[sink] - gradient[source])
            plus, minus = pattern.measure[rows].T
            projected = np.einsum("edc,dc->ec", gradient, driven)
            out[rows] = projected[plus] - projected[minus]
        return out

    def patches(self, base: BaseState) -> Patches:
        """The plain changes about one state of the sheet."""
        return PlainPatches(base)


@dataclass(frozen=True, eq=False)
class PlainFactor:
    """A matrix's structure, and what SuperLU made of its values."""

    matrix: Compressed
    factor: SuperLU

    def columns(self, rows: IntArray) -> NDArray[Any]:
        """The columns of the inverse that belong to these rows."""
        return np.asarray(self.factor.solve(self._units(rows)))

    def checked_columns(
        self, values: NDArray[Any], rows: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """The columns, their correction to first order, and the largest residual."""
        columns = self.columns(rows)
        matrix = Compressed(values, self.matrix.indices, self.matrix.indptr).matrix
        residual = self._units(rows) - matrix @ columns
        return columns, columns.T @ residual, float(np.abs(residual).max(initial=0.0))

    def _units(self, rows: IntArray) -> NDArray[Any]:
        """(n_unknowns, n_rows): columns of the identity."""
        units = np.zeros((len(self.matrix.indptr) - 1, len(rows)), self.matrix.values.dtype)
        units[rows, np.arange(len(rows))] = 1.0
        return units


def _factorise(matrix: Compressed) -> Factor:
    """Factorise a symmetric matrix, real or complex, by scipy's SuperLU.

    Minimum degree on AᵀA+A keeps the symmetric structure's fill low; the diagonal is a safe
    pivot, as the real part is positive definite.

    Raises
    ------
    ModelError
        When the matrix is singular.
    """
    try:
        factor = splu(
            matrix.matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise singular() from error
    return PlainFactor(matrix, factor)


class PlainPatches:
    """See :class:`~tomoskin.model.forward.engine.Patches`."""

    def __init__(self, base: BaseState) -> None:
        """Prepare for touches of ``base``."""
        n = len(base.held)
        self._base = base
        self._slot = np.full(n, -1)
        self._columns: NDArray[Any] = np.empty((0, n), base.fields.dtype)

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """Store the columns of the inverse that belong to these nodes."""
        self._slot[nodes] = len(self._columns) + np.arange(len(nodes))
        self._columns = np.vstack([self._columns, columns.T])

    def forget(self) -> None:
        """Drop all columns that were stored."""
        self._slot[:] = -1
        self._columns = self._columns[:0]

    def change(
        self, starts: IntArray, cells: IntArray, conductivity: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], IntArray]:
        """The changes that touches make, and the nodes whose columns are missing."""
        touches, base = Touches(starts, cells, conductivity), self._base
        if touches.fault(len(base.cells)) is not None:
            raise ValueError("a cell or conductivity is out of range")
        shape = (len(touches), *base.grounded.shape)
        kind = np.result_type(base.fields, conductivity)
        grounded, lost = np.empty(shape, kind), np.zeros(shape, kind)
        grounded[:] = base.grounded
        missing = [starts[:0]]
        for number in range(len(touches)):
            nodes, place = np.unique(base.cells[touches[number][0]], return_inverse=True)
            slots = self._slot[nodes]
            missing.append(nodes[slots < 0])
            if len(nodes) and not len(missing[-1]):
                between = self._columns[slots[:, None], nodes]
                less, lost[number] = patch_change(base, between, nodes, place, touches[number])
                grounded[number] -= less
        return grounded, lost, np.unique(np.concatenate(missing))


def patch_change(
    base: BaseState,
    between: NDArray[Any],
    nodes: IntArray,
    place: IntArray,
    touch: tuple[IntArray, NDArray[Any]],
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(e, e) Uᵀ (I + A C)⁻¹ A U of one touch, and what rounding may cost it.

    ``between`` (n, n): the inverse of the base system, between the ``nodes`` of the patch;
    ``place``: which of them each corner of its cells is.
    """
    (index, sigma), place = touch, place.reshape(-1, base.cells.shape[1])
    moved = base.local[index] * (sigma - base.conductivity[index])[:, None, None]
    change = np.zeros(between.shape, moved.dtype)
    np.add.at(change, (place[:, :, None], place[:, None, :]), moved)
    between = between[1:] - between[:1]
    between = between[:, 1:] - between[:, :1]
    fields = base.fields[nodes[1:]] - base.fields[nodes[:1]]
    leak, change = change[1:].sum(axis=1, keepdims=True), change[1:, 1:]
    system = change @ between
    system[np.diag_indices_from(system)] += 1.0
    current = np.linalg.solve(system, change @ fields)
    changed = fields - between @ current
    residual = change @ changed - current + leak * changed
    return fields.T @ current, changed.T @ residual
