"""The arithmetic of a fit by numpy: Levenberg–Marquardt, unknown directions integrated out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from scipy.linalg.lapack import dposv, dtrtrs
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.fit.expectation import Expectation, Known, newcomers
from tomoskin.sensing.fit.problem import RIDGE, Limits, Matched, Problem
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS, X, Y
from tomoskin.sensing.fit.spot_fit import Deficit, Fit, SpotPrior
from tomoskin.sensing.fit.table import ResponseTable

_SETTLED = 0.05
"""Newton decrement, squared, at which a step is too small to matter: 0.22 deviations."""

_LEAST_DAMPING, _MOST_DAMPING = 1e-6, 1e3


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
    searched: ClassVar[None] = None

    def keep(
        self, direct: FloatArray, timed: FloatArray, matrix: FloatArray, squares: FloatArray
    ) -> None:
        """See :class:`Solver`; nothing."""

    def expanded(self, spots: FloatArray) -> FloatArray:
        """What spots do by the table; see :class:`Solver`."""
        return self.table.expanded(spots)

    def settled(
        self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()
    ) -> Fit:
        """See :class:`Solver`.

        Levenberg (1944) and Marquardt (1963): damping relative to the diagonal.
        """
        pull = Pull.of(self.prior, problem.expected, known or newcomers(len(spots)))
        best = self._at(problem, self._held(spots, problem.sign), deficit, pull)
        while most > 0:
            moved, steps, settled = self._descended(problem, best, most, pull)
            best = replace(best, settled=settled)
            if np.array_equal(moved, best.spots):
                break
            most -= steps
            best = self._at(problem, moved, deficit, pull)
            gradient = pull.pulled(best.spots, best.gradient)
            gain = float(gradient @ _solved(best.normal, gradient, _LEAST_DAMPING))
            best = replace(best, settled=gain < _SETTLED)
        return best

    def _descended(
        self, problem: Problem, fit: Fit, most: int, pull: Pull
    ) -> tuple[FloatArray, int, bool]:
        """Spots where so many steps lead from a fit by its metric, these, and whether there is
        nothing to gain."""
        metric, best = NuisanceMetric.of(fit.unknown), Slope.of(fit, pull)
        damping = _LEAST_DAMPING
        for steps in range(most):
            step = _solved(best.normal, best.gradient, damping)
            if best.gradient @ step < _SETTLED:
                return best.spots, steps, True
            moved = self._held(best.spots + step.reshape(-1, N_PARAMETERS), problem.sign)
            tried = self._slope(problem, metric, moved, fit.deficit, pull)
            if tried.cost < best.cost:
                best, damping = tried, max(damping / 10, _LEAST_DAMPING)
            elif damping > _MOST_DAMPING:
                return best.spots, steps, True
            else:
                damping = max(damping * 30, 1e-2)
        return best.spots, most, False

    def _at(self, problem: Problem, spots: FloatArray, deficit: Deficit, pull: Pull) -> Fit:
        """The frame with these spots, as they are."""
        parts, direct = self.table.expanded(spots), problem.seen.direct
        own = parts[:, 1 : 1 + N_PARAMETERS]
        each = parts[:, 0] @ direct.T
        slopes = own.reshape(-1, direct.shape[1]) @ direct.T
        directed, reshaped = parts[:, 1 + N_PARAMETERS :].swapaxes(0, 1) @ direct.T
        unknown = np.vstack([
            problem.left,
            self.prior.directed * directed,
            self.prior.reshaped * reshaped,
            *_within_scan(problem, spots, own),
        ])  # fmt: skip
        predicted = each.sum(axis=0) + direct @ deficit.change
        residual = problem.data - predicted
        metric = NuisanceMetric.of(unknown)
        square = metric.products(np.vstack([slopes, residual]))
        misfit = problem.rest + float(square[-1, -1])
        return Fit(
            spots=spots,
            deficit=deficit,
            change=parts[:, 0].sum(axis=0),
            each=each,
            predicted=predicted,
            residual=residual,
            slopes=slopes,
            unknown=unknown,
            normal=pull.normal(square),
            gradient=square[:-1, -1],
            misfit=misfit,
            log_size=metric.log_size,
            cost=(misfit + pull.square(spots)) / 2,
            degrees=max(len(problem.seen.full) - len(slopes), 1),
            settled=False,
            known=pull.known,
        )

    def _slope(
        self,
        problem: Problem,
        metric: NuisanceMetric,
        spots: FloatArray,
        deficit: Deficit,
        pull: Pull,
    ) -> Slope:
        """The cost of spots by the metric of others."""
        direct = problem.seen.direct
        seen = self.table.expanded(spots)[:, : 1 + N_PARAMETERS] @ direct.T
        residual = problem.data - seen[:, 0].sum(axis=0) - direct @ deficit.change
        slopes = seen[:, 1:].reshape(-1, len(residual))
        square = metric.products(np.vstack([slopes, residual]))
        cost = (problem.rest + float(square[-1, -1]) + pull.square(spots)) / 2
        return Slope(spots, pull.normal(square), pull.pulled(spots, square[:-1, -1]), cost)

    def _held(self, spots: FloatArray, sign: str) -> FloatArray:
        return self.prior.held(self.sheet.held(spots), sign)

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        """What the engine keeps of it; see :class:`Solver`."""
        seen = problem.seen
        change = (fit.change + fit.deficit.change) @ self.table.basis
        onto = _Beside.of(fit.unknown, fit.slopes[:0]).projected(fit.slopes)
        answers = onto @ seen.matrix * change
        moved = fit.covariance @ answers
        unexplained = float(seen.squares @ change**2 - np.sum(answers * moved))
        beyond = max(fit.misfit - fit.degrees, 0.0) / unexplained if unexplained > 0 else 0.0
        scatter = max(1.0, fit.misfit / fit.degrees)
        covariance = scatter * fit.covariance + max(beyond, uneven**2) * (moved @ moved.T)
        return self.standing(fit.unknown[:0], fit), covariance

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        """The minimum near ``spots``; see :class:`Solver`."""
        k = len(fit.spots)
        own = NuisanceMetric.of(left).products(np.vstack([fit.slopes, fit.each]))
        number, squares = np.arange(N_PARAMETERS * k), np.empty(k)
        for spot in range(k):
            mine, others = N_PARAMETERS * k + spot, number[number // N_PARAMETERS != spot]
            root, scale = _even_root(own[np.ix_(others, others)])
            taken = _solved_lower(root, scale * own[others, mine])
            squares[spot] = own[mine, mine] - taken @ taken
        return np.maximum(squares, 0.0)

    def standing_out(
        self, matched: Matched, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        """The touches in one call; see :class:`Solver`."""
        signatures, squares = matched.signatures, matched.squares
        beside = _Beside.of(fit.unknown, fit.slopes)
        clean = beside.projected(fit.residual[None])[0, : signatures.shape[1]]
        onto = np.clip(signatures @ clean, limits.low, limits.high)
        likely = np.flatnonzero(onto**2 > limits.least**2 * squares)
        size = squares[likely] - beside.taken(signatures[likely])
        useful = size > limits.useful * squares[likely]
        chosen, size = likely[useful], size[useful]
        ratio, content = np.zeros(len(squares)), np.zeros(len(squares))
        content[chosen] = onto[chosen] / size
        ratio[chosen] = np.abs(onto[chosen]) / np.sqrt(size)
        return ratio, content


@dataclass(frozen=True, eq=False)
class Pull:
    """What is held to be likely of each of k spots: the normal distribution that is expected of
    those that are ``known``, the prior of the others.

    ``middles`` (k, 4); ``weights`` (k, 4, 4) inverse of the covariance, 0 for what is even over the
    sheet, which ``bends`` (k, 4, 4) has as wide as the sheet.
    """

    known: Known
    middles: FloatArray
    weights: FloatArray
    bends: FloatArray

    @classmethod
    def of(cls, prior: SpotPrior, expected: Expectation, known: Known) -> Pull:
        """Of so many spots as there are ``known``."""
        k = len(known)
        middles, squares = np.tile(prior.middle, (k, 1)), prior.weights**2
        bends = np.tile(np.diag(squares), (k, 1, 1))
        weights = np.tile(np.diag(squares * [0, 0, 1, 1]), (k, 1, 1))
        for own, number in enumerate(known):
            if number is not None:
                middles[own, :CONTENT] = expected.spots[number, :CONTENT]
                weights[own, :CONTENT, :CONTENT] = expected.weights[number]
                bends[own] = weights[own]
        return cls(known, middles, weights, bends)

    def normal(self, square: FloatArray) -> FloatArray:
        """(4k, 4k) of data and prior together; ``square`` (4k + 1, 4k + 1) of the data."""
        normal = square[:-1, :-1].copy()
        for k, bend in enumerate(self.bends):
            here = slice(N_PARAMETERS * k, N_PARAMETERS * (k + 1))
            normal[here, here] += bend
        return normal

    def pulled(self, spots: FloatArray, gradient: FloatArray) -> FloatArray:
        """A gradient (4k,) with the prior's part."""
        return np.asarray(gradient - self._forces(spots).ravel())

    def square(self, spots: FloatArray) -> float:
        """Of the deviations of all spots."""
        return float(((spots - self.middles) * self._forces(spots)).sum())

    def _forces(self, spots: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("kij,kj->ki", self.weights, spots - self.middles))


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


