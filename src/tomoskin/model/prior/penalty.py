"""A prior on one mesh, in the forms that it comes in: what Q is, and what Q⁻¹ does to J.

A one-step image minimises ‖Jx − dv‖²_W + α²xᵀQx. All that an operator needs of Q is Q⁻¹Jᴴ and
JQ⁻¹Jᴴ, n_meas columns at most, so Q is never inverted. Where Q is singular, as a smoothness
prior is, Q⁻¹ is its pseudo-inverse, and the images that Q does not weigh, ``free``, are fitted
to the data beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from tomoskin.core import FloatArray, ModelError, refuse_first

_ZERO = 1e-12
"""An eigenvalue, pivot or row sum below this part of the largest one is zero."""

_SINGULAR = 1e11
"""Condition from which on a matrix may be a singular one after rounding: eigenvalues tell."""

Carried = tuple[NDArray[Any], NDArray[Any]]
"""Q⁻¹Jᴴ (n_cells, n_meas) and JQ⁻¹Jᴴ (n_meas, n_meas)."""

Solve = Callable[[FloatArray], FloatArray]
"""Columns (n_cells, m) → columns."""


class Penalty(Protocol):
    """xᵀQx on the cells of one mesh; Q is real."""

    @property
    def free(self) -> FloatArray:
        """(n_cells, k) orthonormal basis of the images that cost nothing; k is 0 for regular Q."""

    @property
    def matrix(self) -> FloatArray:
        """Q: (n_cells,) where it is diagonal, else dense (n_cells, n_cells)."""

    def carry(self, jacobian: NDArray[Any]) -> Carried:
        """Q⁻¹Jᴴ, in new memory, and JQ⁻¹Jᴴ."""


@dataclass(frozen=True, eq=False)
class Diagonal:
    """Q = diag(``matrix``), (n_cells,) above 0. Raises ModelError where it is not."""

    matrix: FloatArray

    def __post_init__(self) -> None:
        """Refuse an entry that is not positive."""
        bad = ~(self.matrix > 0)
        refuse_first(bad, self.matrix, "a positive diagonal", "prior, cell", ModelError)

    @property
    def free(self) -> FloatArray:
        """The null space of the prior, which is empty."""
        return np.empty((len(self.matrix), 0))

    def carry(self, jacobian: NDArray[Any]) -> Carried:
        """By a symmetric product, which is half the work of a general one."""
        root = 1.0 / np.sqrt(self.matrix)
        scaled = jacobian * root
        gram = scaled @ scaled.conj().T
        scaled *= root
        return scaled.conj().T, gram


@dataclass(frozen=True, eq=False)
class Factored:
    """Q by what solves with it.

    ``dense`` makes Q, (n_cells, n_cells); ``solve`` maps real columns (n_cells, m) that are
    orthogonal to ``free`` by any generalised inverse of Q.
    """

    dense: Callable[[], FloatArray]
    free: FloatArray
    solve: Solve

    @property
    def matrix(self) -> FloatArray:
        """The matrix Q of the penalty, dense."""
        return self.dense()

    def carry(self, jacobian: NDArray[Any]) -> Carried:
        """By one solution for each row of the Jacobian.

        Without its free images before and after, a generalised inverse is the pseudo-inverse.
        """
        columns = self._weighed(jacobian.conj().T)
        if np.iscomplexobj(columns):
            solved = self.solve(columns.real) + 1j * self.solve(columns.imag)
        else:
            solved = self.solve(columns)
        spread = self._weighed(solved)
        return spread, jacobian @ spread

    def _weighed(self, columns: NDArray[Any]) -> NDArray[Any]:
        """``columns`` without their part in the free images."""
        if not self.free.shape[1]:
            return columns
        return np.asarray(columns - self.free @ (self.free.T @ columns))


def sparse_penalty(q: csr_array) -> Penalty:
    """Penalty of a sparse Q, positive semi-definite.

    A part of the mesh whose rows sum to zero is a difference prior: its constant is free. More
    weight on one cell of such a part makes a regular matrix, whose inverse is a generalised
    inverse of Q. Where that does not do, Q is taken as dense.
    """
    count, part = connected_components(q, directed=False)
    diagonal = q.diagonal()
    sums = np.bincount(part, np.abs(q.sum(axis=1)), count)
    floating = np.flatnonzero(sums <= _ZERO * np.bincount(part, np.abs(diagonal), count))
    free = (part[:, None] == floating) / np.sqrt(np.bincount(part)[floating])
    grounded = csc_array(q + diags_array(_ground(free, diagonal)))
    try:
        factor = splu(
            grounded,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        return dense_penalty(q.toarray())
    pivots = factor.U.diagonal()
    if pivots.min() <= _ZERO * pivots.max() or _nearly_singular(grounded, factor.solve):
        return dense_penalty(q.toarray())
    return Factored(q.toarray, free, factor.solve)


def dense_penalty(q: FloatArray) -> Penalty:
    """Penalty of a dense Q, positive semi-definite.

    Raises
    ------
    ModelError
        When Q has a negative eigenvalue.
    """
    constant_is_free = np.abs(q.sum(axis=1)).max() <= _ZERO * np.abs(np.diag(q)).max()
    free = np.full((len(q), int(constant_is_free)), 1.0 / np.sqrt(len(q)))
    solve = dense_solver(q, free)
    return _by_eigenvalues(q) if solve is None else Factored(q.copy, free, solve)


def dense_solver(q: FloatArray, free: FloatArray) -> Solve | None:
    """What solves with a symmetric Q, by Cholesky; None where it is not positive definite.

    ``free`` (n_cells, k) are the constants, on parts of the mesh, that Q maps to zero.
    """
    grounded = q.copy()
    grounded[np.diag_indices_from(grounded)] += _ground(free, np.diag(q))
    try:
        factor = cho_factor(grounded, lower=True, check_finite=False)
    except LinAlgError:
        return None
    solve = partial(cho_solve, factor, check_finite=False)
    pivots = np.diag(factor[0]) ** 2
    if pivots.min() <= _ZERO * pivots.max() or _nearly_singular(grounded, solve):
        return None
    return solve


def _nearly_singular(matrix: FloatArray | csc_array, solve: Solve) -> bool:
    """By how much a solution grows: pivots hide a null vector that hardly has some component."""
    load = np.random.default_rng(0).standard_normal(size=(matrix.shape[0],))
    grown = np.linalg.norm(solve(load)) / np.linalg.norm(load)
    return bool(grown * np.abs(matrix.diagonal()).max() > _SINGULAR)


def _ground(free: FloatArray, diagonal: FloatArray) -> FloatArray:
    """(n_cells,) weight on one cell of each free image."""
    ground = np.zeros(len(diagonal))
    ground[free.argmax(axis=0)] = np.abs(diagonal).max()
    return ground


def _by_eigenvalues(q: FloatArray) -> Penalty:
    """Penalty of a Q with free images that are not constants: costly, and always right."""
    values, vectors = eigh(q, check_finite=False)
    if values[0] < -_ZERO * np.abs(values).max():
        raise ModelError(f"the prior is not positive definite: it has eigenvalue {values[0]:.3g}")
    regular = values > _ZERO * np.abs(values).max()
    kept = vectors[:, regular]
    inverse = kept.T / values[regular, None]
    return Factored(q.copy, vectors[:, ~regular], lambda columns: kept @ (inverse @ columns))
