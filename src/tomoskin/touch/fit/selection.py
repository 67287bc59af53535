"""Touches chosen one after the other: a further one as long as the evidence for it grows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.touch.fit.candidates import Matched, limits_of
from tomoskin.touch.fit.expectation import Known, less
from tomoskin.touch.fit.joint_starts import JointStarts
from tomoskin.touch.fit.pace import Pace
from tomoskin.touch.fit.refine import Deficit, Fit, Problem, Question, Rules
from tomoskin.touch.fit.spot import CONTENT, LOG_RADIUS

HELD = 0.6
"""Part of the ratio at which a touch begins above which one that is there stays."""

_MISSHAPEN = 0.02
"""A wrong profile leaves up to this part of what a touch changes: no evidence of another one."""

_SURE = 2.0
"""Times the ratio at which a touch begins: half the square of that is more than what a simpler
explanation of the frame is worth."""

_TRUE = 0.25
"""Part of that ratio which a wrong profile may leave where evidence decides on further spots."""

_FAINT = 0.7
"""Part of that ratio by which each spot stands out then: a faint one may explain much."""

_ONE_SIGN = float(np.log(2))
"""Evidence of a spot that is not counted: the prior has contents of both signs."""

_DETOUR = 1.5
"""Evidence that a spot may cost beside which one more is tried: the two may be worth it."""

_WIDE = 1.2
"""Deviations of the prior by which a spot is so wide that it may be two."""

_LEFT = 1.0
"""Deviations of noise alone by which so much is left that a spot may be missing."""


Start = tuple[FloatArray, Known]
"""Spots (k, 4), and who they are."""


@dataclass(frozen=True, eq=False)
class Beside:
    """What stands out of a frame beside a fit. The last look is kept, since it takes long.

    Attributes
    ----------
    problem
        The frame.
    matched
        Candidates for its noise.
    """

    problem: Problem
    matched: Matched

    def remember(self, fit: Fit, ratios: tuple[FloatArray, FloatArray]) -> None:
        """Keep what :meth:`ratios` would compute of ``fit``."""
        self._looked_at.append((fit.residual, ratios))

    def ratios(self, fit: Fit) -> tuple[FloatArray, FloatArray]:
        """Likelihood ratios (n,) and contents (n,) of the candidates."""
        if not self._looked_at or self._looked_at[-1][0] is not fit.residual:
            self.remember(fit, self.matched.ratios(self.problem.solver, fit, self.problem.sign))
        return self._looked_at[-1][1]

    def best(self, fit: Fit, least: float) -> FloatArray | None:
        """(4,) the candidate that stands out most; None where that is less than ``least``."""
        ratio, content = self.ratios(fit)
        best = int(ratio.argmax())
        return None if ratio[best] < least else self.matched.spot(best, content)

    @cached_property
    def _looked_at(self) -> list[tuple[FloatArray, tuple[FloatArray, FloatArray]]]:
        """What candidates are to the residuals that have been looked at, the newest last."""
        return []


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
        rules = Rules(self.least, HELD, _SURE, _MISSHAPEN)
        limits = limits_of(self.problem.sign)
        return Question(self.problem, candidates, limits, rules, self.pace, self.most, self.deficit)

    @cached_property
    def beside(self) -> Beside:
        """What stands out beside what has been found."""
        return Beside(self.problem, self.matched)

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
            starts, joint = self._openings(fit)
            if not starts and not joint:
                return best, tried
            more, open_ = self._best(starts, fit.deficit, joint), self._is_open(fit)
            worth = self.ratios(more).min() >= self.threshold(fit, _FAINT if open_ else 1.0)
            gain = self.problem.evidence(more) - self.problem.evidence(best)
            if worth and gain > (-_ONE_SIGN if open_ else self.pace.rare):
                best = more
            elif not open_ or gain < -_DETOUR:
                self.turn_down(best, more)
                return best, tried + 1
            fit = more
        return best, tries

    def _openings(self, fit: Fit) -> tuple[list[Start], list[FloatArray]]:
        """Where a fit with one spot more may begin: from this one, and whatever it has."""
        look = self.pace.look if len(fit.spots) else HELD
        fresh = self.beside.best(fit, self.threshold(fit, look))
        if fresh is None and not (self._is_open(fit) and self._is_doubtful(fit)):
            return [], []
        starts = [] if fresh is None else _starts(fit, fresh)
        return starts, self._joint_starts(len(fit.spots) + 1)

    def _is_open(self, fit: Fit) -> bool:
        """Whether the evidence decides on further spots: where sets are tried, and a wrong profile
        leaves little of those that are there."""
        return bool(self.pace.joint) and len(fit.spots) > 1 and misshapen(fit) < _TRUE * self.least

    def _is_doubtful(self, fit: Fit) -> bool:
        """Whether several spots may stand where a fit has one, though nothing stands out beside."""
        widest = self.problem.prior.away(fit.spots)[:, LOG_RADIUS].max()
        left = (fit.misfit - fit.degrees) / np.sqrt(2 * fit.degrees)
        return bool(widest > _WIDE or left > _LEFT)

    def threshold(self, fit: Fit, part: float) -> float:
        """Deviations for that ``part`` of a touch; a wrong profile adds to the noise."""
        return part * self.least * float(np.hypot(1.0, misshapen(fit) / self.least))

    def proposed(self, fit: Fit) -> Fit | None:
        """One spot more than a ``fit`` has, whatever it is worth; None where nothing stands out."""
        if not 0 < len(fit.spots) < self.most:
            return None
        if self._turned_down and self._turned_down[-1][0] is fit:
            return self._turned_down[-1][1]
        fresh = self.beside.best(fit, self.threshold(fit, self.pace.look))
        return None if fresh is None else self._best(_starts(fit, fresh), fit.deficit, [])

    def turn_down(self, fit: Fit, more: Fit) -> None:
        """Keep what :meth:`proposed` would find beside ``fit``: ``more`` was not worth it."""
        self._turned_down.append((fit, more))

    @cached_property
    def _turned_down(self) -> list[tuple[Fit, Fit]]:
        """Fits, and one spot more beside each, the newest last."""
        return []

    def _joint_starts(self, count: int) -> list[FloatArray]:
        """Sets of so many spots whatever has been found."""
        if count < 2 or not self.pace.joint:
            return []
        return self._joint.sets(count, self.pace.joint)

    @cached_property
    def _joint(self) -> JointStarts:
        problem = self.problem
        return JointStarts.of(self.matched, problem.data, problem.prior, problem.sign)

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


def misshapen(fit: Fit) -> float:
    """Deviations that a wrong profile of the spots of a fit may leave."""
    return _MISSHAPEN * float(np.linalg.norm(fit.predicted))


def _is_astray(pace: Pace, fit: Fit, before: FloatArray, *, in_vain: bool) -> bool:
    """Whether what was there may keep the frame from being understood: another touch stands out
    and does not fit ``in_vain``, or, at leisure, anything has changed."""
    if not pace.restart:
        return in_vain
    return len(fit.spots) != len(before) or not fit.settled


def _starts(fit: Fit, fresh: FloatArray) -> list[Start]:
    """The new spot beside the others; or instead of half of the nearest."""
    starts = [(np.concatenate([fit.spots, fresh[None]]), (*fit.known, None))]
    if len(fit.spots):
        near = int(np.linalg.norm(fit.spots[:, :2] - fresh[:2], axis=1).argmin())
        away = fresh[:2] - fit.spots[near, :2]
        halves = np.tile(fit.spots[near], (2, 1))
        reach = 0.7 * np.exp(fit.spots[near, LOG_RADIUS]) / max(np.linalg.norm(away), 1e-9)
        halves[:, :2] += np.outer([-reach, reach], away)
        halves[:, CONTENT] /= 2
        halves[:, LOG_RADIUS] -= 0.3
        instead = np.concatenate([np.delete(fit.spots, near, axis=0), halves])
        starts.append((instead, (*less(fit.known, near), None, None)))
    return starts
