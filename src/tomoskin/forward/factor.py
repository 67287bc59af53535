"""Sparse factorisation of the system matrix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from tomoskin.core import ModelError

if TYPE_CHECKING:
    from tomoskin.forward.engine import Engine

MOST_RESIDUAL = 1e-6
"""A relative residual above this means that the matrix was singular to working precision."""


class Factor(Protocol):
    """A factorised symmetric matrix."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """Solution of shape (n_unknowns, n_rhs)."""
        ...


Factorise = Callable[[NDArray[Any]], Factor]
"""From the values of a matrix, whose structure is known, to its factor."""


@dataclass(frozen=True, eq=False)
class Compressed:
    """A symmetric matrix by columns: values on a fixed structure."""

    values: NDArray[Any]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    @cached_property
    def matrix(self) -> csc_array:
        """The same as scipy has it."""
        n = len(self.indptr) - 1
        return csc_array((self.values, self.indices, self.indptr), shape=(n, n))


def factorise(matrix: csc_array) -> Factor:
    """Factorise a symmetric matrix, real or complex, by scipy's SuperLU.

    Minimum degree on AᵀA+A keeps the symmetric structure's fill low; the diagonal is a safe
    pivot, as the real part is positive definite.

    Raises
    ------
    ModelError
        When the matrix is singular.
    """
    try:
        factor: Factor = splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise singular() from error
    return factor


def solve_checked(
    engine: Engine, matrix: Compressed, factor: Factor, rhs: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any], float]:
    """Solution X (n_unknowns, n_rhs), what the residual costs Xᵀ (B − A X), and its largest entry.

    Raises
    ------
    ModelError
        When the residual shows that the matrix is singular to working precision.
    """
    solution = factor.solve(rhs)
    lost, largest = engine.residual(matrix, rhs, solution)
    if not largest < MOST_RESIDUAL * rhs.real.max():
        raise singular()
    return solution, lost, largest


def singular() -> ModelError:
    """Return the error for a system that no factorisation solves."""
    return ModelError(
        "the system is singular to working precision",
        hint="conductivities or contact impedances span too many orders of magnitude",
    )
