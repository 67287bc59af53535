"""What a frame is explained with, where the sheet may be deformed, and what it says of that."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.hypotheses import CommonModeJump, Rival
from tomoskin.sensing.fit.problem import Matched, Problem, WhitenedTable
from tomoskin.sensing.fit.selection import SpotDetections
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS
from tomoskin.sensing.fit.spot_model import SpotModel
from tomoskin.sensing.fit.strain_fit import Explained, likeliest
from tomoskin.sensing.fit.strain_state import StrainState

_PLACE, _SWELLS = 5e-3, 0.2
"""How far a touch may move from one frame to the next along each axis, m, and by what its radius's
logarithm may grow, beside a deformation that begins."""


class Searched(NamedTuple):
    """What explains a frame where the sheet is so."""

    detected: SpotDetections
    rival: Rival | None
    jump: CommonModeJump
    matched: Matched
    problem: Problem
    state: StrainState | None

    @property
    def evidence(self) -> float:
        """Its logarithm, but for what all explanations have in common."""
        return self.problem.evidence(self.detected.fit)


Search = Callable[[StrainState | None], Searched]
"""The touches of a frame on a sheet that is so."""


@dataclass(frozen=True, eq=False)
class FrameData:
    """A frame, and how it is seen.

    Attributes
    ----------
    data
        (n_meas,) V.
    seen
        The table that its touches are fitted by.
    model
        Of touches.
    before
        (k, 4) touches of the last frame.
    """

    data: FloatArray
    seen: WhitenedTable
    model: SpotModel
    before: FloatArray

    @property
    def count(self) -> int:
        """How many touches there were."""
        return len(self.before)

    @cached_property
    def _expanded(self) -> FloatArray:
        """(k, m, n_meas) V: what each touch of the last frame did, and its slopes."""
        solver = self.model.solver
        return np.asarray(solver.expanded(self.before) @ solver.table.basis)

    @cached_property
    def untouched(self) -> FloatArray:
        """(n_meas,) V without what the touches of the last frame did."""
        return np.asarray(self.data - self._expanded[:, 0].sum(axis=0))

    @property
    def alone(self) -> FrameData:
        """The frame as if nothing had touched in the last."""
        return replace(self, before=self.before[:0])

    def fitted(self, begin: StrainState) -> Explained:
        """A deformation that explains the frame beside these touches; see :func:`likeliest`."""
        return likeliest(begin, self.untouched, self.seen.full, self.others)

    @cached_property
    def others(self) -> FloatArray:
        """(q, r) what these may do otherwise in this frame, whitened, a deviation each."""
        prior = self.model.prior
        size = [_PLACE, _PLACE, _SWELLS, prior.content, prior.directed, prior.reshaped]
        rows = np.array(size)[:, None] * self._expanded[:, 1:]
        return np.asarray(rows.reshape(-1, len(self.data)) @ self.seen.full.T)


def told_by(found: Searched) -> StrainState | None:
    """What a frame says of the deformation that it is explained with."""
    state, fit = found.state, found.detected.fit
    if state is None:
        return None
    d, left = len(state.mean), found.problem.left
    if not len(fit.spots) and len(fit.unknown) == len(left):
        return state.told_alone(fit.residual, left).linear_again(found.problem.seen.matrix)
    others = np.vstack([fit.unknown[d:], _free(found)])
    told = state.told(fit.residual, fit.unknown[:d], others)
    return told.linear_again(found.problem.seen.matrix)


def _free(found: Searched) -> FloatArray:
    """(4k, c) what the numbers of the touches may be, by what is expected of them, each deviation.

    The content of a touch is not expected: the prior says how large it may be.
    """
    fit, prior, expected = found.detected.fit, found.problem.prior, found.problem.expected
    rows = [np.zeros((0, len(fit.residual)))]
    for k, number in enumerate(fit.known or (None,) * len(fit.spots)):
        own = np.diag(1.0 / prior.weights)
        if number is not None:
            own[:CONTENT, :CONTENT] = np.linalg.cholesky(expected.covariances[number])
        rows.append(own.T @ fit.slopes[N_PARAMETERS * k : N_PARAMETERS * (k + 1)])
    return np.vstack(rows)


def odds_against(found: Searched, frame: FrameData) -> float:
    """Logarithm of the odds against so many touches' beginning."""
    more = max(len(found.detected.fit.spots) - frame.count, 0)
    return more * math.log(200)
