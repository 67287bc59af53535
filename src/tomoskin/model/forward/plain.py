"""The engine of scipy and numpy: runs everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU, splu

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward.engine import (
    BaseState,
    Compressed,
    Factor,
    Factorise,
    Patches,
    singular,
)
from tomoskin.model.forward.small_patches import stack_change, stacks, summed
from tomoskin.model.forward.touches import Touches
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
        """See :class:`Engine`."""
        out[...] = (operator @ vectors).T

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """See :class:`Engine`."""
        out = np.empty((pattern.n_meas, gradient.shape[-1]), dtype=gradient.dtype)
        for drive, (source, sink) in enumerate(pattern.drives):
            rows = np.flatnonzero(pattern.drive_index == drive)
            driven = current[drive] * (gradient[sink] - gradient[source])
            plus, minus = pattern.measure[rows].T
            projected = np.einsum("edc,dc->ec", gradient, driven)
            out[rows] = projected[plus] - projected[minus]
        return out

    def patches(self, base: BaseState) -> Patches:
        """See :class:`Engine`."""
        return PlainPatches(base)


@dataclass(frozen=True, eq=False)
class PlainFactor:
    """A matrix's structure, and what SuperLU made of its values."""

    matrix: Compressed
    factor: SuperLU

    def columns(self, rows: IntArray) -> NDArray[Any]:
        """See the protocol."""
        return np.asarray(self.factor.solve(self._units(rows)))

    def checked_columns(
        self, values: NDArray[Any], rows: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """See the protocol."""
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
        self._valence = np.bincount(base.cells.ravel(), minlength=n) + base.cells.size * base.held
        self._slot = np.full(n, -1)
        self._columns: NDArray[Any] = np.empty((0, n), base.fields.dtype)

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """See the protocol."""
        self._slot[nodes] = len(self._columns) + np.arange(len(nodes))
        self._columns = np.vstack([self._columns, columns.T])

    def forget(self) -> None:
        """See the protocol."""
        self._slot[:] = -1
        self._columns = self._columns[:0]

    def change(
        self, starts: IntArray, cells: IntArray, conductivity: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], IntArray]:
        """See the protocol."""
        touches, base = Touches(starts, cells, conductivity), self._base
        if touches.fault(len(base.cells)) is not None:
            raise ValueError("a cell or conductivity is out of range")
        shape = (len(touches), *base.grounded.shape)
        kind = np.result_type(base.fields, conductivity)
        grounded, lost = np.empty(shape, kind), np.zeros(shape, kind)
        grounded[:] = base.grounded
        missing: list[IntArray] = []
        alone = np.ones(len(touches), dtype=bool)
        for stack in stacks(base.cells, touches) if len(touches) > 1 else ():
            alone[stack.numbers] = False
            slots = self._slot[stack.nodes]
            missing.append(stack.nodes[slots < 0])
            if not len(missing[-1]):
                between = self._columns[slots[:, :, None], stack.nodes[:, None]]
                less, lost[stack.numbers] = stack_change(base, between, stack, touches)
                grounded[stack.numbers] -= less
        for number in np.flatnonzero(alone).tolist():
            index, sigma = touches[number]
            rim, change = self._condensed(index, sigma)
            missing.append(rim[self._slot[rim] < 0])
            if len(rim) > 1 and not len(missing[-1]):
                less, lost[number] = self._woodbury(rim, change)
                grounded[number] -= less
        return grounded, lost, np.unique(np.concatenate([starts[:0], *missing]))

    def _condensed(self, index: IntArray, sigma: NDArray[Any]) -> tuple[IntArray, NDArray[Any]]:
        """Nodes of the patch's rim (m,), and the change of the system seen from there (m, m)."""
        base = self._base
        nodes, position, touched = np.unique(
            base.cells[index], return_inverse=True, return_counts=True
        )
        inside = touched == self._valence[nodes]
        position = position.reshape(-1, base.cells.shape[1])
        before, after = (
            _condensed(_block(base.local[index], position, unit, len(nodes)), inside)
            for unit in (base.conductivity[index], sigma)
        )
        return nodes[~inside], after - before

    def _woodbury(self, rim: IntArray, change: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Uᵀ (I + A C)⁻¹ A U, and what rounding may cost it."""
        between = self._columns[self._slot[rim][:, None], rim]
        between = between[1:] - between[:1]
        between = between[:, 1:] - between[:, :1]
        fields = self._base.fields[rim[1:]] - self._base.fields[rim[:1]]
        leak, change = change[1:].sum(axis=1, keepdims=True), change[1:, 1:]
        system = change @ between
        system[np.diag_indices_from(system)] += 1.0
        current = np.linalg.solve(system, change @ fields)
        changed = fields - between @ current
        residual = change @ changed - current + leak * changed
        return fields.T @ current, changed.T @ residual


def _block(
    local: FloatArray, position: IntArray, conductivity: NDArray[Any], n: int
) -> NDArray[Any]:
    """(n, n): the sum of the cells' matrices."""
    keys = position[:, :, None] * n + position[:, None, :]
    return summed(local * conductivity[:, None, None], keys, (n, n))


def _condensed(block: NDArray[Any], inside: NDArray[np.bool_]) -> NDArray[Any]:
    """``block`` without the nodes inside, which no current enters (Schur complement)."""
    outer, across, inner = (
        block[~inside][:, ~inside],
        block[inside][:, ~inside],
        block[inside][:, inside],
    )
    return np.asarray(outer - across.T @ np.linalg.solve(inner, across))
