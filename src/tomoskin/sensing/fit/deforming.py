"""A deformation of the sheet and touches on it compete for each frame.

A frame is explained by touches alone, by a deformation, or by both; the likeliest explanation
counts (evidence: MacKay 2003, chapter 28). A deformation goes on from frame to frame, as touches
do. Where a frame is as the last one, only that is fitted; otherwise it is asked whether the sheet
deforms, or deforms otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tomoskin.core import FloatArray, reach
from tomoskin.sensing.fit import policy as decisions
from tomoskin.sensing.fit.deformation import Deformation, StrainLaw
from tomoskin.sensing.fit.deformed_frame import (
    FrameData,
    Search,
    Searched,
    odds_against,
    told_by,
)
from tomoskin.sensing.fit.spot import Response
from tomoskin.sensing.fit.strain import Strain
from tomoskin.sensing.fit.strain_fit import Explained, starts
from tomoskin.sensing.fit.strain_state import StrainState
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

_BEGINS, _MOVES, _CHANGES = 6.0, 2.0, 4.0
"""Logarithms of the odds against a deformation's beginning in a frame, its moving, and its being
another one than was told."""

_ALONE = 5.0
"""Logarithm of the odds that a frame must give for it that is looked at as the only one."""

_LEAVES = 30.0
"""Squares beyond noise that an explanation leaves, from which others are asked for."""

_FAINT = 4.0
"""Squared deviations by which a deformation must show, or it is over."""

_STRANGE, _USUAL = 9.5, 6.5
"""Squared deviations of what a deformation has otherwise than its numbers say, over the root of the
number of measurements: from the first it is no fold and no stretch, below the second it is one
again. One fold makes up to 5 in these units, two make 10 to 20: the benchmark's quick seeds."""

_WRONG, _TIMES = 5.0, 3
"""Times as many squares as noise has, and frames in a row that leave so much: then no model of a
deformation holds."""

_QUIET = 5
"""Frames in which it does not show, after which it is over."""

_BEGUN, _MOST = 2.0, 12
"""Logarithm of the odds from which a deformation has begun, and frames in which it must."""

_RESIDUAL = 0.15
"""Part of the largest deformation that the sheet may keep when it is over: that is none."""

_OTHER = 0.2
"""By which part of itself a strain may differ from one that touches are fitted on."""

_STEPS = 3
"""Frames of a deformation that moves, after which it is asked whether it still does."""

_STARTS = 2
"""Folds that are looked at, the best of the table."""


class Begun(NamedTuple):
    """A deformation that may have begun, instead of touches: as the newest frame has it, the
    logarithm of the odds for it, and frames since."""

    state: StrainState | None
    odds: float
    frames: int


