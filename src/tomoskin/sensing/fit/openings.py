"""Where a further touch may begin in a frame, beside those that have been found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.candidates import Matched
from tomoskin.sensing.fit.expectation import Known, less
from tomoskin.sensing.fit.joint_starts import JointStarts
from tomoskin.sensing.fit.pace import Pace
from tomoskin.sensing.fit.refine import Fit, Problem
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS
from tomoskin.sensing.track import HELD

MISSHAPEN = 0.04
"""A wrong profile leaves up to this part of what a touch changes: no evidence of another one."""

WITHIN, NEAR = 0.5, 1.5
"""Radii of a touch within which there is no room for another one, since together they are one of
another profile; and within which one may stand for what the profile does not say."""

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
class Openings:
    """Where one spot more may begin.

    Attributes
    ----------
    beside
        What stands out beside what has been found.
    least
        Likelihood ratio, in deviations, at which a touch begins.
    pace
        How much is tried.
    """

    beside: Beside
    least: float
    pace: Pace

    def of(self, fit: Fit) -> tuple[list[Start], list[FloatArray]]:
        """For a fit with one spot more: from this one, and sets whatever it has."""
        starts = self.from_this(fit)
        if not starts and not (self.is_open(fit) and self._is_doubtful(fit)):
            return [], []
        count = len(fit.spots) + 1
        if count < 2 or not self.pace.joint:
            return starts, []
        return starts, self._joint.sets(count, self.pace.joint)

    def from_this(self, fit: Fit) -> list[Start]:
        """Beside the spots of ``fit``, where something stands out."""
        look = self.pace.look if len(fit.spots) else HELD
        fresh = self.beside.best(fit, self.threshold(fit, look))
        return [] if fresh is None else _starts(fit, fresh)

    def is_open(self, fit: Fit) -> bool:
        """Whether the evidence decides on further spots: where sets are tried."""
        return bool(self.pace.joint) and len(fit.spots) > 0

    def threshold(self, fit: Fit, part: float) -> float:
        """Deviations for that ``part`` of a touch; a wrong profile adds to the noise."""
        return part * self.least * float(np.hypot(1.0, misshapen(fit) / self.least))

    def _is_doubtful(self, fit: Fit) -> bool:
        """Whether several spots may stand where a fit has one, though nothing stands out beside."""
        widest = self.beside.problem.prior.away(fit.spots)[:, LOG_RADIUS].max()
        left = (fit.misfit - fit.degrees) / np.sqrt(2 * fit.degrees)
        return bool(widest > _WIDE or left > _LEFT)

    @cached_property
    def _joint(self) -> JointStarts:
        problem = self.beside.problem
        return JointStarts.of(self.beside.matched, problem.data, problem.prior, problem.sign)


def misshapen(fit: Fit) -> float:
    """Deviations that a wrong profile of the spots of a fit may leave."""
    return MISSHAPEN * float(np.linalg.norm(fit.predicted))


def against(found: Fit, more: Fit) -> float:
    """Logarithm of the odds that a wrong profile of what was ``found`` may give to a fit with one
    spot more: infinite where two are at one place."""
    apart = np.linalg.norm(more.spots[:, None, :2] - more.spots[:, :2], axis=2)
    apart[np.diag_indices_from(apart)] = np.inf
    least = float((apart / np.exp(more.spots[:, LOG_RADIUS])).min())
    if least < WITHIN:
        return np.inf
    return misshapen(found) ** 2 / 2 if least < NEAR else 0.0


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
