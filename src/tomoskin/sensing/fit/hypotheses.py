"""Explanations between which frames decide: one touch more, a jump of the common mode.

A frame alone often leaves it open whether two fingers press or three. Each frame is an independent
test between the two, once it is known where either has the touches (Wald 1945).

The common mode is what all voltages have in common, as a gain or a supply. As a rule it moves by
parts in 10⁴, which the covariance of the noise holds. Now and then it jumps by any amount.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit import policy as decisions
from tomoskin.sensing.fit.expectation import Expectation, newcomers
from tomoskin.sensing.fit.problem import Problem
from tomoskin.sensing.fit.selection import ForwardSelection, SpotDetections, judged
from tomoskin.sensing.fit.spot_fit import Fit

GoingOn = Callable[[SpotDetections], Expectation]
"""What is expected of the touches of one frame in the next."""


@dataclass(frozen=True, eq=False)
class Rival:
    """Touches that may explain the last frames, one more than were found in them.

    Attributes
    ----------
    detected
        In the newest frame.
    odds
        Logarithm of those for them against what was found.
    """

    detected: SpotDetections
    odds: float


@dataclass(frozen=True, slots=True)
class FrameHypothesis:
    """One explanation of a frame.

    Attributes
    ----------
    name
        What it says is there.
    evidence
        Logarithm of the probability of the data under it, up to a constant of the frame.
    ratios
        By how many deviations of the noise each of its touches stands out.
    is_taken
        Whether it is what the frame is held to show.
    """

    name: str
    evidence: float
    ratios: tuple[float, ...] = ()
    is_taken: bool = False


def weighed(problem: Problem, found: SpotDetections, rival: Rival | None) -> list[FrameHypothesis]:
    """The explanations of a frame that were compared last: nothing, what was found, and a rival
    that later frames may speak for."""
    count = len(found.fit.spots)
    weighed = [FrameHypothesis("nothing", problem.evidence(problem.nothing()), (), count == 0)]
    if count:
        ratios = tuple(float(ratio) for ratio in found.ratio)
        weighed.append(FrameHypothesis(_so_many(count), problem.evidence(found.fit), ratios, True))
    if rival is not None:
        name = f"{_so_many(count + 1)}, if frames go on to say so ({rival.odds:+.1f})"
        weighed.append(FrameHypothesis(name, problem.evidence(rival.detected.fit)))
    return weighed


def _so_many(count: int) -> str:
    return "1 touch" if count == 1 else f"{count} touches"


def challenged(
    selection: ForwardSelection, found: SpotDetections, rival: Rival | None, going_on: GoingOn
) -> tuple[SpotDetections, Rival | None]:
    """What explains a frame, if not what was ``found`` in it; and the rival in the next one.

    A rival wins as soon as the frames speak for it, where each of its touches stands out as one
    that stays does, at a place of its own. What a wrong profile of those that were found may leave
    is no evidence: it would say the same in every frame.
    """
    policy = selection.policy
    goes_on = None not in found.fit.known  # so that the rival does too
    if rival and goes_on and len(rival.detected.fit.spots) == len(found.fit.spots) + 1:
        fit, gain = _followed(selection, found.fit, rival, going_on)
        odds = rival.odds + gain - policy.against(found.fit, fit)
    else:
        proposed, gain = _proposed(selection, found.fit)
        if proposed is None or not decisions.begins_rival(gain):
            return found, None
        fit, odds = proposed, gain - policy.against(found.fit, proposed) - policy.pace.rare
    if decisions.drops_rival(odds):
        return found, None
    fit = replace(fit, known=newcomers(len(fit.spots)))  # of what was found
    detected = judged(selection, fit)
    if decisions.elects_rival(policy, found.fit, selection.ratios(fit).min(), odds):
        return detected, None
    return found, Rival(detected, odds)


def _followed(
    selection: ForwardSelection, found: Fit, rival: Rival, going_on: GoingOn
) -> tuple[Fit, float]:
    """The rival in a further frame, and the logarithm of the odds that this gives."""
    pace, before = selection.policy.pace, rival.detected.fit
    problem = replace(selection.problem, expected=going_on(rival.detected))
    known = tuple(range(len(problem.expected.spots)))
    fit = problem.refined(before.spots, before.deficit, pace.warm, known)
    fit = problem.corrected(fit, pace, pace.closing)
    return fit, problem.evidence(fit) - selection.problem.evidence(found)


def _proposed(selection: ForwardSelection, found: Fit) -> tuple[Fit | None, float]:
    """The best that has one spot more than was found, and what it is worth."""
    best, most = None, -math.inf
    for fit in (selection.proposed(found), _beside_expected(selection, found)):
        evidence = -math.inf if fit is None else selection.problem.evidence(fit)
        if evidence > most:
            best, most = fit, evidence
    return best, most - selection.problem.evidence(found) if best else most


def _beside_expected(selection: ForwardSelection, found: Fit) -> Fit | None:
    """One spot beside those that are expected, where these may have left their places in vain."""
    expected = selection.problem.expected
    goes_on = len(found.spots) == len(expected.spots)
    if not goes_on or expected.away(found.spots, found.known) < decisions.ELSEWHERE:
        return None
    known = tuple(range(len(expected.spots)))
    return selection.proposed(
        selection.problem.refined(expected.spots, selection.deficit, 0, known)
    )


_FAINT = 0.3
"""Deviations of the noise below which it does not matter where the common mode has moved."""

_STEPS = 4
"""Towards touches as they would be, were the common mode unknown."""

Explained = tuple[SpotDetections, Rival | None]


@dataclass(frozen=True, eq=False)
class Jumps:
    """What whitened data are changed by where a common mode jumps.

    Attributes
    ----------
    rows
        (j, c), each as long as the deviation of the jump.
    left
        (k, c) residual responses, each as long as its deviation: what they may be is no jump.
    """

    rows: FloatArray
    left: FloatArray
    _walked: dict[int | None, FloatArray] = field(default_factory=dict, init=False)
    """What :meth:`wandered` has said, by steps of the root of two."""
    _kept: list[Jumps] = field(default_factory=list, init=False)
    """The jumps that :meth:`beside` gave last."""

    def beside(self, left: FloatArray) -> Jumps:
        """The same where these residual responses (k, c) are. The last is kept: they stay, as a
        rule."""
        kept = self._kept
        if not kept or kept[0].left is not left:
            kept[:] = [replace(self, left=left)]
        return kept[0]

    def wandered(self, part: float) -> FloatArray:
        """(k, c): what data are changed by where the first has moved by so many of its deviations;
        none where that is far below the noise. In steps, so that it is the same for some time."""
        shows = len(self.rows) and part * self._size > _FAINT
        step = math.ceil(2 * math.log2(part)) if shows else None
        if step not in self._walked:
            size = 0.0 if step is None else math.sqrt(2.0**step)
            self._walked[step] = size * self.rows[: step is not None]
        return self._walked[step]

    def along(self, residual: FloatArray) -> tuple[float, float]:
        """Deviations of the noise that a residual (c,) has along the jumps, with the sign of the
        first; and what that is in deviations of the first jump."""
        onto = self._weighed @ residual
        parts = self._inverse @ onto
        size = float(parts[0])
        return math.copysign(math.sqrt(max(float(onto @ parts), 0.0)), size), size

    def free(self, usual: Problem) -> Problem:
        """A frame in which nothing is known of the common modes."""
        return replace(usual, left=np.concatenate([usual.left, self.rows]))

    def louder(self, times: float) -> Jumps:
        """The same in so many times the noise's variance."""
        return Jumps(self.rows / math.sqrt(times), self.left)

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(self.rows[0]))

    @cached_property
    def _weighed(self) -> FloatArray:
        """(j, c) rows by the inverse of the covariance that the residual responses make."""
        left = self.left
        if not len(left):
            return self.rows
        sizes = np.linalg.solve(np.eye(len(left)) + left @ left.T, left @ self.rows.T)
        return np.asarray(self.rows - sizes.T @ left)

    @cached_property
    def _inverse(self) -> FloatArray:
        """(j, j) covariance of the jumps in one frame: with their own, so where no row shows one it
        is 0."""
        return np.asarray(np.linalg.inv(self._weighed @ self.rows.T + np.eye(len(self.rows))))


