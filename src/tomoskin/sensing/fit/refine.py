"""What explains a frame, and the frame that is to be explained."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Protocol

import numpy as np

from tomoskin.core import FloatArray, finished, reach
from tomoskin.sensing.fit.certificate import Reduced
from tomoskin.sensing.fit.expectation import Expectation, Known
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.pace import Pace
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS, Response
from tomoskin.sensing.fit.table import ABREAST, ResponseTable

_CERTAIN = 10.0
"""Deviations up to which a single spot's table is exact to less than the noise."""

_AGAIN = 2
"""Steps after what the table lacks has been renewed."""

_UNSEEN = 0.1
"""Deviations, in the mean over strong touches, that are left out of what changes show along."""

_CLEAR = 1e-10
"""Part of the largest square above which an axis is one to ten digits."""

_FAVOURS = math.log(200)
"""Logarithm of the odds from which one explanation is favoured."""

_EXACT = 0.1
"""Deviations by which the exact model may differ from what a fit was made with."""


@dataclass(frozen=True, eq=False)
class Deficit:
    """What a table lacks, as the exact model has it: a small part that changes slowly.

    Attributes
    ----------
    spots
        (k, 4) for which the exact model was solved.
    change
        (rank,) V by which it differs from the table, in the table's basis.
    """

    spots: FloatArray
    change: FloatArray

    @classmethod
    def none(cls, rank: int) -> Deficit:
        """Before the exact model is solved."""
        return cls(np.zeros((0, N_PARAMETERS)), np.zeros(rank))

    def holds_for(self, spots: FloatArray, part: float) -> bool:
        """Whether as many ``spots`` (k, 4) are where they were, as wide and as strong, but for a
        ``part`` of radius and content."""
        if len(spots) != len(self.spots):
            return False
        return all(map(partial(_alike, part), spots.tolist(), self.spots.tolist()))


def _alike(part: float, spot: list[float], other: list[float]) -> bool:
    """Whether a ``spot`` is where the other one was, but for a ``part`` of that."""
    x, y, log_radius, content = (here - there for here, there in zip(spot, other, strict=True))
    near = math.hypot(x, y) <= part * math.exp(other[LOG_RADIUS])
    return near and abs(log_radius) <= part and abs(content) <= part * abs(other[CONTENT])


@dataclass(frozen=True, eq=False)
class Fit:
    """Spots that explain a frame. Unknown amplitudes along some directions are integrated out.

    Attributes
    ----------
    spots
        (k, 4), see :mod:`tomoskin.sensing.fit.spot`.
    deficit
        What the table lacks of these spots.
    change
        (rank,) V that all of them change by the table, in its basis.
    each, predicted
        (k, c) what each spot does to the whitened data, and (c,) what all do together.
    residual
        (c,) whitened data less what all do.
    slopes
        (4k, c) derivatives of the whitened model.
    unknown
        (q, c) directions, each as long as its amplitude's deviation.
    normal
        (4k, 4k) inverse of the covariance: JC⁻¹Jᵀ and the prior; C = 1 + unknownᵀ unknown.
    gradient
        (4k,) JC⁻¹ residual.
    misfit
        residualᵀ C⁻¹ residual: about as many as it has entries where the model is right.
    log_size
        Half the logarithm of the determinant of C.
    cost
        Half the misfit and the squares of the prior.
    degrees
        Degrees of freedom of the residual.
    settled
        Whether the steps towards it came to an end.
    known
        Who each spot is; nobody at all: all are newcomers.
    """

    spots: FloatArray
    deficit: Deficit
    change: FloatArray
    each: FloatArray
    predicted: FloatArray
    residual: FloatArray
    slopes: FloatArray
    unknown: FloatArray
    normal: FloatArray
    gradient: FloatArray
    misfit: float
    log_size: float
    cost: float
    degrees: int
    settled: bool = True
    known: Known = ()

    @cached_property
    def covariance(self) -> FloatArray:
        """(4k, 4k) of all parameters, by the curvature at the minimum."""
        scale = 1 / np.sqrt(np.diag(self.normal))
        even = np.linalg.inv(self.normal * scale[:, None] * scale)
        return np.asarray(even * scale[:, None] * scale)

    def log_evidence(self, prior: SpotPrior, expected: Expectation) -> float:
        """Logarithm of ∫ likelihood · prior by Laplace's method (MacKay 2003, eq. 28.5).

        Up to what all fits of the same data have in common.
        """
        n = len(self.normal)
        sign, log_det = np.linalg.slogdet(self.normal) if n else (1.0, 0.0)
        volume = (n * math.log(2 * math.pi) - log_det) / 2 if sign > 0 else -np.inf
        return volume - self.cost - self.log_size + prior.log_most(self.known, expected)


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
    def of(cls, solver: Solver, whiten: Whitener, times: FloatArray) -> WhitenedTable:
        """``times`` (n_meas,) of the measurements about the middle of the scan."""
        return finished(cls.making(solver, whiten, times, np.zeros((len(times), 0))))

    @classmethod
    def making(
        cls, solver: Solver, whiten: Whitener, times: FloatArray, jumps: FloatArray
    ) -> Generator[None, None, WhitenedTable]:
        """As :meth:`of`, a piece of work between two yields; the axes hold ``jumps`` (n_meas, j)
        as well."""
        full, table = whiten.matrix, solver.table
        direct, timed = full @ table.basis.T, full @ (times[:, None] * table.basis.T)
        yield
        axes = _axes(direct @ table.typical, least=1)
        yield
        others = np.hstack([timed @ table.typical, full @ jumps])
        more = _axes(_less(others, axes), least=0)
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


