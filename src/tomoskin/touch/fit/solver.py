"""The arithmetic of a fit by numpy: Levenberg–Marquardt, unknown directions integrated out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray
from tomoskin.mesh import Mesh
from tomoskin.touch.fit.prior import SpotPrior
from tomoskin.touch.fit.refine import Deficit, Fit, Problem
from tomoskin.touch.fit.spot import CONTENT, N_PARAMETERS, X, Y
from tomoskin.touch.fit.table import ResponseTable

_SETTLED = 0.02
"""Newton decrement, squared, at which a step is too small to matter: 0.14 deviations."""

_LEAST_DAMPING = 1e-6

DIRECTED = 0.7
"""Standard deviation of a spot's direction (:class:`Part`) about none."""

RESHAPED = 0.5
"""Standard deviation of its shape, of the way from a tail to a bell: both are one from ours."""

RIDGE = 1e-9
"""Part of a square that keeps the equations of slopes solvable that are in proportion."""


class SheetDomain:
    """Where a touch may be: what leaves the mesh is brought back to its nearest cell."""

    def __init__(self, mesh: Mesh) -> None:
        self.centroids = mesh.centroids
        self._tree = cKDTree(mesh.centroids)
        corners = mesh.points[mesh.cells] - mesh.centroids[:, None]
        self.margin = np.linalg.norm(corners, axis=2).max(axis=1)

    def held(self, spots: FloatArray) -> FloatArray:
        """``spots`` (k, 4) on the sheet."""
        apart, cell = (np.atleast_1d(nearest) for nearest in self._tree.query(spots[:, :2]))
        off = np.asarray(apart > self.margin[cell])
        if not off.any():
            return spots
        kept = spots.copy()
        kept[off, :2] = self.centroids[cell[off]]
        return kept


@dataclass(frozen=True, eq=False)
class NumpySolver:
    """Numpy's; see :class:`Solver`."""

    table: ResponseTable
    sheet: SheetDomain
    prior: SpotPrior

    def keep(self, direct: FloatArray, timed: FloatArray) -> None:
        """See :class:`Solver`; nothing."""

    def expanded(self, spots: FloatArray) -> FloatArray:
        """See :class:`Solver`."""
        return self.table.expanded(spots)

    def settled(self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int) -> Fit:
        """See :class:`Solver`.

        Levenberg (1944) and Marquardt (1963): damping relative to the diagonal.
        """
        best = replace(self._at(problem, self._held(spots, problem.sign), deficit), settled=False)
        damping = _LEAST_DAMPING
        for _ in range(most):
            pull = self.prior.away(best.spots) * self.prior.weights
            gradient = best.gradient - pull.ravel()
            step = _solved(best.normal, gradient, damping)
            if gradient @ step < _SETTLED:
                return replace(best, settled=True)
            moved = self._held(best.spots + step.reshape(-1, N_PARAMETERS), problem.sign)
            tried = self._at(problem, moved, deficit)
            if tried.cost < best.cost:
                best, damping = replace(tried, settled=False), max(damping / 10, _LEAST_DAMPING)
            elif damping > 1e3:
                return replace(best, settled=True)
            else:
                damping = max(damping * 30, 1e-2)
        return best

    def _at(self, problem: Problem, spots: FloatArray, deficit: Deficit) -> Fit:
        """The frame with these spots, as they are."""
        parts, direct = self.table.expanded(spots), problem.seen.direct
        own = parts[:, 1 : 1 + N_PARAMETERS]
        each = parts[:, 0] @ direct.T
        slopes = own.reshape(-1, direct.shape[1]) @ direct.T
        directed, reshaped = parts[:, 1 + N_PARAMETERS :].swapaxes(0, 1) @ direct.T
        unknown = np.vstack([
            problem.left,
            DIRECTED * directed,
            RESHAPED * reshaped,
            *_within_scan(problem, spots, own),
        ])  # fmt: skip
        predicted = each.sum(axis=0) + direct @ deficit.change
        residual = problem.data - predicted
        square, gradient, misfit, log_size = _integrated(unknown, slopes, residual)
        away, weights = self.prior.away(spots), np.tile(self.prior.weights, len(spots))
        return Fit(
            spots=spots,
            deficit=deficit,
            each=each,
            predicted=predicted,
            residual=residual,
            slopes=slopes,
            unknown=unknown,
            normal=square + np.diag(weights**2),
            gradient=gradient,
            misfit=misfit,
            log_size=log_size,
            cost=(misfit + float((away**2).sum())) / 2,
        )

    def _held(self, spots: FloatArray, sign: str) -> FloatArray:
        return self.prior.held(self.sheet.held(spots), sign)

    def projected(self, unknown: FloatArray, free: FloatArray, rows: FloatArray) -> FloatArray:
        """See :class:`Solver`."""
        both, q = np.vstack([unknown, free]), len(unknown)
        square = both @ both.T
        square[range(q), range(q)] += 1.0
        scale = 1 / np.sqrt(np.maximum(np.diag(square), 1e-300))
        even = square * scale[:, None] * scale
        even[np.diag_indices_from(even)] += RIDGE
        scaled = scale[:, None] * both
        return np.asarray(rows - (rows @ scaled.T) @ np.linalg.solve(even, scaled))


def _within_scan(problem: Problem, spots: FloatArray, slopes: FloatArray) -> list[FloatArray]:
    """(k, r) thrice: what it does that touches move along x and y, and grow, while the
    measurements are taken one after the other."""
    if not problem.reach:
        return []
    timed, content = problem.seen.timed, problem.grows * spots[:, CONTENT, None]
    return [
        (size * slopes[:, column]) @ timed.T
        for column, size in ((X, problem.reach), (Y, problem.reach), (CONTENT, content))
    ]


def _integrated(
    unknown: FloatArray, slopes: FloatArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray, float, float]:
    """JC⁻¹Jᵀ, JC⁻¹r, rC⁻¹r and half the logarithm of C's determinant, C = 1 + DᵀD.

    C⁻¹ = 1 − Dᵀ(1 + DDᵀ)⁻¹D (Woodbury 1950): D are ``unknown`` (q, r), J the ``slopes`` (p, r).
    """
    columns = np.vstack([unknown, slopes, residual])
    gram, q = columns @ columns.T, len(unknown)
    own, log_size = gram[q:, q:], 0.0
    if q:
        root = np.asarray(np.linalg.cholesky(np.eye(q) + gram[:q, :q]))
        across = _solved_lower(root, gram[:q, q:])
        own = own - across.T @ across
        log_size = float(np.log(np.diag(root)).sum())
    return own[:-1, :-1], own[:-1, -1], float(own[-1, -1]), log_size


def _solved_lower(root: FloatArray, columns: FloatArray) -> FloatArray:
    return np.asarray(solve_triangular(root, columns, lower=True, check_finite=False))


def _solved(normal: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    scale = 1 / np.sqrt(np.diag(normal))
    even = normal * scale[:, None] * scale
    even[np.diag_indices_from(even)] *= 1 + damping
    return np.asarray(scale * cho_solve(cho_factor(even), scale * gradient))
