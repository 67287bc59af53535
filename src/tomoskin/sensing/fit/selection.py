"""Touches chosen one after the other, a further one as long as the evidence for it grows; and how
sure each of them is."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, reach
from tomoskin.sensing.fit.candidates import JointStarts
from tomoskin.sensing.fit.expectation import Known, less
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.problem import Matched, Problem
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS
from tomoskin.sensing.fit.spot_fit import Deficit, Fit

Start = tuple[FloatArray, Known]
"""Spots (k, 4), and who they are."""

Ratios = tuple[FloatArray, FloatArray]
"""Likelihood ratios (n,) and contents (n,) of candidates."""


@dataclass(frozen=True, eq=False)
class Openings:
    """Where one spot more may begin in a frame.

    Attributes
    ----------
    problem, matched, policy
        See :class:`ForwardSelection`.
    """

    problem: Problem
    matched: Matched
    policy: DetectionPolicy
    _candidates: list[tuple[FloatArray, tuple[FloatArray, FloatArray]]] = field(
        default_factory=list, init=False
    )
    """What candidates are to the residuals that have been looked at, the newest last."""

    def starts(self, fit: Fit) -> list[Start]:
        """One spot more beside those of ``fit``, where a candidate stands out."""
        ratio, content = self.candidates(fit)
        best = int(ratio.argmax())
        if ratio[best] < self.policy.look(fit):
            return []
        return _starts(fit, self.matched.spot(best, content))

    def sets(self, fit: Fit) -> list[FloatArray]:
        """Sets of one spot more than ``fit`` has, wherever that has them."""
        if not self.policy.weighs_sets(fit):
            return []
        widest = self.problem.prior.widest(fit.spots)
        if not (self.starts(fit) or self.policy.may_be_several(fit, widest)):
            return []
        return self._joint.sets(len(fit.spots) + 1, self.policy.pace.joint)

    @cached_property
    def _joint(self) -> JointStarts:
        problem = self.problem
        return JointStarts.of(self.matched, problem.data, problem.prior, problem.sign)

    def candidates(self, fit: Fit) -> Ratios:
        """Of the candidates beside a ``fit``. The last look is kept, since it takes long."""
        if not self._candidates or self._candidates[-1][0] is not fit.residual:
            self.remember(fit, self.matched.ratios(self.problem.solver, fit, self.problem.sign))
        return self._candidates[-1][1]

    def remember(self, fit: Fit, ratios: Ratios) -> None:
        """Keep what :meth:`candidates` would compute of ``fit``."""
        self._candidates.append((fit.residual, ratios))


@dataclass(frozen=True, eq=False)
class ForwardSelection:
    """Forward selection of the touches of one frame, with steps back where one is in the way.

    The native engine does the same in one call where no exact model is asked for meanwhile.

    Attributes
    ----------
    problem
        The frame.
    matched
        Candidates for its noise.
    policy
        By what it is decided.
    deficit
        What the table lacked of the last frame's touches.
    """

    problem: Problem
    matched: Matched
    policy: DetectionPolicy
    deficit: Deficit
    _turned_down: list[tuple[Fit, Fit]] = field(default_factory=list, init=False)
    """Fits, and one spot more beside each that was not worth it, the newest last."""

    def explained(self, before: FloatArray) -> Fit:
        """The most likely touches, confirmed by the exact model; ``before`` (k, 4) are those of the
        last frame."""
        search = self.problem.solver.searched
        answer = search and search(self.problem, self.matched, self.policy, self.deficit, before)
        fit = self.step_by_step(before) if answer is None else answer.fit
        if answer and answer.others:
            self.openings.remember(fit, answer.others)
        if answer and answer.turned_down:
            self._turned_down.append((fit, answer.turned_down))
        return self._confirmed(fit, before)

    def _confirmed(self, fit: Fit, before: FloatArray) -> Fit:
        """A fit by the exact model. Where touches begin beside others: with or without these, since
        a further one may be what the table lacks of those."""
        pace, problem = self.policy.pace, self.problem
        exact = problem.corrected(fit, pace, pace.closing)
        if not pace.closing or len(fit.spots) < 2 or len(fit.spots) <= len(before):
            return exact
        other = problem.corrected(self._again(before), pace, pace.closing)
        return exact if self._accepts(other, exact) else other

    def step_by_step(self, before: FloatArray) -> Fit:
        """The fit of the touches, before the exact model is asked for the last time."""
        kept = self._pruned(self._again(before))
        most = self.policy.pace.tries
        tries = most - (len(before) - len(kept.spots) if len(kept.spots) else 0)
        fit, tried = self._more(kept, tries)
        if tries > tried == 0:
            fit = self._fewer(fit)
        in_vain = tried > 0 and fit is kept
        if len(before) and self.policy.is_astray(fit, before, in_vain=in_vain):
            fresh, _ = self._more(self.problem.nothing(), most)
            fit = max(fresh, fit, key=self.problem.evidence)
        return fit

    def _again(self, before: FloatArray) -> Fit:
        """The fit of no touches but those ``before`` (k, 4)."""
        known = range(len(before)) if len(self.problem.expected.spots) else ()
        return self._refined(before, tuple(known))

    def _refined(self, before: FloatArray, known: Known) -> Fit:
        """The fit that begins with the touches ``before`` (k, 4)."""
        if not len(before):
            return self.problem.nothing()
        pace, most = self.policy.pace, self.policy.most
        fit = self.problem.refined(before[:most], self.deficit, pace.warm, known[:most])
        return self.problem.corrected(fit, pace, pace.rounds)

    def _pruned(self, fit: Fit) -> Fit:
        """Without the spots that have faded."""
        while len(fit.spots):
            ratio = self.ratios(fit)
            weakest = int(ratio.argmin())
            if self.policy.stays(ratio[weakest]):
                return fit
            fit = self._without(fit, weakest)
        return fit

    def _fewer(self, fit: Fit) -> Fit:
        """Without the weakest of several spots, where that explains the frame as well."""
        if len(fit.spots) < 2:
            return fit
        ratio = self.ratios(fit)
        weakest = int(ratio.argmin())
        if self.policy.is_needed(fit, ratio[weakest]):
            return fit
        return max(fit, self._without(fit, weakest), key=self.problem.evidence)

    def _without(self, fit: Fit, number: int) -> Fit:
        return self._refined(np.delete(fit.spots, number, axis=0), less(fit.known, number))

    def _more(self, fit: Fit, tries: int) -> tuple[Fit, int]:
        """With further spots, while they are worth it; and how many of ``tries`` were tried."""
        best = fit
        for tried in range(min(tries, self.policy.most - len(fit.spots))):
            starts, sets = self.openings.starts(fit), self.openings.sets(fit)
            if not starts and not sets:
                return best, tried
            more = self._best(starts, fit.deficit, sets)
            if self._accepts(fit, more, best):
                best = more
            elif not self.policy.goes_on(fit, self.problem.gain(best, more)):
                self._turned_down.append((fit, more))
                return best, tried + 1
            fit = more
        return best, tries

    def _accepts(self, fit: Fit, more: Fit, best: Fit | None = None) -> bool:
        """Whether one spot ``more`` than a ``fit`` has is worth it beside the ``best`` so far."""
        gain = self.problem.gain(best or fit, more)
        return self.policy.accepts(fit, more, self.ratios(more).min(), gain)

    def proposed(self, fit: Fit) -> Fit | None:
        """One spot more than a ``fit`` has, whatever it is worth; None where nothing stands out."""
        if not 0 < len(fit.spots) < self.policy.most:
            return None
        if self._turned_down and self._turned_down[-1][0] is fit:
            return self._turned_down[-1][1]
        starts = self.openings.starts(fit)
        return self._best(starts, fit.deficit, []) if starts else None

    def _best(self, starts: list[Start], deficit: Deficit, sets: list[FloatArray]) -> Fit:
        """The most evident of those that come out best after a glance."""
        problem, pace = self.problem, self.policy.pace
        none = Deficit.none(len(deficit.change))
        fits = [problem.refined(start, deficit, pace.glance, known) for start, known in starts]
        fits += [problem.refined(start, none, pace.glance) for start in sets]
        fits.sort(key=lambda fit: fit.cost)
        settled = [
            fit if fit.settled else problem.refined(fit.spots, fit.deficit, pace.cold, fit.known)
            for fit in fits[: pace.finalists]
        ]
        return max((problem.corrected(f, pace, pace.rounds) for f in settled), key=problem.evidence)

    @cached_property
    def openings(self) -> Openings:
        """Where further touches may begin."""
        return Openings(self.problem, self.matched, self.policy)

    def ratios(self, fit: Fit) -> FloatArray:
        """(k,) deviations of the noise and of residual responses by which each stands out."""
        return np.asarray(np.sqrt(self.problem.solver.standing(self.problem.left, fit)))


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
    fresh
        (k,) the same out of noise and residual responses: what a new touch needs.
    covariance
        (4k, 4k), noise and a wrong profile together.
    noise
        (4k, 4k), the part of that which differs from frame to frame.
    close
        (k,) bool: another touch so near cannot be ruled out.
    beside
        (k,) deviations that a wrong profile of the others may leave.
    """

    fit: Fit
    ratio: FloatArray
    fresh: FloatArray
    covariance: FloatArray
    noise: FloatArray
    close: NDArray[np.bool_]
    beside: FloatArray