def _less(columns: FloatArray, axes: FloatArray) -> FloatArray:
    return np.asarray(columns - axes @ (axes.T @ columns))


class Solver(Protocol):
    """The arithmetic of a fit by a table."""

    @property
    def table(self) -> ResponseTable:
        """What one spot does."""
        ...

    def keep(
        self, direct: FloatArray, timed: FloatArray, matrix: FloatArray, squares: FloatArray
    ) -> Any:
        """What it keeps of a :class:`WhitenedTable`; ``direct`` (narrow, rank)."""
        ...

    def expanded(self, spots: FloatArray) -> FloatArray:
        """See :meth:`ResponseTable.expanded`."""
        ...

    def settled(
        self,
        problem: Problem,
        spots: FloatArray,
        deficit: Deficit,
        most: int,
        known: Known = (),
    ) -> Fit:
        """The minimum of the cost near ``spots`` (k, 4), after at most so many steps; nobody
        ``known``: all are newcomers.

        What is unknown of the spots is taken as it is at the first ones, and anew where steps
        with that end.
        """
        ...

    def standing(self, left: FloatArray, fit: Fit) -> FloatArray:
        """(k,) square of what each spot of a fit changes that the slopes of the others could not
        take up, in noise with unknown directions ``left`` (q, c)."""
        ...

    def standing_out(
        self, signatures: FloatArray, squares: FloatArray, fit: Fit, limits: Limits
    ) -> tuple[FloatArray, FloatArray]:
        """See :meth:`tomoskin.sensing.fit.candidates.Matched.ratios`; of ``signatures``
        (n, narrow) with ``squares`` (n,)."""
        ...

    def judged(self, problem: Problem, fit: Fit, uneven: float) -> tuple[FloatArray, FloatArray]:
        """As :meth:`standing` in noise alone, and (4k, 4k) the covariance of all parameters.

        The covariance is the curvature's, scaled where the data scatter more than they should, and
        the part by which each measurement answers otherwise than the model's, ``uneven`` at the
        least: that is not fitted but considered (Schmidt 1966). How much it is, is what the
        residual has beyond noise, E[rᵀr] = degrees + u²‖(1 − JΣJᵀ)E‖², E the measurements'
        answers one by one.
        """
        ...

    def searched(self, question: Question, before: FloatArray) -> Answer | None:
        """What :class:`~tomoskin.sensing.fit.selection.ForwardSelection` finds, in one call.

        ``before`` (k, 4) are the touches of the last frame. None where this solver cannot do it at
        that pace.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A fit; the likelihood ratios (n,) and contents (n,) of candidates beside it, where these have
    been looked at; and one spot more where that was tried last, and not worth it."""

    fit: Fit
    others: tuple[FloatArray, FloatArray] | None
    turned_down: Fit | None


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
    """

    low: float
    high: float
    least: float
    useful: float


@dataclass(frozen=True, slots=True)
class Rules:
    """What counts as a touch.

    Attributes
    ----------
    least
        Likelihood ratio, in deviations, at which one begins.
    held
        Part of that at which one stays.
    sure
        Times that ratio from which no frame is explained better without the touch.
    misshapen
        Part of what touches change that a wrong profile may leave: no evidence of another one.
    within, near
        Radii within which there is no room for another one, and within which one may stand for
        what the profile does not say.
    """

    least: float
    held: float
    sure: float
    misshapen: float
    within: float
    near: float


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What is looked for in one frame.

    ``candidates`` are spots (n, 4) of content 1, their whitened signatures (n, narrow) and the
    squares (n,) of these; ``most`` touches are looked for; ``deficit``: what the table lacked of
    the last frame's.
    """

    problem: Problem
    candidates: tuple[FloatArray, FloatArray, FloatArray]
    limits: Limits
    rules: Rules
    pace: Pace
    most: int
    deficit: Deficit


