"""Touches chosen one after the other: a further one as long as the evidence for it grows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.candidates import Matched, limits_of
from tomoskin.sensing.fit.expectation import Known, less
from tomoskin.sensing.fit.openings import (
    MISSHAPEN,
    NEAR,
    WITHIN,
    Beside,
    Openings,
    Start,
    against,
    misshapen,
)
from tomoskin.sensing.fit.pace import Pace
from tomoskin.sensing.fit.refine import Deficit, Fit, Problem, Question, Rules
from tomoskin.sensing.track import HELD

_SURE = 2.0
"""Times the ratio at which a touch begins: half the square of that is more than what a simpler
explanation of the frame is worth."""

_FAINT = 0.7
"""Part of the ratio at which a touch begins that each spot keeps where the evidence decides: a
faint one may explain much."""

_FURTHER = 1.0
"""Evidence that a further spot needs beyond what a wrong profile of the others may give."""

_DETOUR = 1.5
"""Evidence that a spot may cost beside which one more is tried: the two may be worth it."""


@dataclass(frozen=True, eq=False)
class ForwardSelection:
    """Forward selection of the touches of one frame, with steps back where one is in the way.

    Attributes
    ----------
    problem
        The frame.
    matched
        Candidates for its noise.
    least
        Likelihood ratio, in deviations, at which a touch begins.
    most
        Touches that are looked for at most.
    pace
        How much is tried.
    deficit
        What the table lacked of the last frame's touches.
    """

    problem: Problem
    matched: Matched
    least: float
    most: int
    pace: Pace
    deficit: Deficit

    @property
    def question(self) -> Question:
        """The same for a solver that searches in one call."""
        matched = self.matched
        candidates = matched.spots, matched.signatures, matched.squares
        rules = Rules(self.least, HELD, _SURE, MISSHAPEN, WITHIN, NEAR)
        limits = limits_of(self.problem.sign)
        return Question(self.problem, candidates, limits, rules, self.pace, self.most, self.deficit)

    @cached_property
    def openings(self) -> Openings:
        """Where further touches may begin."""
        return Openings(Beside(self.problem, self.matched), self.least, self.pace)

    def found(self, before: FloatArray) -> Fit:
        """The fit of the touches, before the exact model is asked for the last time."""
        kept = self._pruned(self.again(before))
        tries = self.pace.tries - (len(before) - len(kept.spots) if len(kept.spots) else 0)
        fit, tried = self._more(kept, tries)
        if tries > tried == 0:
            fit = self._fewer(fit)
        if len(before) and _is_astray(self.pace, fit, before, in_vain=tried > 0 and fit is kept):
            fresh, _ = self._more(self.problem.nothing(), self.pace.tries)
            fit = max(fresh, fit, key=self.problem.evidence)
        return fit

    def again(self, before: FloatArray) -> Fit:
        """The fit of no touches but those ``before`` (k, 4)."""
        known = range(len(before)) if len(self.problem.expected.spots) else ()
        return self._refined(before, tuple(known))

    def _refined(self, before: FloatArray, known: Known) -> Fit:
        """The fit that begins with the touches ``before`` (k, 4)."""
        if not len(before):
            return self.problem.nothing()
        problem, spots = self.problem, before[: self.most]
        fit = problem.refined(spots, self.deficit, self.pace.warm, known[: self.most])
        return problem.corrected(fit, self.pace.rounds, self.pace.near, self.pace.tolerance)

    def _pruned(self, fit: Fit) -> Fit:
        """Without the spots that have faded."""
        while len(fit.spots):
            ratio = self.ratios(fit)
            weakest = int(ratio.argmin())
            if ratio[weakest] >= HELD * self.least:
                return fit
            fit = self._without(fit, weakest)
        return fit

    def _fewer(self, fit: Fit) -> Fit:
        """Without the weakest of several spots, where that explains the frame as well."""
        if len(fit.spots) < 2:
            return fit
        ratio = self.ratios(fit)
        weakest = int(ratio.argmin())
        if ratio[weakest] >= (1.0 if fit.settled else _SURE) * self.least:
            return fit
        return max(fit, self._without(fit, weakest), key=self.problem.evidence)

    def _without(self, fit: Fit, number: int) -> Fit:
        return self._refined(np.delete(fit.spots, number, axis=0), less(fit.known, number))

    def _more(self, fit: Fit, tries: int) -> tuple[Fit, int]:
        """With further spots, while they are worth it; and how many of ``tries`` were tried."""
        best = fit
        for tried in range(min(tries, self.most - len(fit.spots))):
            starts, joint = self.openings.of(fit)
            if not starts and not joint:
                return best, tried
            more, open_ = self._best(starts, fit.deficit, joint), self.openings.is_open(fit)
            least = self.openings.threshold(fit, _FAINT if open_ else 1.0)
            worth = self.ratios(more).min() >= least
            gain = self.problem.evidence(more) - self.problem.evidence(best)
            odds = self.pace.rare + against(fit, more)
            if open_:
                odds = _FURTHER + misshapen(fit) ** 2 / 2
            if worth and gain > odds:
                best = more
            elif not open_ or gain < -_DETOUR:
                self.turn_down(fit, more)
                return best, tried + 1
            fit = more
        return best, tries

    def proposed(self, fit: Fit) -> Fit | None:
        """One spot more than a ``fit`` has, whatever it is worth; None where nothing stands out."""
        if not 0 < len(fit.spots) < self.most:
            return None
        if self._turned_down and self._turned_down[-1][0] is fit:
            return self._turned_down[-1][1]
        starts = self.openings.from_this(fit)
        return self._best(starts, fit.deficit, []) if starts else None

    def turn_down(self, fit: Fit, more: Fit) -> None:
        """Keep what :meth:`proposed` would find beside ``fit``: ``more`` was not worth it."""
        self._turned_down.append((fit, more))

    @cached_property
    def _turned_down(self) -> list[tuple[Fit, Fit]]:
        """Fits, and one spot more beside each, the newest last."""
        return []

    def _best(self, starts: list[Start], deficit: Deficit, joint: list[FloatArray]) -> Fit:
        """The most evident of those that come out best after a glance."""
        problem, pace = self.problem, self.pace
        none = Deficit.none(len(deficit.change))
        fits = [problem.refined(start, deficit, pace.glance, known) for start, known in starts]
        fits += [problem.refined(start, none, pace.glance) for start in joint]
        fits.sort(key=lambda fit: fit.cost)
        settled = [
            fit if fit.settled else problem.refined(fit.spots, fit.deficit, pace.cold, fit.known)
            for fit in fits[: pace.finalists]
        ]
        exact = [problem.corrected(fit, pace.rounds, pace.near, pace.tolerance) for fit in settled]
        return max(exact, key=self.problem.evidence)

    def ratios(self, fit: Fit) -> FloatArray:
        """(k,) deviations of the noise and of residual responses by which each stands out."""
        return np.asarray(np.sqrt(self.problem.solver.standing(self.problem.left, fit)))


def _is_astray(pace: Pace, fit: Fit, before: FloatArray, *, in_vain: bool) -> bool:
    """Whether what was there may keep the frame from being understood: another touch stands out
    and does not fit ``in_vain``, or, at leisure, anything has changed."""
    if not pace.restart:
        return in_vain
    return len(fit.spots) != len(before) or not fit.settled