@dataclass(frozen=True, eq=False)
class NuisanceMetric:
    """C⁻¹ = 1 − Dᵀ(1 + DDᵀ)⁻¹D (Woodbury 1950) of unknown directions D.

    ``unknown`` (q, c) are these, ``root`` (q, q) is the lower one of 1 + DDᵀ, and ``log_size`` half
    the logarithm of C's determinant.
    """

    unknown: FloatArray
    root: FloatArray
    log_size: float

    @classmethod
    def of(cls, unknown: FloatArray) -> NuisanceMetric:
        """The metric of directions (q, c)."""
        root = np.asarray(np.linalg.cholesky(np.eye(len(unknown)) + unknown @ unknown.T))
        return cls(unknown, root, float(np.log(np.diag(root)).sum()))

    def products(self, rows: FloatArray) -> FloatArray:
        """(n, n) of rows (n, c), with C⁻¹ between them."""
        own = rows @ rows.T
        if len(self.unknown):
            across = _solved_lower(self.root, self.unknown @ rows.T)
            own -= across.T @ across
        return np.asarray(own)


@dataclass(frozen=True, eq=False)
class Slope:
    """The ``cost`` of ``spots`` (k, 4), its ``gradient`` (4k,) downhill, and how it bends,
    ``normal`` (4k, 4k)."""

    spots: FloatArray
    normal: FloatArray
    gradient: FloatArray
    cost: float

    @classmethod
    def of(cls, fit: Fit, pull: Pull) -> Self:
        """The slope where a fit stands."""
        return cls(fit.spots, fit.normal, pull.pulled(fit.spots, fit.gradient), fit.cost)


