"""Sparse Cholesky factors and Jacobian rows for tomoskin."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__version__: str

vector_code: str
"""The widest vector instructions that the processor has: AVX-512, AVX2, NEON or none."""

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

    def columns(self, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Columns (n, k) of the inverse, those of ``rows`` (k,), C-contiguous."""

    def checked_columns(
        self, values: NDArray[Any], rows: NDArray[np.int64]
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """Columns X of the inverse, and what they leave over of the matrix A with ``values``.

        With E the columns of the identity: X (n, k), Xᵀ (E − A X), and the largest entry of
        E − A X in size; NaN where that is no number.
        """

@final
class Reference:
    """faer's own Cholesky of a real matrix, for benchmarks: minimum degree, one thread.

    Only where the engine was built with the feature ``reference``.
    """

    def __new__(
        cls, n: int, indptr: NDArray[np.int32], indices: NDArray[np.int32], n_rhs: int
    ) -> Reference:
        """Analyse a structure as :class:`Symbolic` does, for ``n_rhs`` right-hand sides."""

    @property
    def factor_len(self) -> int:
        """Number of values in faer's factor."""

    def solve(self, values: NDArray[np.float64], rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Factorise the matrix with these values, and solve for ``rhs`` (n_rhs, n).

        Raises
        ------
        ValueError
            When the matrix is not positive definite.
        """

@final
class Patches:
    """Changes of a state by touches, exact, from the inverse between the nodes of each rim."""

    def __new__(
        cls,
        cells: NDArray[np.int64],
        local: NDArray[np.float64],
        held: NDArray[np.bool_],
        conductivity: NDArray[Any],
        fields: NDArray[Any],
        grounded: NDArray[Any],
    ) -> Patches:
        """Lay out cells (n, k) with matrices (n, k, k) for a conductivity of one.

        ``held`` (n_nodes,): nodes on electrodes. ``conductivity`` (n,), ``fields`` (n_nodes, w)
        and ``grounded`` (w, w) are those of the state, all float64 or all complex128.
        """

    def keep(self, nodes: NDArray[np.int64], columns: NDArray[Any]) -> None:
        """Store columns (n_nodes, m) of the inverse, those of ``nodes`` (m,)."""

    def forget(self) -> None:
        """Drop all columns."""

    def change(
        self,
        starts: NDArray[np.int64],
        cells: NDArray[np.int64],
        conductivity: NDArray[Any],
        threads: int | None = None,
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.int64]]:
        """Transfer resistances (t, w, w), what rounding may cost them, nodes to be kept first.

        Touch t changes ``cells[starts[t]:starts[t + 1]]``. ``threads``: as in
        :func:`transposed_product`.

        Raises
        ------
        ValueError
            When a cell does not exist or stands twice in a touch, a conductivity is not positive,
            or the system is singular.
        """

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

@final
class SpotTable:
    """What one spot of four columns (x, y, logarithm of the radius, content) does: see
    tomoskin.touch.fit.table, which makes it."""

    def __new__(
        cls,
        log_radii: NDArray[np.float64],
        grids: NDArray[np.float64],
        nodes: NDArray[np.float64],
        values: NDArray[np.float64],
        filling: float,
        sheet: NDArray[np.float64],
        prior: NDArray[np.float64],
        log_range: NDArray[np.float64],
    ) -> SpotTable:
        """Take what the table is made of.

        ``grids`` (n, 5): origin, step and shape for each radius; ``values`` (n_points, n, rank);
        ``sheet`` (n_cells, 3): centroids and margins; ``prior`` (2, 4): middle and weight.

        Raises
        ------
        ValueError
            When these do not fit together.
        """

    def expanded(self, spots: NDArray[np.float64]) -> NDArray[np.float64]:
        """Change, derivatives and directions (k, 7, rank) of spots (k, 4)."""

    def settled(
        self,
        seen: SeenTable,
        data: NDArray[np.float64],
        left: NDArray[np.float64],
        offset: NDArray[np.float64],
        spots: NDArray[np.float64],
        deviations: tuple[float, float, float, float],
        depths: tuple[float, float],
        most: int,
    ) -> tuple[
        tuple[NDArray[np.float64], ...],
        tuple[NDArray[np.float64], ...],
        tuple[float, float, float, bool],
    ]:
        """Fit spots to whitened ``data`` (r,) by at most so many steps.

        Returns
        -------
        spots, each, slopes, unknown, normal
            (k, 4), (k, r), (4k, r), (q, r) and (4k, 4k).
        predicted, residual, gradient
            (r,), (r,) and (4k,).
        misfit, log_size, cost, settled
            See tomoskin.touch.fit.refine.Fit.
        """

@final
class SeenTable:
    """A table as whitened data see it."""

    def __new__(cls, direct: NDArray[np.float64], timed: NDArray[np.float64]) -> SeenTable:
        """Of matrices (r, rank)."""

def projected(
    unknown: NDArray[np.float64],
    free: NDArray[np.float64],
    columns: NDArray[np.float64],
    ridge: float,
) -> NDArray[np.float64]:
    """Rows (m, r), less what unknown directions (q, r) and free ones (p, r) take up."""
