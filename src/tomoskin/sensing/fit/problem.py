"""The frame that is to be explained, and what a solver does for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from tomoskin.core import FloatArray, reach
from tomoskin.sensing.fit.certificate import Reduced
from tomoskin.sensing.fit.expectation import Expectation, Known
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.policy import FAINTEST, USEFUL, DetectionPolicy, Pace
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS, bounds_of
from tomoskin.sensing.fit.spot_fit import Deficit, Fit, SpotPrior
from tomoskin.sensing.fit.table import ABREAST, ResponseTable

_CERTAIN = 10.0
"""Deviations up to which a single spot's table is exact to less than the noise."""

_AGAIN = 2
"""Steps after what the table lacks has been renewed."""

_UNSEEN = 0.1
"""Deviations, in the mean over strong touches, that are left out of what changes show along."""

_CLEAR = 1e-10
"""Part of the largest square above which an axis is one to ten digits."""

_EXACT = 0.1
"""Deviations by which the exact model may differ from what a fit was made with."""

RIDGE = 1e-9
"""Part of a square that keeps the equations of slopes solvable that are in proportion."""


@dataclass(frozen=True, eq=False)
class WhitenedTable:
    """A table as whitened data see it: along the c axes that touches can change at all.

    Changes are smooth, and show above the noise along few axes. Along the others data are
    noise whatever touches; only their square counts.

    Attributes
    ----------
    solver
        What spots do.
    matrix
        (c, n_meas) 1/V, from data to whitened data along the axes.
    full
        (r, n_meas) 1/V, to all of them.
    narrow
        Axes that changes show along, the first ones; the others are those of a change that
        moves on while the measurements are taken.
    direct, timed
        (c, rank) from a change in the table's basis to whitened data; of ``timed`` each
        measurement counts as often as it is after the middle of the scan.
    """

    solver: Solver
    matrix: FloatArray
    full: FloatArray
    narrow: int
    direct: FloatArray
    timed: FloatArray

    @classmethod
    def making(
        cls, solver: Solver, whiten: Whitener, times: FloatArray, jumps: FloatArray
    ) -> Generator[None, None, WhitenedTable]:
        """A piece of work between two yields; ``times`` (n_meas,) of the measurements about the
        middle of the scan; the axes hold ``jumps`` (n_meas, j) as well."""
        full, table = whiten.matrix, solver.table
        direct, timed = full @ table.basis.T, full @ (times[:, None] * table.basis.T)
        yield
        axes = _axes(direct @ table.typical, least=1)
        yield
        others = np.hstack([timed @ table.typical, full @ jumps])
        more = _axes(others - axes @ (axes.T @ others), least=0)
        yield
        both, narrow = np.column_stack([axes, more]), axes.shape[1]
        direct = both.T @ direct
        direct[narrow:] = 0.0
        return cls(solver, both.T @ full, full, narrow, direct, both.T @ timed)

    def louder(self, times: float) -> WhitenedTable:
        """The same in so many times the noise's variance."""
        part = 1.0 / math.sqrt(times)
        matrix, full, direct, timed = (
            part * m for m in (self.matrix, self.full, self.direct, self.timed)
        )
        return WhitenedTable(self.solver, matrix, full, self.narrow, direct, timed)

    @cached_property
    def squares(self) -> FloatArray:
        """(n_meas,) 1/V²: of what each measurement alone is, whitened."""
        return np.asarray((self.full**2).sum(axis=0))

    @cached_property
    def kept(self) -> Any:
        """What its solver keeps of it."""
        return self.solver.keep(self.direct[: self.narrow], self.timed, self.matrix, self.squares)

    def whitened(self, data: FloatArray) -> tuple[FloatArray, float]:
        """(c,) of data (n_meas,) V along the axes, and the square of the rest."""
        every, along = self.full @ data, self.matrix @ data
        return along, max(float(every @ every - along @ along), 0.0)