class Deforming:
    """How the sheet is deformed, frame after frame.

    Parameters
    ----------
    sheet
        At rest.
    law
        How it answers strain.
    policy
        By what touches are decided on. Frames that do not follow each other are looked at each as
        the only one, and presses alone not at all.

    Attributes
    ----------
    state
        What is known of its strain; None where it is at rest.
    told
        How it is deformed, as that is reported; None where it is not. What a deformation has left
        behind is not.
    """

    def __init__(
        self, sheet: StrainedSheet, law: StrainLaw, policy: decisions.DetectionPolicy
    ) -> None:
        self.sheet, self._law, self._policy = sheet, law, policy
        self._follows = policy.pace.speed > 0
        self._looks = self._follows or policy.pace.joint > 0
        self._rival: Begun | None = None
        self.state: StrainState | None = None
        self.told: Deformation | None = None
        self._wrong = self._strange = 0
        self._moves, self._quiet, self._asked, self._vain = False, 0, 0.0, 0
        self._age, self._count, self._steps = 0, 0, 0
        self._review: list[tuple[Strain, bool]] = []
        self._made: tuple[Strain, Response] | None = None

    def decided(self, frame: FrameData, search: Search) -> Searched:
        """What explains a frame: touches, a deformation, or both."""
        if not self._looks:
            return search(None)
        if not self._follows:
            self.state, self._moves = None, False
        reach("deformation")
        now = self.state and self.state.after(moves=False)
        if self._moves and self.state is not None:
            quick = self._moved(frame, search, self.state)
            if quick is not None:
                return quick
        first = search(now)
        asks = self._rival or self._asks(first, frame)
        if not asks:
            self._moves = False
            return self._reviewed(frame, search, first)
        score = self._score(first, frame)
        best, gain = self._best(frame, search, first, score)
        if self.state is None and self._follows:
            return self._begun(first, best, gain)
        wins = gain > (0.0 if self._follows else _ALONE)
        self._moves = wins and best.state is not None
        self._vain = 0 if wins else self._vain + 1
        return best if wins else first

    def _best(
        self, frame: FrameData, search: Search, first: Searched, score: float
    ) -> tuple[Searched, float]:
        """The likeliest other explanation of a frame, and the logarithm of the odds for it."""
        begins, least = self.state is None, first.detected.fit
        if begins:  # touches of another profile leave as much
            score += self._policy.left_by(least) ** 2 / 2
        best, most = first, -math.inf
        for found, odds in self._others(frame, first):
            other = search(found.state)
            own = self._score(other, frame) - odds - score
            if begins:  # fewer unknowns are no explanation of what several touches explain
                own -= max(other.detected.fit.beyond - least.beyond, 0.0) / 2
            if own > most:
                best, most = other, own
        return best, most

    def _begun(self, first: Searched, best: Searched, gain: float) -> Searched:
        """Whether a deformation has begun: a test over frames (Wald 1945).

        One frame is not enough: a touch that comes down within a scan may look so, once.
        """
        odds = float(np.clip(gain, -decisions.SURE, decisions.SURE))
        if self._rival is None:
            self._vain = 0 if odds > 0 else self._vain + 1
            self._rival = Begun(told_by(best), odds, 1) if odds > 0 else None
            return first
        odds, frames = self._rival.odds + odds, self._rival.frames + 1
        if odds > _BEGUN:
            self._rival, self._moves, self._vain = None, True, 0
            return best
        goes_on = odds > -decisions.SURE and frames < _MOST
        self._rival = Begun(told_by(best), odds, frames) if goes_on else None
        return first

    def _moved(self, frame: FrameData, search: Search, state: StrainState) -> Searched | None:
        """The explanation by a deformation that moves on, where that is enough.

        Now and then one that stands is tried too: it may have come to rest.
        """
        found = frame.fitted(state.after(moves=True))
        moved = search(found.state)
        if self._asks(moved, frame, quick=True):
            return None
        self._steps += 1
        if self._steps % _STEPS == 0:
            stands = search(state.after(moves=False))
            if not self._asks(stands, frame):
                self._moves, moved = False, stands
        return self._reviewed(frame, search, moved)

    def _asks(self, found: Searched, frame: FrameData, *, quick: bool = False) -> bool:
        """Whether other explanations than one are asked for: touches begin, or much is left."""
        fit = found.detected.fit
        left = fit.beyond
        if self._strange:  # ever later: much is left in each frame
            return self._strange.bit_count() == 1
        if len(fit.spots) > frame.count:
            return True
        if left < max(_LEAVES, fit.degrees):
            self._vain = 0
            return False
        return quick or decisions.looks_again(self._vain) or left > 2.0 * self._asked

    def _reviewed(self, frame: FrameData, search: Search, first: Searched) -> Searched:
        """The explanation of a frame that is as the last one, or a likelier one.

        It is asked whether the sheet is deformed otherwise than was told: ever later after that,
        or the number of touches, has changed; in each frame of one other deformation.
        """
        if self.state is None or frame.count != self._count:
            self._age, self._count, self._review = 0, frame.count, []
            return first
        self._age += 1
        if self._age > 1 and self._age.bit_count() == 1 and not self._review:
            self._review = [(Strain.none("stretch"), False), *self._folds(frame)]
            return first
        if not self._review:
            return first
        strain, alone = self._review.pop()
        # both as if nothing had been known before: what is told has had many frames to fit
        usual = self._anew(frame, search, self.state.strain)
        other = self._anew(frame.alone if alone else frame, search, strain)
        if self._score(other, frame) - _CHANGES < self._score(usual, frame):
            return first
        self._review = []
        return other

    def _anew(self, frame: FrameData, search: Search, strain: Strain) -> Searched:
        """A frame with a strain that is sought from there on."""
        size = self.state.size if self.state else 0.0
        return search(frame.fitted(StrainState.about(self.sheet, strain, size)).state)

    def _folds(self, frame: FrameData) -> list[tuple[Strain, bool]]:
        """Folds that a review looks at, the likeliest last, and whether without the touches."""
        with_touches = starts(self.sheet, frame.untouched, frame.seen.full, frame.others, _STARTS)
        folds = [(strain, False) for strain in reversed(with_touches)]
        if frame.count:
            seen = frame.alone
            first = starts(self.sheet, seen.untouched, seen.seen.full, seen.others, 1)
            folds = [(first[0], True), *folds]
        return folds

    @staticmethod
    def _score(found: Searched, frame: FrameData) -> float:
        return found.evidence - odds_against(found, frame)

    def _others(self, frame: FrameData, first: Searched) -> list[tuple[Explained, float]]:
        """Deformations that may explain a frame beside the touches of the last, or without these;
        and the odds against them."""
        self._asked = first.detected.fit.beyond
        chosen = self._likeliest(frame)[:2]
        if frame.count:
            chosen += self._likeliest(frame.alone)[:1]
        return chosen

    def _likeliest(self, frame: FrameData) -> list[tuple[Explained, float]]:
        """Deformations that may explain a frame, the likeliest first; and the odds against."""
        found: list[tuple[Explained, float]] = []
        size, odds = 0.0, _BEGINS
        if self._rival is not None and self._rival.state is not None:
            found.append((frame.fitted(self._rival.state.after(moves=True)), 0.0))
        if self.state is not None:
            found.append((frame.fitted(self.state.after(moves=True)), _MOVES))
            size, odds = self.state.size, _CHANGES
        for strain in self._starts(frame):
            begin = StrainState.about(self.sheet, strain, size)
            found.append((frame.fitted(begin), odds))
        return sorted(found, key=lambda one: one[1] - one[0].evidence)

    def _starts(self, frame: FrameData) -> list[Strain]:
        full, others = frame.seen.full, frame.others
        folds = starts(self.sheet, frame.untouched, full, others, _STARTS)
        return [*folds, Strain.none("stretch")]

    def touched(self, state: StrainState, sets: Sequence[FloatArray]) -> FloatArray:
        """(b, n_meas) V that sets of spots (k, 4) change on the sheet as it is in a ``state``.

        That sheet is made again where the strain has moved by a part of it.
        """
        strain, made = state.at, self._made
        if made is None or made[0].away(strain) > _OTHER * strain.size:
            made = self._made = strain, self.sheet.response(strain)
        return made[1].changes(sets)

    @property
    def moved(self) -> FloatArray | float:
        """(n_meas,) V that the deformation has moved the voltages by."""
        return 0.0 if self.state is None else self.state.moved

    def go_on(self, other: Deforming) -> None:
        """Go on where an ``other`` is, on another sheet."""
        state = other.state
        if state is not None:
            self.state = state if other.sheet is self.sheet else state.on(self.sheet)
        self.told = other.told

    def take(self, found: Searched) -> None:
        """Take what a frame was explained with."""
        self.state = self._remains(told_by(found), found)
        self.told = None if self.state is None else self._report(self.state, found)

    def _remains(self, state: StrainState | None, found: Searched) -> StrainState | None:
        """The state of a frame, or None where the deformation is over."""
        if state is None:
            self._strange = 0
            return None
        shown = found.problem.seen.matrix @ state.moved
        self._quiet = self._quiet + 1 if shown @ shown < _FAINT else 0
        over = self._quiet >= _QUIET and not len(found.detected.fit.spots)
        return None if over else state

    def _report(self, state: StrainState, found: Searched) -> Deformation | None:
        if state.strain.size < _RESIDUAL * state.size:
            return None
        otherwise, fit = state.mean[len(state.at.numbers) :], found.detected.fit
        self._wrong = self._wrong + 1 if fit.beyond > _WRONG * fit.degrees else 0
        most = _USUAL if self._strange else _STRANGE
        most *= math.sqrt(len(state.change))
        strange = otherwise @ otherwise > most or self._wrong >= _TIMES or state.strain.is_beyond
        self._strange = self._strange + 1 if strange else 0
        return Deformation.of(state, self._law) if not self._strange else Deformation.unknown()

    @property
    def hides_touches(self) -> bool:
        """Whether what seems to touch may be what no model of a deformation holds."""
        return self.told is not None and self.told.kind == "unknown"
