"""Sparse Cholesky factors and Jacobian rows for tomoskin."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__version__: str

interface: int
"""Number of what this file says; raised with each change of it."""

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

    def scaled(
        self,
        starts: NDArray[np.int64],
        cells: NDArray[np.int64],
        height: NDArray[np.float64],
        depths: NDArray[np.float64],
        threads: int | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """What touches take away (t, k, w, w), each in k ``depths``, and nodes to be kept first.

        Touch t changes log σ of ``cells[starts[t]:starts[t + 1]]`` by ``height`` times the depth,
        of a real state; at most 7 depths.

        Raises
        ------
        ValueError
            As :meth:`change`.
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
class Terminals:
    """The transfer resistance between a network's last nodes, again and again."""

    def __new__(
        cls,
        indptr: NDArray[np.int32],
        indices: NDArray[np.int32],
        contacts: NDArray[np.float64],
        position: NDArray[np.int32],
        forms: NDArray[np.float64],
        axes: int,
        last: NDArray[np.int32],
    ) -> Terminals:
        """Lay out a system matrix whose rows ``last`` (t,) are eliminated last.

        ``contacts`` (n_values,): what it has beside the cells; ``position`` (n, k, k): which value
        each entry of a cell's matrix adds to; ``forms`` (components, pairs, n): what a cell
        conducts between each pair of its nodes, for each component of a tensor of so many ``axes``
        on and above its diagonal.
        """

    def resistance(self, conductivity: NDArray[np.float64]) -> NDArray[np.float64]:
        """(t + 1, t + 1) Ω between them and the ground, last, for (axes, axes, n) S.

        Rows and columns sum to zero.

        Raises
        ------
        ValueError
            When a pivot is not positive, or a terminal's has lost nine digits.
        """

def conducted(
    cells: Sequence[NDArray[np.float64]],
    memory: Sequence[NDArray[np.float64]],
    series: Sequence[Sequence[tuple[float, float]]],
    numbers: tuple[float, ...],
) -> NDArray[np.float64]:
    """Conductivity S of cells (1, n), or xx, xy, yx, yy (4, n) where directions differ, after a
    step under a load.

    ``cells``: the load (4, n), the one before, conductivity without load. ``memory``: lagging, late
    and broken parts, and wear (or nothing), which are written over. ``series``: parts and half
    widths of plays; parts of creep, and of breakdown, with what the step leaves of each.
    ``numbers``: thickness, gauge, the same across, compression, wear, heat, largest compression
    and logarithm.
    """

def converted(
    volts: NDArray[np.float64],
    moving: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    chance: NDArray[np.float64],
    numbers: tuple[float, ...],
) -> NDArray[np.uint16]:
    """Summed codes (m,) of potentials (m,) V, with standard normal numbers (k, m).

    ``moving``: what comes to them, (m,) V times (k, m).
    ``numbers``: gain, offset, low and high rail, codes per volt, number of codes, bow, noise.
    """

def dented(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    dents: Sequence[tuple[object, ...]],
) -> NDArray[np.float64]:
    """Strain xx, yy, xy, and depth (4, m) of dents together at points x, y (m,).

    A dent: its table (n·n, 4), its (n, step, reach), and (x, y, cosine, sine) of its probe.
    """

def lines(
    resistance: NDArray[np.float64],
    drives: NDArray[np.int64],
    contact: NDArray[np.float64],
    numbers: tuple[float, ...],
) -> NDArray[np.float64]:
    """What amplifiers see (n_drives, n) V of a sheet with ``resistance`` (n, n), nothing broken.

    ``contact`` (n,) Ω: what each contact has more. ``numbers``: current, resistance and compliance
    of its source, resistance of a switch, parts of the common mode and of a neighbour.
    """

