"""Sparse factorisation of the system matrix."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from tomoskin.core import ModelError

MOST_RESIDUAL = 1e-6
"""A relative residual above this means that the matrix was singular to working precision."""


class Factor(Protocol):
    """A factorised symmetric matrix."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """Solution of shape (n_unknowns, n_rhs)."""
        ...


Factorise = Callable[[csc_array], Factor]


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
    matrix: csc_array, factor: Factor, rhs: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Solution and residual, each (n_unknowns, n_rhs).

    Raises
    ------
    ModelError
        When the residual shows that the matrix is singular to working precision.
    """
    solution = factor.solve(rhs)
    residual = rhs - matrix @ solution
    if not np.abs(residual).max() < MOST_RESIDUAL * np.abs(rhs).max():
        raise singular()
    return solution, residual


def singular() -> ModelError:
    """Return the error for a system that no factorisation solves."""
    return ModelError(
        "the system is singular to working precision",
        hint="conductivities or contact impedances span too many orders of magnitude",
    )
