"""Sparse Cholesky factors and Jacobian rows for tomoskin."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__version__: str

@final
class Symbolic:
    """What the structure of a symmetric matrix fixes for each of its factors."""

    def __new__(cls, n: int, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> Symbolic:
        """Analyse the compressed-column structure of a symmetric matrix given in full.

        Raises
        ------
        ValueError
            When the arrays are no such structure, with ascending rows and a diagonal.
        """

    @property
    def factor_len(self) -> int:
        """Number of values in a factor."""

    def factor(self, values: NDArray[Any]) -> Factor:
        """Factorise the matrix with these values, float64 or complex128, in the structure's order.

        A complex matrix is symmetric, not Hermitian. One of each pair of equal values is read.

        Raises
        ------
        ValueError
            When the real part of the matrix is not positive definite.
        """

@final
class Factor:
    """A factorised matrix."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """Solution (n, k), C-contiguous, for ``rhs`` (n, k) of the matrix's type, any layout."""

def transposed_product(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    data: NDArray[np.float64],
    vectors: NDArray[Any],
    out: NDArray[Any],
    threads: int | None = None,
) -> None:
    """Write (A V)ᵀ to ``out`` (k, n_rows), for A by compressed rows and V (n_columns, k).

    ``threads``: at most that many; else RAYON_NUM_THREADS, else one per core.
    """

def jacobian(
    gradient: NDArray[Any],
    drives: NDArray[np.int64],
    current: NDArray[np.float64],
    drive_index: NDArray[np.int64],
    measure: NDArray[np.int64],
    threads: int | None = None,
) -> NDArray[Any]:
    """(n_meas, n_cells): −I ∇u_drive · ∇u_measure, summed over components, cell by cell.

    ``gradient`` (n_electrodes, components, n_cells): fields of 1 A into each electrode. ``drives``
    (n_drive, 2) source and sink, ``current`` (n_drive,), ``drive_index`` (n_meas,), ``measure``
    (n_meas, 2) plus and minus. ``threads``: as in :func:`transposed_product`.
    """