@final
class SpotTable:
    """What one spot of four columns (x, y, logarithm of the radius, content) does: see
    tomoskin.sensing.fit.table, which makes it."""

    def __new__(
        cls,
        log_radii: NDArray[np.float64],
        grids: NDArray[np.float64],
        nodes: NDArray[np.float64],
        values: NDArray[np.float32],
        filling: float,
        sheet: NDArray[np.float64],
        prior: Any,
    ) -> SpotTable:
        """Take what the table is made of.

        ``grids`` (n, 5): origin, step and shape for each radius; ``values`` (n_points, n, rank);
        ``sheet`` (n_cells, 3): centroids and margins; ``prior``: what has the attributes of a
        tomoskin.sensing.fit.prior.SpotPrior.

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
        frame: Any,
        offset: NDArray[np.float64],
        spots: NDArray[np.float64],
        known: Sequence[int | None],
        most: int,
    ) -> dict[str, Any]:
        """Fit spots (k, 4) to a frame by at most so many steps; ``known``: which of the expected
        touches each is, or None.

        ``frame``: what has the attributes of a tomoskin.sensing.fit.problem.Problem; ``offset``
        (rank,): what the table lacks. The answer has the fields of a
        tomoskin.sensing.fit.spot_fit.Fit, by name.
        """

    def searched(
        self,
        seen: SeenTable,
        frame: Any,
        offset: NDArray[np.float64],
        spots: NDArray[np.float64],
        candidates: Any,
        limits: Any,
        policy: Any,
    ) -> tuple[dict[str, Any], bool, list[NDArray[np.float64]] | None, dict[str, Any] | None]:
        """Find the touches of a frame; the last one's were ``spots`` (k, 4).

        Parameters
        ----------
        frame, offset
            See :meth:`settled`.
        candidates, limits
            What have the attributes of Matched and Limits in tomoskin.sensing.fit.problem.
        policy
            What has the attributes of a tomoskin.sensing.fit.policy.DetectionPolicy.

        Returns
        -------
        fit
            Of the touches.
        bare
            Whether that is without the frame's offset.
        others
            Likelihood ratios (n,) and contents (n,) of the candidates beside it, or None.
        turned_down
            One spot more, that was not worth it, or None.
        """

@final
class SeenTable:
    """A table as whitened data see it."""

    def __new__(
        cls,
        direct: NDArray[np.float64],
        timed: NDArray[np.float64],
        matrix: NDArray[np.float64],
        basis: NDArray[np.float64],
        squares: NDArray[np.float64],
    ) -> SeenTable:
        """Of (narrow, rank), (c, rank), (c, n_meas), (rank, n_meas) and (n_meas,)."""

    def judged(
        self, fit: Any, change: NDArray[np.float64], uneven: float, ridge: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Squares (k,) of what spots change beside each other, and their covariance (4k, 4k).

        ``fit``: what has the attributes of a tomoskin.sensing.fit.spot_fit.Fit; ``change`` (rank,)
        what all spots change.
        """

@final
class Reduced:
    """What stands for the exact model: see tomoskin.sensing.fit.certificate."""

    def __new__(
        cls,
        profile: tuple[float, float, float, float, float, float],
        interaction: Any,
        certificate: Any,
        rim: NDArray[np.float64],
        radius: float,
        neighbours: int,
    ) -> Reduced:
        """Take what it is made of.

        Parameters
        ----------
        profile
            Of a spot: reach, filling, scales, and of the bell narrow, height and part.
        interaction, certificate
            What have the attributes of an Interaction and of a Certificate in tomoskin.sensing.fit.
        rim
            (m, 2) m, points of it.
        radius
            Of a median spot, m.
        neighbours
            Spots that tell of one between them.

        Raises
        ------
        ValueError
            When these do not fit together.
        """

    def lacking(
        self, spots: NDArray[np.float64], sizes: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64]]:
        """What the table lacks of spots (k, 4) alone at the most, in the measure of the ``sizes``
        (k,) of what each changes; and the change (n_electrodes, n_electrodes) of the transfer
        resistance by all of them beyond that by each."""

def standing(
    left: NDArray[np.float64],
    slopes: NDArray[np.float64],
    each: NDArray[np.float64],
    ridge: float,
) -> NDArray[np.float64]:
    """Squares (k,) of what each of k spots changes, ``each`` (k, c), that the ``slopes`` (4k, c) of
    the others could not take up, in noise with unknown directions ``left`` (q, c)."""

def standing_out(
    signatures: NDArray[np.float64],
    squares: NDArray[np.float64],
    unknown: NDArray[np.float64],
    free: NDArray[np.float64],
    residual: NDArray[np.float64],
    limits: Any,
) -> list[NDArray[np.float64]]:
    """Likelihood ratios (n,) and contents (n,) of candidates in a residual (c,).

    ``unknown`` (q, c) and ``free`` (p, c) directions take up what they can; ``limits``: least and
    largest content by sign, deviations and part of its square below which a candidate is none, and
    the part of a square that keeps equations solvable.
    """
