"""How many touches a frame holds: one more as long as the evidence for it grows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.touch.fit.candidates import Matched, limits_of
from tomoskin.touch.fit.joint_starts import JointStarts
from tomoskin.touch.fit.pace import Pace
from tomoskin.touch.fit.refine import Deficit, Fit, Problem, Question, Rules
from tomoskin.touch.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS

HELD = 0.6
"""Part of the ratio at which a touch begins above which one that is there stays."""

_DOUBTFUL = 0.8
"""Part of that ratio from which another touch beside one is not ruled out."""

_MISSHAPEN = 0.02
"""A wrong profile leaves up to this part of what a touch changes: no evidence of another one."""

_SURE = 2.0
"""Times the ratio at which a touch begins: half the square of that is more than what a simpler
explanation of the frame is worth."""

_UNEVEN = 0.08
"""Part by which each row answers a touch otherwise than the model's, at the least: a sheet is
uneven, contacts and gains differ. A standard deviation, chosen on the twin's seeds 1 to 3."""


@dataclass(frozen=True, eq=False)
class SpotDetections:
    """What explains a frame, and how sure each touch is.

    Attributes
    ----------
    fit
        The most likely spots.
    ratio
        (k,) deviations by which each stands out of the noise, the others given.
    covariance
        (4k, 4k), noise and a wrong profile together.
    close
        (k,) bool: another touch so near cannot be ruled out.
    """

    fit: Fit
    ratio: FloatArray
    covariance: FloatArray
    close: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Search:
    """Looks for touches in one frame.

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

    def __call__(self, before: FloatArray) -> SpotDetections:
        """Touches of the frame; ``before`` (k, 4) are those of the last one."""
        answer = self.problem.solver.searched(self.question, before)
        fit = self.found(before) if answer is None else answer.fit
        if answer and answer.others:
            self._matches.append((fit.residual, answer.others))
        return self._judged(self._confirmed(fit, before))

    def _confirmed(self, fit: Fit, before: FloatArray) -> Fit:
        """A fit by the exact model. Where touches begin beside others: with or without these, since
        a further one may be what the table lacks of those."""
        pace, problem = self.pace, self.problem
        exact = problem.corrected(fit, pace.closing, pace.near, pace.tolerance)
        if not pace.closing or len(fit.spots) < 2 or len(fit.spots) <= len(before):
            return exact
        other = problem.corrected(self._started(before), pace.closing, pace.near, pace.tolerance)
        worth = self._ratios(exact).min() >= self._threshold(other, 1.0)
        gain = problem.evidence(exact) - problem.evidence(other)
        return exact if worth and gain > pace.rare else other

    @property
    def question(self) -> Question:
        """What a solver is asked that searches in one call."""
        matched = self.matched
        candidates = matched.spots, matched.signatures, matched.squares
        rules = Rules(self.least, HELD, _SURE, _MISSHAPEN)
        limits = limits_of(self.problem.sign)
        return Question(self.problem, candidates, limits, rules, self.pace, self.most, self.deficit)

    def found(self, before: FloatArray) -> Fit:
        """The fit of the touches, before the exact model is asked for the last time."""
        kept = self._pruned(self._started(before))
        tries = self.pace.tries - (len(before) - len(kept.spots) if len(kept.spots) else 0)
        fit, tried = self._more(kept, tries)
        if tries > tried == 0:
            fit = self._fewer(fit)
        if len(before) and self._is_astray(fit, before, in_vain=tried > 0 and fit is kept):
            fresh, _ = self._more(self.problem.nothing(), self.pace.tries)
            fit = max(fresh, fit, key=self.problem.evidence)
        return fit

    def _is_astray(self, fit: Fit, before: FloatArray, *, in_vain: bool) -> bool:
        """Whether what was there may keep the frame from being understood: another touch stands
        out and does not fit ``in_vain``, or, at leisure, anything has changed."""
        if not self.pace.restart:
            return in_vain
        return len(fit.spots) != len(before) or not fit.settled

    def _started(self, before: FloatArray) -> Fit:
        if not len(before):
            return self.problem.nothing()
        problem, spots = self.problem, before[: self.most]
        fit = problem.refined(spots, self.deficit, self.pace.warm)
        return problem.corrected(fit, self.pace.rounds, self.pace.near, self.pace.tolerance)

    def _pruned(self, fit: Fit) -> Fit:
        """Without the spots that have faded."""
        while len(fit.spots):
            ratio = self._ratios(fit)
            weakest = int(ratio.argmin())
            if ratio[weakest] >= HELD * self.least:
                return fit
            fit = self._started(np.delete(fit.spots, weakest, axis=0))
        return fit

    def _fewer(self, fit: Fit) -> Fit:
        """Without the weakest of several spots, where that explains the frame as well."""
        if len(fit.spots) < 2:
            return fit
        ratio = self._ratios(fit)
        weakest = int(ratio.argmin())
        if ratio[weakest] >= (1.0 if fit.settled else _SURE) * self.least:
            return fit
        return max(
            fit, self._started(np.delete(fit.spots, weakest, axis=0)), key=self.problem.evidence
        )

    def _more(self, fit: Fit, tries: int) -> tuple[Fit, int]:
        """With further spots, while they are worth it; and how many of ``tries`` were tried."""
        for tried in range(min(tries, self.most - len(fit.spots))):
            ratio, content = self._standing_out(fit)
            best = int(ratio.argmax())
            if ratio[best] < self._threshold(fit, self.pace.look if len(fit.spots) else HELD):
                return fit, tried
            fresh = _starts(fit, self.matched.spot(best, content))
            more = self._best(fresh, fit.deficit, self._joint_starts(len(fit.spots) + 1))
            worth = self._ratios(more).min() >= self._threshold(fit, 1.0)
            gain = self.problem.evidence(more) - self.problem.evidence(fit)
            if not worth or gain <= self.pace.rare:
                return fit, tried + 1
            fit = more
        return fit, tries

    def _threshold(self, fit: Fit, part: float) -> float:
        """What a wrong profile may leave adds to the noise."""
        misshapen = _MISSHAPEN * float(np.linalg.norm(fit.predicted))
        return part * self.least * float(np.hypot(1.0, misshapen / self.least))

    def _standing_out(self, fit: Fit) -> tuple[FloatArray, FloatArray]:
        if not self._matches or self._matches[-1][0] is not fit.residual:
            ratios = self.matched.ratios(self.problem.solver, fit, self.problem.sign)
            self._matches.append((fit.residual, ratios))
        return self._matches[-1][1]

    @cached_property
    def _matches(self) -> list[tuple[FloatArray, tuple[FloatArray, FloatArray]]]:
        """What candidates are to the residuals that have been looked at, the newest last."""
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

    def _best(self, starts: list[FloatArray], deficit: Deficit, joint: list[FloatArray]) -> Fit:
        """The most evident of those that come out best after a glance."""
        problem, pace = self.problem, self.pace
        none = Deficit.none(len(deficit.change))
        fits = [problem.refined(start, deficit, pace.glance) for start in starts]
        fits += [problem.refined(start, none, pace.glance) for start in joint]
        fits.sort(key=lambda fit: fit.cost)
        settled = [
            fit if fit.settled else problem.refined(fit.spots, fit.deficit, pace.cold)
            for fit in fits[: pace.finalists]
        ]
        exact = [problem.corrected(fit, pace.rounds, pace.near, pace.tolerance) for fit in settled]
        return max(exact, key=self.problem.evidence)

    def _ratios(self, fit: Fit) -> FloatArray:
        """(k,) deviations of the noise and of residual responses by which each stands out."""
        return np.asarray(np.sqrt(self.problem.solver.standing(self.problem.left, fit)))

    def _judged(self, fit: Fit) -> SpotDetections:
        k = len(fit.spots)
        if not k:
            none = np.zeros(0)
            return SpotDetections(fit, none, np.zeros((0, 0)), none.astype(bool))
        squares, covariance = self.problem.solver.judged(self.problem, fit, _UNEVEN)
        return SpotDetections(fit, np.sqrt(squares), covariance, self._close(fit))

    def _close(self, fit: Fit) -> NDArray[np.bool_]:
        """Where a candidate within a radius of a spot stands out nearly enough."""
        ratio, _ = self._standing_out(fit)
        doubtful = self.matched.spots[ratio > self._threshold(fit, _DOUBTFUL), :2]
        if not len(doubtful):
            return np.zeros(len(fit.spots), dtype=bool)
        apart = np.linalg.norm(fit.spots[:, None, :2] - doubtful, axis=2).min(axis=1)
        return np.asarray(apart < 2 * np.exp(fit.spots[:, LOG_RADIUS]))


def _starts(fit: Fit, fresh: FloatArray) -> list[FloatArray]:
    """The new spot beside the others; or instead of half of the nearest."""
    starts = [np.concatenate([fit.spots, fresh[None]])]
    if len(fit.spots):
        near = int(np.linalg.norm(fit.spots[:, :2] - fresh[:2], axis=1).argmin())
        away = fresh[:2] - fit.spots[near, :2]
        halves = np.tile(fit.spots[near], (2, 1))
        reach = 0.7 * np.exp(fit.spots[near, LOG_RADIUS]) / max(np.linalg.norm(away), 1e-9)
        halves[:, :2] += np.outer([-reach, reach], away)
        halves[:, CONTENT] /= 2
        halves[:, LOG_RADIUS] -= 0.3
        starts.append(np.concatenate([np.delete(fit.spots, near, axis=0), halves]))
    return starts


def joined(detected: SpotDetections) -> SpotDetections:
    """The same with each two touches as one whose positions are not distinct (2 deviations)."""
    spots, k = detected.fit.spots, len(detected.fit.spots)
    variance = np.diag(detected.covariance).reshape(k, N_PARAMETERS)[:, :2].sum(axis=1)
    for i in range(k):
        for j in range(i + 1, k):
            away = spots[i, :2] - spots[j, :2]
            if away @ away > 8 * (variance[i] + variance[j]):  # no direction has more than all
                continue
            pick = [4 * i, 4 * i + 1, 4 * j, 4 * j + 1]
            block = detected.covariance[np.ix_(pick, pick)]
            turn = np.concatenate([away, -away])
            if (away @ away) ** 2 < 4 * (turn @ block @ turn):
                return joined(_merged(detected, i, j))
    return detected


def _merged(detected: SpotDetections, i: int, j: int) -> SpotDetections:
    """Touches i and j as one, at the middle of their contents."""
    fit, keep = detected.fit, np.delete(np.arange(len(detected.fit.spots)), j)
    share = np.abs(fit.spots[[i, j], CONTENT])
    share = share / share.sum()
    one = fit.spots[i].copy()
    one[:2] = share @ fit.spots[[i, j], :2]
    one[LOG_RADIUS] = share @ fit.spots[[i, j], LOG_RADIUS]
    one[CONTENT] = fit.spots[[i, j], CONTENT].sum()
    spots = fit.spots.copy()
    spots[i] = one
    mix = np.eye(4 * len(fit.spots))
    for column, part in ((i, share[0]), (j, share[1])):
        mix[4 * i : 4 * i + 2, 4 * column : 4 * column + 2] = part * np.eye(2)
    rows = (4 * keep[:, None] + np.arange(N_PARAMETERS)).ravel()
    covariance = (mix @ detected.covariance @ mix.T)[np.ix_(rows, rows)]
    ratio = detected.ratio.copy()
    ratio[i] = np.hypot(*detected.ratio[[i, j]])
    close = detected.close.copy()
    close[i] = True
    return SpotDetections(replace(fit, spots=spots[keep]), ratio[keep], covariance, close[keep])
