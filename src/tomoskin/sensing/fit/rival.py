"""One touch more than was found: what frames say for it is summed until it is clear.

A frame alone often leaves it open whether two fingers press or three. Each frame is an independent
test between the two, once it is known where either has the touches (Wald 1945).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from tomoskin.sensing.fit.detections import SpotDetections, judged
from tomoskin.sensing.fit.expectation import Expectation, newcomers
from tomoskin.sensing.fit.policy import ELSEWHERE
from tomoskin.sensing.fit.selection import ForwardSelection
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


def challenged(
    selection: ForwardSelection, found: SpotDetections, rival: Rival | None, going_on: GoingOn
) -> tuple[SpotDetections, Rival | None]:
    """What explains a frame, if not what was ``found`` in it; and the rival in the next one.

    A rival wins as soon as the frames speak for it, where each of its touches stands out as one
    that stays does, at a place of its own. What a wrong profile of those that were found may leave
    is no evidence: it would say the same in every frame.
    """
    policy = selection.policy
    if rival is not None and _is_beside(rival, found.fit):
        fit, gain = _followed(selection, found.fit, rival, going_on)
        odds = rival.odds + gain - policy.against(found.fit, fit)
    else:
        proposed, gain = _proposed(selection, found.fit)
        if proposed is None or not policy.begins_rival(gain):
            return found, None
        fit, odds = proposed, gain - policy.against(found.fit, proposed) - policy.pace.rare
    if policy.drops_rival(odds):
        return found, None
    fit = replace(fit, known=newcomers(len(fit.spots)))  # of what was found
    detected = judged(selection, fit)
    if policy.elects_rival(found.fit, selection.ratios(fit).min(), odds):
        return detected, None
    return found, Rival(detected, odds)


def _is_beside(rival: Rival, found: Fit) -> bool:
    """Whether what was found goes on, so that the rival does too."""
    return None not in found.known and len(rival.detected.fit.spots) == len(found.spots) + 1


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
    away = expected.away(found.spots, found.known)
    if len(found.spots) != len(expected.spots) or away < ELSEWHERE:
        return None
    known = tuple(range(len(expected.spots)))
    return selection.proposed(
        selection.problem.refined(expected.spots, selection.deficit, 0, known)
    )