def _axes(typical: FloatArray, least: int) -> FloatArray:
    """(r, c) orthonormal: along them ``typical`` changes (r, n) are but for ``_UNSEEN``; so many at
    the ``least``, in whatever noise, and full vectors where there are as many."""
    square, vectors = np.linalg.eigh(typical.T @ typical)
    dropped = int(np.searchsorted(np.cumsum(np.maximum(square, 0.0)), _UNSEEN**2))
    wanted = max(len(square) - dropped, least)
    clear = int(np.count_nonzero(square > _CLEAR * square[-1]))
    kept = max(wanted, min(-(-wanted // ABREAST) * ABREAST, clear))
    first = len(square) - kept
    return np.asarray(typical @ (vectors[:, first:] / np.sqrt(square[first:])))


class Solver(Protocol):
    """The arithmetic of a fit by a table."""

    @property
    def table(self) -> ResponseTable:
        """The table of what one spot does."""

    def keep(
        self, direct: FloatArray, timed: FloatArray, matrix: FloatArray, squares: FloatArray
    ) -> Any:
        """What it keeps of a :class:`WhitenedTable`; ``direct`` (narrow, rank)."""

    def expanded(self, spots: FloatArray) -> FloatArray:
        """See :meth:`ResponseTable.expanded`."""

    def settled(
        self, problem: Problem, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()
    ) -> Fit:
        """The minimum of the cost near ``spots`` (k, 4), after at most so many steps; nobody
        ``known``: all are newcomers.

        What is unknown of the spots is taken as it is at the first ones, and anew where steps
        with that end.
        """

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        """(k,) square of what each spot of a fit changes that the slopes of the others could not
        take up, in noise with unknown directions ``left`` (q, c)."""

    def standing_out(
        self, matched: Matched, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        """(n,) likelihood ratio of each candidate, and (n,) its most likely content.

        The ratio is the square root of twice its logarithm: deviations by which the candidate
        stands out (GLRT; Kay 1998, section 7.6.2, for a linear model), after what the spots of
        ``fit`` could take up.
        """

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        """As :meth:`standing` in noise alone, and (4k, 4k) the covariance of all parameters.

        The covariance is the curvature's, scaled where the data scatter more than they should, and
        the part by which each measurement answers otherwise than the model's, ``uneven`` at the
        least: that is not fitted but considered (Schmidt 1966). How much it is, is what the
        residual has beyond noise, E[rᵀr] = degrees + u²‖(1 − JΣJᵀ)E‖², E the measurements'
        answers one by one.
        """

    @property
    def searched(self) -> Search | None:
        """What :class:`~tomoskin.sensing.fit.selection.ForwardSelection` finds, in one call; None
        where this solver goes step by step."""


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A fit; the likelihood ratios (n,) and contents (n,) of candidates beside it, where these have
    been looked at; and one spot more where that was tried last, and not worth it."""

    fit: Fit
    others: tuple[FloatArray, FloatArray] | None
    turned_down: Fit | None


Search = Callable[["Problem", "Matched", DetectionPolicy, Deficit, FloatArray], Answer | None]
"""Of a frame with candidates: what the table lacked of the touches of the last frame, and these
(k, 4). The answer is None where it cannot be had at the policy's pace."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What counts of candidates.

    Attributes
    ----------
    low, high
        Of the content: no candidate goes beyond 0 on the side that is 0.
    least
        Deviations of the noise below which a candidate is none.
    useful
        Part of a candidate's square that the spots of a fit must leave of it.
    ridge
        See :data:`RIDGE`.
    """

    low: float
    high: float
    least: float = FAINTEST
    useful: float = USEFUL
    ridge: float = RIDGE

    @classmethod
    def of(cls, sign: str) -> Self:
        """For touches of this ``sign``."""
        return cls(*bounds_of(sign, math.inf))


@dataclass(frozen=True, eq=False)
class Matched:
    """Candidates, their whitened signatures (n, narrow), and (n,) the squares of these."""

    spots: FloatArray
    signatures: FloatArray
    squares: FloatArray

    @classmethod
    def of(cls, spots: FloatArray, signatures: FloatArray) -> Self:
        """Spots (n, 4) of these signatures (n, narrow)."""
        return cls(spots, signatures, np.einsum("nr,nr->n", signatures, signatures))

    def louder(self, times: float) -> Self:
        """The same in so many times the noise's variance."""
        return self.of(self.spots, self.signatures / math.sqrt(times))

    def ratios(self, solver: Solver, fit: Fit, sign: str) -> tuple[FloatArray, FloatArray]:
        """See :meth:`Solver.standing_out`; for touches of this ``sign``."""
        return solver.standing_out(self, fit, Limits.of(sign))

    def spot(self, number: int, content: FloatArray) -> FloatArray:
        """(4,) candidate ``number`` with its content of ``contents`` (n,)."""
        chosen = self.spots[number].copy()
        chosen[CONTENT] = content[number]
        return np.asarray(chosen)


Exact = Callable[[Sequence[FloatArray]], FloatArray]
"""See :meth:`Response.changes`."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Whitened data (c,) of one frame, and what they are explained with.

    ``exact`` is the exact model: (b, n_meas) V that sets of spots change. ``reduced`` stands for it
    where its error is small; None where nothing does.
    ``rest`` is the square of what the data have along no axis of theirs.
    ``sign`` is "decrease", "increase" or "both". Standard deviations of what a touch does within a
    scan: its way along each axis, ``reach`` m, and what it ``grows`` by, in parts of it.
    ``left`` (q, c) are directions of residual responses, each as long as its deviation.
    ``expected`` are the touches of the frame before where they may have gone.
    """

    exact: Exact
    reduced: Reduced | None
    seen: WhitenedTable
    prior: SpotPrior
    sign: str
    reach: float
    grows: float
    data: FloatArray
    rest: float
    left: FloatArray
    expected: Expectation = field(default_factory=Expectation.none)

    @property
    def square(self) -> float:
        """The square of all whitened data."""
        return float(self.data @ self.data) + self.rest

    @property
    def depths(self) -> tuple[float, float]:
        """Least and largest depth of a spot."""
        return self.prior.depths(self.sign)

    @property
    def solver(self) -> Solver:
        """The solver that fits spots to this frame."""
        return self.seen.solver

    def nothing(self) -> Fit:
        """The frame with no spot at all."""
        none = np.zeros((0, N_PARAMETERS))
        return self.solver.settled(self, none, Deficit.none(len(self.solver.table.basis)), 0)

    def refined(self, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()) -> Fit:
        """The best fit near ``spots``, see :meth:`Solver.settled`."""
        return self.solver.settled(self, spots, deficit, most, known)

    def corrected(self, fit: Fit, pace: Pace, rounds: int) -> Fit:
        """The fit with what the table lacks at its spots, so many rounds at most, and not where
        that is there for spots as near.

        The exact model says what that is, or what stands for it to a tolerance, as ``pace`` has
        both. A single faint spot is left as it is: what its table lacks is below the noise.
        """
        near, tolerance = pace.near, pace.tolerance
        if not rounds or not len(fit.spots) or fit.deficit.holds_for(fit.spots, near):
            return fit
        if len(fit.spots) == 1 and np.linalg.norm(fit.each) < _CERTAIN:
            return fit
        reach("exact model")
        allowed = max(_EXACT, tolerance * math.sqrt(len(self.seen.full)))
        for _ in range(rounds):
            deficit = (self._reduced(fit, allowed) if tolerance else None) or self._exact(fit)
            far = np.linalg.norm(self.seen.direct @ (deficit.change - fit.deficit.change))
            if far < allowed:
                return replace(fit, deficit=deficit)
            fit = self.solver.settled(self, fit.spots, deficit, _AGAIN, fit.known)
            if fit.deficit.holds_for(fit.spots, near):
                break
        return fit

    def _reduced(self, fit: Fit, allowed: float) -> Deficit | None:
        """What the table lacks of the spots of a fit, by what stands for the exact model; None
        where more may be wrong of it than so many deviations."""
        if self.reduced is None:
            return None
        sizes = np.sqrt(np.einsum("kc,kc->k", fit.each, fit.each))
        alone, volts = self.reduced.lacking(fit.spots, sizes)
        change = self.solver.table.basis @ volts
        together = self.seen.direct @ change
        pairs = self.reduced.certificate.pair * math.sqrt(together @ together)
        return Deficit(fit.spots, change) if math.hypot(alone, pairs) < allowed else None

    def _exact(self, fit: Fit) -> Deficit:
        """The same by the exact model."""
        exact = self.solver.table.basis @ self.exact([fit.spots])[0]
        return Deficit(fit.spots, exact - fit.change)

    def evidence(self, fit: Fit) -> float:
        """See :meth:`Fit.log_evidence`."""
        return fit.log_evidence(self.prior, self.expected)

    def gain(self, fit: Fit, other: Fit) -> float:
        """What the evidence of the ``other`` fit has more."""
        return self.evidence(other) - self.evidence(fit)
