"""What an engine of the heavy arithmetic is given, and what is asked of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from tomoskin.core import FloatArray, IntArray, ModelError
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


class Factor(Protocol):
    """A factorised symmetric matrix."""

    def columns(self, rows: IntArray) -> NDArray[Any]:
        """Columns X of the inverse, (n_unknowns, n_rows)."""

    def checked_columns(
        self, values: NDArray[Any], rows: IntArray
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """The same, and what they leave over of the matrix A that has these values.

        With E the columns of the identity, Xᵀ (E − A X) and the largest entry of E − A X; NaN
        where X is no number.
        """


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


class Patches(Protocol):
    """Changes of a base state by touches."""

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """Store columns (n_nodes, n) of the base system's inverse, those of ``nodes`` (n,)."""

    def forget(self) -> None:
        """Drop all columns that were stored."""

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


class Engine(Protocol):
    """The arithmetic that both engines do.

    Attributes
    ----------
    name
        ``native`` or ``scipy``.
    reason
        Why this one runs, in words.
    core
        The module tomoskin_core, where this is the native one.
    vectors
        Which vector instructions factorise and solve, where that is known.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def reason(self) -> str: ...  # noqa: D102

    @property
    def core(self) -> Any | None: ...  # noqa: D102

    @property
    def vectors(self) -> str: ...  # noqa: D102

    def analyse(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> Factorise:
        """Return what factorises symmetric matrices of this structure, given their values."""

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """Write ``operator`` times ``vectors`` (n, k) to ``out`` (k, n_rows)."""

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """(n_meas, n_cells) from scaled gradients (n_electrodes, components, n_cells)."""

    def patches(self, base: BaseState) -> Patches:
        """What computes the changes of a state by a touch."""


def singular() -> ModelError:
    """Return the error for a system that no factorisation solves."""
    return ModelError(
        "the system is singular to working precision",
        hint="conductivities or contact impedances span too many orders of magnitude",
    )