@dataclass(frozen=True, slots=True)
class CommonModeJump:
    """Whether the common mode has jumped since the skin was idle: a test over frames (Wald 1945).

    Attributes
    ----------
    odds
        Logarithm of those for touches without a jump, as long as frames leave it open.
    proven
        So many touches are there, whatever the common mode has done.
    rest
        Deviations along a jump that these leave: a wrong profile does so in every frame.
    jumped
        Whether it has: then nothing is known of it.
    size
        What it has jumped by, in deviations of a jump.
    """

    odds: float = -decisions.SUDDEN
    proven: int = 0
    rest: float = 0.0
    jumped: bool = False
    size: float = 0.0

    def decided(
        self,
        usual: Problem,
        jumps: Jumps,
        policy: decisions.DetectionPolicy,
        explain: Callable[[Problem], Explained],
    ) -> tuple[Explained, CommonModeJump]:
        """What explains a frame, ``usual`` or with ``jumps``."""
        if not len(jumps.rows):
            return explain(usual), self
        jumps = jumps.beside(usual.left)
        if self.jumped:
            explained = explain(jumps.free(usual))
            return explained, self._after_jump(jumps, explained[0].fit, policy)
        explained = explain(usual)
        fit = explained[0].fit
        count, (rest, _) = len(fit.spots), jumps.along(fit.residual)
        if self._is_clear(usual, fit, rest, jumps, policy):
            return explained, CommonModeJump(proven=count, rest=rest) if count else _NONE
        other = explain(jumps.free(usual))
        beside, size = jumps.along(other[0].fit.residual)
        if decisions.is_no_jump(policy, beside, other[0].fit):
            return explained, CommonModeJump(proven=count, rest=rest)
        gain = usual.gain(other[0].fit, fit)
        odds = self.odds + float(np.clip(gain, -2 * decisions.SURE, 2 * decisions.SURE))
        if odds > 0:
            proven = count if odds > decisions.SURE else min(self.proven, count)
            return explained, CommonModeJump(odds, proven, rest)
        return other, CommonModeJump(odds, jumped=odds < -decisions.SURE, size=size)

    def _is_clear(
        self, usual: Problem, fit: Fit, rest: float, jumps: Jumps, policy: decisions.DetectionPolicy
    ) -> bool:
        """Whether no jump explains the frame as the touches of a ``fit`` do, which leave ``rest``
        deviations along it: as much as before, and they stand out whatever the jump."""
        if decisions.may_have_jumped(policy, abs(rest - self.rest), fit):
            return False
        if len(fit.spots) <= self.proven:
            return True
        free = jumps.free(usual)
        again = free.refined(fit.spots, fit.deficit, _STEPS, fit.known)
        return bool(free.solver.standing(free.left, again).min() > policy.least**2)

    def _after_jump(
        self, jumps: Jumps, fit: Fit, policy: decisions.DetectionPolicy
    ) -> CommonModeJump:
        """After a further frame: over where the common mode is as it was, and nothing touches."""
        rest, size = jumps.along(fit.residual)
        if decisions.is_no_jump(policy, rest) and not len(fit.spots):
            return _NONE
        return replace(self, size=max(self.size, size, key=abs))


_NONE = CommonModeJump()