@dataclass(frozen=True, eq=False)
class _Beside:
    """What is left of rows beside directions: C⁻¹ less what that keeps of the span of free ones, of
    which any amount may be there. C = 1 + DᵀD of unknown directions D.

    ``both`` (q + p, c) are unknown and free ones, each scaled to length 1 in C; ``root`` is the
    lower one of their products.
    """

    both: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, unknown: FloatArray, free: FloatArray) -> _Beside:
        both, q = np.vstack([unknown, free]), len(unknown)
        square = both @ both.T
        square[range(q), range(q)] += 1.0
        root, scale = _even_root(square)
        return cls(scale[:, None] * both, root)

    def projected(self, rows: FloatArray) -> FloatArray:
        """(m, c): what is left of rows (m, c)."""
        if not len(self.both):
            return rows
        taken = _solved_lower(self.root, self.both @ rows.T)
        back = dtrtrs(self.root, taken, lower=1, trans=1)[0]
        return np.asarray(rows - back.T @ self.both)

    def taken(self, rows: FloatArray) -> FloatArray:
        """(m,) of the squares of rows (m, n), of which the first n columns are given."""
        if not len(self.both) or not len(rows):
            return np.zeros(len(rows))
        taken = _solved_lower(self.root, self.both[:, : rows.shape[1]] @ rows.T)
        return np.asarray(np.einsum("qm,qm->m", taken, taken))


def _even_root(square: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, n) lower root of a matrix scaled to a diagonal of 1 and a ridge, and (n,) the scale."""
    scale = 1 / np.sqrt(np.maximum(np.diag(square), 1e-300))
    even = square * scale[:, None] * scale
    even.flat[:: len(even) + 1] += RIDGE
    return np.asarray(np.linalg.cholesky(even)), scale


def _solved_lower(root: FloatArray, columns: FloatArray) -> FloatArray:
    if not columns.size:
        return columns
    return np.asarray(dtrtrs(root, columns, lower=1)[0])


def _solved(normal: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    if not len(gradient):
        return gradient
    scale = 1 / np.sqrt(np.diag(normal))
    even = normal * scale[:, None] * scale
    even.flat[:: len(even) + 1] *= 1 + damping
    return np.asarray(scale * dposv(even, scale * gradient)[1])