@dataclass(frozen=True, eq=False)
class Problem:
    """Whitened data (c,) of one frame, and what they are explained with.

    ``response`` is the exact model, and ``reduced`` what stands for it where its error is small.
    ``rest`` is the square of what the data have along no axis of theirs.
    ``sign`` is "decrease", "increase" or "both". Standard deviations of what a touch does within a
    scan: its way along each axis, ``reach`` m, and what it ``grows`` by, in parts of it.
    ``left`` (q, c) are directions of residual responses, each as long as its deviation.
    ``expected`` are the touches of the frame before where they may have gone.
    """

    response: Response
    reduced: Reduced
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
        """Of all whitened data."""
        return float(self.data @ self.data) + self.rest

    @property
    def solver(self) -> Solver:
        """What fits spots."""
        return self.seen.solver

    def nothing(self) -> Fit:
        """The frame with no spot at all."""
        none = np.zeros((0, N_PARAMETERS))
        return self.solver.settled(self, none, Deficit.none(len(self.solver.table.basis)), 0)

    def refined(self, spots: FloatArray, deficit: Deficit, most: int, known: Known = ()) -> Fit:
        """See :meth:`Solver.settled`."""
        return self.solver.settled(self, spots, deficit, most, known)

    def corrected(self, fit: Fit, rounds: int, near: float, tolerance: float) -> Fit:
        """The fit with what the table lacks at its spots, so many rounds at most, and not where
        that is there for spots as ``near``.

        The exact model says what that is, or what stands for it to a ``tolerance`` as
        :class:`Pace` has it. A single faint spot is left as it is: what its table lacks is below
        the noise.
        """
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
        sizes = np.sqrt(np.einsum("kc,kc->k", fit.each, fit.each))
        alone, volts = self.reduced.lacking(fit.spots, sizes)
        change = self.solver.table.basis @ volts
        together = self.seen.direct @ change
        pairs = self.reduced.certificate.pair * math.sqrt(together @ together)
        return Deficit(fit.spots, change) if math.hypot(alone, pairs) < allowed else None

    def _exact(self, fit: Fit) -> Deficit:
        """The same by the exact model."""
        exact = self.solver.table.basis @ self.response.changes([fit.spots])[0]
        return Deficit(fit.spots, exact - fit.change)

    def evidence(self, fit: Fit) -> float:
        """See :meth:`Fit.log_evidence`."""
        return fit.log_evidence(self.prior, self.expected)

    def favours(self, one: Fit, other: Fit) -> bool:
        """Whether the frame speaks for one explanation against another, by odds of 200."""
        return self.evidence(one) - self.evidence(other) > _FAVOURS
