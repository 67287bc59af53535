"""The heavy arithmetic by scipy and numpy, which runs everywhere, and what it is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.model.forward.arguments import Touches
from tomoskin.model.pattern import Pattern


@dataclass(frozen=True, eq=False)
class Compressed:
    """A symmetric matrix by columns: values on a fixed structure."""

    values: NDArray[Any]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    @cached_property
    def matrix(self) -> csc_array:
        """The matrix as scipy's sparse columns."""
        n = len(self.indptr) - 1
        return csc_array((self.values, self.indices, self.indptr), shape=(n, n))


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised symmetric matrix: its structure, and what SuperLU made of its values."""

    matrix: Compressed
    factor: SuperLU

    def columns(self, rows: IntArray) -> NDArray[Any]:
        """Columns X of the inverse, (n_unknowns, n_rows)."""
        return np.asarray(self.factor.solve(self._units(rows)))

    def checked_columns(
        self, values: NDArray[Any], rows: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """The same, and what they leave over of the matrix A that has these values.

        With E the columns of the identity, Xᵀ (E − A X) and the largest entry of E − A X; NaN
        where X is no number.
        """
        columns = self.columns(rows)
        matrix = Compressed(values, self.matrix.indices, self.matrix.indptr).matrix
        residual = self._units(rows) - matrix @ columns
        return columns, columns.T @ residual, float(np.abs(residual).max(initial=0.0))

    def _units(self, rows: IntArray) -> NDArray[Any]:
        """(n_unknowns, n_rows): columns of the identity."""
        units = np.zeros((len(self.matrix.indptr) - 1, len(rows)), self.matrix.values.dtype)
        units[rows, np.arange(len(rows))] = 1.0
        return units


Factorise = Callable[[NDArray[Any]], Factor]
"""From the values of a matrix, whose structure is known, to its factor."""


@dataclass(frozen=True, eq=False)
class BaseState:
    """A state that touches change.

    Attributes
    ----------
    cells
        (n_cells, k) nodes.
    local
        (n_cells, k, k) matrix of each cell for a conductivity of one.
    held
        (n_nodes,) whether a node belongs to an electrode.
    conductivity
        (n_cells,) S or S/m.
    fields
        (n_nodes, width) V/A of 1 A into each electrode but the last.
    grounded
        (width, width) Ω, their potentials at these electrodes.
    """

    cells: IntArray
    local: FloatArray
    held: NDArray[np.bool_]
    conductivity: NDArray[Any]
    fields: NDArray[Any]
    grounded: NDArray[Any]


@dataclass(frozen=True)
class Engine:
    """The heavy arithmetic, here by SuperLU, sparse products and einsum.

    Attributes
    ----------
    reason
        Why this one runs, in words.
    name
        ``native`` or ``scipy``.
    core
        The module tomoskin_core, where this is the native one.
    """

    reason: str
    name: str = "scipy"
    core: Any = None

    def analyse(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> Factorise:
        """What factorises symmetric matrices of this structure, given their values."""
        return lambda values: _factorise(Compressed(values, indices, indptr))

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """Write ``operator`` times ``vectors`` (n, k) to ``out`` (k, n_rows)."""
        out[...] = (operator @ vectors).T

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """(n_meas, n_cells) from scaled gradients (n_electrodes, components, n_cells)."""
        out = np.empty((pattern.n_meas, gradient.shape[-1]), dtype=gradient.dtype)
        for drive, (source, sink) in enumerate(pattern.drives):
            rows = np.flatnonzero(pattern.drive_index == drive)
            driven = current[drive] * (gradient[sink] - gradient[source])
            plus, minus = pattern.measure[rows].T
            projected = np.einsum("edc,dc->ec", gradient, driven)
            out[rows] = projected[plus] - projected[minus]
        return out

    def patches(self, base: BaseState) -> Patches:
        """What computes the changes of a state by a touch."""
        return Patches(base)


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
    return Factor(matrix, factor)


class Patches:
    """Changes of a base state by touches."""

    def __init__(self, base: BaseState) -> None:
        n = len(base.held)
        self._base = base
        self._slot = np.full(n, -1)
        self._columns: NDArray[Any] = np.empty((0, n), base.fields.dtype)

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """Store columns (n_nodes, n) of the base system's inverse, those of ``nodes`` (n,)."""
        self._slot[nodes] = len(self._columns) + np.arange(len(nodes))
        self._columns = np.vstack([self._columns, columns.T])

    def forget(self) -> None:
        """Drop all columns that were stored."""
        self._slot[:] = -1
        self._columns = self._columns[:0]

    def change(
        self, starts: IntArray, cells: IntArray, conductivity: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], IntArray]:
        """Results of touches, of which number t has ``cells[starts[t]:starts[t + 1]]``.

        Returns
        -------
        grounded
            (n_touches, width, width) Ω.
        lost
            (n_touches, width, width) Ω, how far rounding may have shifted them.
        missing
            Nodes whose columns must be stored first; unless empty, nothing else counts.

        Raises
        ------
        ValueError
            For a cell that does not exist or stands twice in a touch, a conductivity that is not
            positive, or a singular system.
        """
        touches, base = Touches(starts, cells, conductivity), self._base
        touches.check(len(base.cells))
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


def singular() -> ModelError:
    """Return the error for a system that no factorisation solves."""
    return ModelError(
        "the system is singular to working precision",
        hint="conductivities or contact impedances span too many orders of magnitude",
    )
