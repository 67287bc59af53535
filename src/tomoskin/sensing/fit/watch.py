"""What of the frames touches do not explain: more noise, a press that has been lifted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.fit.candidates import Matched
from tomoskin.sensing.fit.excess import Channels, Excess, Gauge
from tomoskin.sensing.fit.refine import Fit, Problem, Solver
from tomoskin.sensing.fit.search import SpotDetections
from tomoskin.sensing.fit.spot import CONTENT

_EXPLAINS = 0.3
"""Part of what is beyond noise: a candidate that explains as much may be a touch not yet found."""

_YOUNG = 3
"""Frames of a touch in which what it does not explain is held for noise; later it is the error of
its model."""

_STANDS = 600
"""Frames for which a change of the sign that touches do not have is no part of the idle skin."""

_CHANCE = 6.0
"""Deviations by which the squares of a residual must be too many to be more noise."""

_LIFTED = 1.0
"""A press has been lifted, or the sheet been raised, where a change of the sign that touches do not
have stands out by so many thresholds."""

_CLEAR = 1.5
"""Thresholds by which such a change stands out beside touches."""

_ASTRAY = 1.0
"""Squares of the threshold from which what touches leave of a frame is looked at for it."""

_LOOKS = 4
"""Frames in a row that are looked at so; later those whose number is a power of two."""

_REMAINS = 0.5
"""Part of what touches of the skin's sign leave beyond noise that may still be left with both."""

_SIGNS = {"decrease": -1.0, "increase": 1.0, "both": 0.0}


class FrameWatch:
    """Looks at one frame after the other; those of a finder.

    Parameters
    ----------
    pattern
        Of the rows.
    sign, least
        Of the skin's touches, and deviations at which one begins.

    Attributes
    ----------
    channels
        What may turn noisy by itself.
    excess
        Noise beyond what was learnt.
    like_touch
        Whether the newest frame is such as a touch makes, one that presses or one that has been
        lifted, though it may be too faint to be found: it is no noise to be learnt.
    """

    def __init__(self, pattern: Pattern, sign: str, least: float) -> None:
        self.channels = Channels.of(pattern)
        self.excess = Excess.none(self.channels)
        self.like_touch = False
        self._sign, self._least = sign, least
        self._usual = np.full(len(self.channels.names), np.inf)
        self._last: FloatArray | None = None
        self._lifted: FloatArray | None = None
        self._raised = 0
        self._before = np.zeros((0, 4))
        self._age, self._times = 0, 1.0
        self._in_vain, self._astray = 0, False

    def go_on(self, other: FrameWatch) -> None:
        """Count a change of the other sign from where an ``other`` watch has begun to."""
        self._raised = other._raised

    def begin(self, data: FloatArray, gauge: Gauge) -> None:
        """Take the data (n_meas,) of a frame: what no touch can do to them is noise."""
        if not self.excess.any:
            self._usual = gauge.variance
        moved = data if self._last is None else data - self._last
        self._last = data
        self.excess = self.excess.after(gauge.squares(data, moved), gauge)

    def sign(self, problem: Problem, matched: Matched) -> str:
        """Of the touches that are looked for in a frame.

        The skin's; "both" where a press has been lifted that was there when the reference was
        taken, or all round it there would seem to be touches.
        """
        if self._sign == "both" or self.wrong(self._before).any():
            return "both"
        rows = len(problem.seen.full)
        if len(self._before) or problem.square < rows + self._least**2:
            return self._sign
        ratio, content = matched.ratios(problem.solver, problem.nothing(), "both")
        best = int(ratio.argmax())
        away = self._is_wrong(content[best])
        return "both" if away and ratio[best] > _LIFTED * self._least else self._sign

    def puzzled(self, problem: Problem, fit: Fit) -> bool:
        """Whether touches leave so much of a frame unexplained that some of it may be of the sign
        that they do not have: then there would seem to be touches all round.

        Several that begin in one frame may be such. Where frame after frame is so, the second to
        fourth are looked at, and ever fewer later.
        """
        if problem.sign == "both" or not len(fit.spots):
            return False
        if len(fit.spots) > len(self._before) + 1:
            return True
        if fit.misfit - fit.degrees < _ASTRAY * self._least**2:
            return False
        self._astray = True
        seen = self._in_vain
        if not seen and problem.reach:  # as a rule it is a touch that began within the scan
            return False
        return seen < _LOOKS or seen.bit_count() == 1

    def turns(self, both: SpotDetections, fit: Fit) -> bool:
        """Whether touches of ``both`` signs explain what those of a ``fit`` leave: some clearly are
        not of the skin's sign, and little is left then. Where much is, more touches come."""
        wrong = self.wrong(both.fit.spots)
        clear = bool((both.ratio[wrong] > _CLEAR * self._least).any())
        left = both.fit.misfit - both.fit.degrees
        return clear and left < _REMAINS * (fit.misfit - fit.degrees)

    def unexplained(self, solver: Solver, fit: Fit, matched: Matched) -> float:
        """Variance of what is left of a frame before which there was no touch for long.

        1 where it is not beyond chance, or where further touches may still be found in it.
        """
        variance = fit.misfit / fit.degrees
        if self._age >= _YOUNG or variance < 1 + _CHANCE * math.sqrt(2 / fit.degrees):
            return 1.0
        ratio, _ = matched.ratios(solver, fit, self._sign)
        goes_on = ratio.max() ** 2 > _EXPLAINS * (fit.misfit - fit.degrees)
        return 1.0 if len(fit.spots) > len(self._before) and goes_on else variance

    def end(self, solver: Solver, fit: Fit, matched: Matched, times: float) -> None:
        """Take what a frame was explained with, in so many times the noise that was known."""
        self._before, self._times = fit.spots, times
        self._in_vain, self._astray = self._in_vain + 1 if self._astray else 0, False
        self._age = self._age + 1 if len(fit.spots) else 0
        wrong, self._lifted = self.wrong(fit.spots), None
        if wrong.any():
            spots = fit.spots[wrong]
            self._lifted = spots[np.abs(spots[:, CONTENT]).argmax(), :2]
        self._raised = 0 if self._lifted is None else self._raised + 1
        self.like_touch = bool(len(fit.spots))
        beyond = fit.misfit - fit.degrees
        if beyond > 0 and not self.like_touch:
            ratio, _ = matched.ratios(solver, fit, "both")
            self.like_touch = bool(ratio.max() ** 2 > max(self._least**2, _EXPLAINS * beyond))

    def wrong(self, spots: FloatArray) -> NDArray[np.bool_]:
        """(k,) whether each of ``spots`` (k, 4) is not of the skin's sign."""
        return np.asarray(self._is_wrong(spots[:, CONTENT]))

    def _is_wrong(self, content: FloatArray) -> NDArray[np.bool_]:
        return np.asarray(content * _SIGNS[self._sign] < 0)

    @property
    def rises(self) -> bool:
        """Whether the newest frames show a change of the sign that touches do not have.

        Not where it stands for long: a faint press may have become part of the reference.
        """
        return _YOUNG <= self._raised < _STANDS

    @property
    def problem(self) -> str | None:
        """What of the newest frame no touch explains, in a sentence, or None."""
        if self._lifted is not None:
            x, y = 1e3 * self._lifted
            return (
                f"the conductivity has risen near {x:.0f}, {y:.0f} mm: if a press was on the skin "
                "when the reference was taken, take a new one while nothing touches"
            )
        if len(self._before):  # what they do not explain is their model's as a rule
            return None
        louder = max(self.excess.level, self._times)
        return replace(self.excess, level=louder).text(self.channels, self._usual)
