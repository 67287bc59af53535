"""Touches, or a jump of the common mode: which of the two explains a frame.

The common mode is what all voltages have in common, as a gain or a supply. As a rule it moves by
parts in 10⁴, which the covariance of the noise holds. Now and then it jumps by any amount.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.detections import SpotDetections
from tomoskin.sensing.fit.policy import SUDDEN, SURE, DetectionPolicy
from tomoskin.sensing.fit.problem import Problem
from tomoskin.sensing.fit.rival import Rival
from tomoskin.sensing.fit.spot_fit import Fit

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
    def _responses(self) -> FloatArray:
        """(k, c) from a residual to the likeliest sizes of the residual responses."""
        inner = np.eye(len(self.left)) + self.left @ self.left.T
        return np.asarray(np.linalg.solve(inner, self.left))

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(self.rows[0]))

    @cached_property
    def _walked(self) -> dict[int | None, FloatArray]:
        """What :meth:`wandered` has said, by steps of the root of two."""
        return {}

    @cached_property
    def _kept(self) -> list[Jumps]:
        """The last of :meth:`beside`."""
        return []

    @cached_property
    def _weighed(self) -> FloatArray:
        """(j, c) rows by the inverse of the covariance that the residual responses make."""
        return self.rows - (self.rows @ self._responses.T) @ self.left

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

    odds: float = -SUDDEN
    proven: int = 0
    rest: float = 0.0
    jumped: bool = False
    size: float = 0.0

    def decided(
        self,
        usual: Problem,
        jumps: Jumps,
        policy: DetectionPolicy,
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
        if policy.is_no_jump(beside, other[0].fit):
            return explained, CommonModeJump(proven=count, rest=rest)
        gain = usual.gain(other[0].fit, fit)
        odds = self.odds + float(np.clip(gain, -2 * SURE, 2 * SURE))
        if odds > 0:
            proven = count if odds > SURE else min(self.proven, count)
            return explained, CommonModeJump(odds, proven, rest)
        return other, CommonModeJump(odds, jumped=odds < -SURE, size=size)

    def _is_clear(
        self, usual: Problem, fit: Fit, rest: float, jumps: Jumps, policy: DetectionPolicy
    ) -> bool:
        """Whether no jump explains the frame as the touches of a ``fit`` do, which leave ``rest``
        deviations along it: as much as before, and they stand out whatever the jump."""
        if policy.may_have_jumped(abs(rest - self.rest), fit):
            return False
        if len(fit.spots) <= self.proven:
            return True
        free = jumps.free(usual)
        again = free.refined(fit.spots, fit.deficit, _STEPS, fit.known)
        return bool(free.solver.standing(free.left, again).min() > policy.least**2)

    def _after_jump(self, jumps: Jumps, fit: Fit, policy: DetectionPolicy) -> CommonModeJump:
        """After a further frame: over where the common mode is as it was, and nothing touches."""
        rest, size = jumps.along(fit.residual)
        if policy.is_no_jump(rest) and not len(fit.spots):
            return _NONE
        return replace(self, size=max(self.size, size, key=abs))


_NONE = CommonModeJump()