def judged(selection: ForwardSelection, fit: Fit) -> SpotDetections:
    """How sure each touch of a fit is."""
    if not len(fit.spots):
        none = np.zeros(0)
        nothing = np.zeros((0, 0))
        return SpotDetections(fit, none, none, nothing, nothing, none.astype(bool), none)
    reach("covariances")
    problem = selection.problem
    squares, covariance = problem.solver.judged(problem, fit, _UNEVEN)
    ratio = np.sqrt(squares)
    fresh = selection.ratios(fit) if len(problem.left) else ratio
    close, beside = _close(selection, fit), selection.policy.beside(fit)
    return SpotDetections(fit, ratio, fresh, covariance, fit.noise, close, beside)


def _close(selection: ForwardSelection, fit: Fit) -> NDArray[np.bool_]:
    """Where a candidate within a radius of a spot stands out nearly enough."""
    ratio, _ = selection.openings.candidates(fit)
    doubtful = selection.matched.spots[ratio > selection.policy.close(fit), :2]
    if not len(doubtful):
        return np.zeros(len(fit.spots), dtype=bool)
    apart = np.linalg.norm(fit.spots[:, None, :2] - doubtful, axis=2).min(axis=1)
    return np.asarray(apart < 2 * np.exp(fit.spots[:, LOG_RADIUS]))
