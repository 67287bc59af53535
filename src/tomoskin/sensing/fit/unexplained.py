"""What of the frames touches do not explain: more noise, a press that has been lifted."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.fit import policy as decisions
from tomoskin.sensing.fit.excess import Channels, Excess, Gauge
from tomoskin.sensing.fit.problem import Matched, Problem, Solver
from tomoskin.sensing.fit.spot import CONTENT
from tomoskin.sensing.fit.spot_fit import Fit


class FrameWatch:
    """Looks at one frame after the other; those of a finder.

    Parameters
    ----------
    pattern
        Of the rows.
    policy
        By what it is decided.

    Attributes
    ----------
    channels
        What may turn noisy by itself.
    excess
        Noise beyond what was learnt.
    like_touch
        Whether the newest frame is such as a touch makes, one that presses or one that has been
        lifted, though it may be too faint to be found: it is no noise to be learnt.
    rises
        Whether the newest frames show a change of the sign that touches do not have.
    """

    def __init__(self, pattern: Pattern, policy: decisions.DetectionPolicy) -> None:
        self.channels = Channels.of(pattern)
        self.excess = Excess.none(self.channels)
        self.like_touch = self.rises = False
        self._policy = policy
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
        policy = self._policy
        if policy.sign == "both" or self._lifted is not None:
            return "both"
        if len(self._before) or not decisions.may_be_lifted(
            policy, problem.square, len(problem.seen.full)
        ):
            return policy.sign
        ratio, content = matched.ratios(problem.solver, problem.nothing(), "both")
        best = int(ratio.argmax())
        return "both" if decisions.lifted(policy, ratio[best], content[best]) else policy.sign

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
        if not decisions.leaves_much(self._policy, fit):
            return False
        self._astray = True
        if not self._in_vain and problem.reach:  # as a rule it is a touch that began in the scan
            return False
        return decisions.looks_again(self._in_vain)

    def unexplained(self, solver: Solver, fit: Fit, matched: Matched) -> float:
        """Variance of what is left of a frame before which there was no touch for long.

        1 where it is not beyond chance, or where further touches may still be found in it.
        """
        if not decisions.may_be_noise(fit, self._age):
            return 1.0
        ratio, _ = matched.ratios(solver, fit, self._policy.sign)
        goes_on = len(fit.spots) > len(self._before) and decisions.may_be_found(fit, ratio.max())
        return 1.0 if goes_on else fit.misfit / fit.degrees

    def end(self, solver: Solver, fit: Fit, matched: Matched, times: float) -> None:
        """Take what a frame was explained with, in so many times the noise that was known."""
        self._before, self._times = fit.spots, times
        self._in_vain, self._astray = self._in_vain + 1 if self._astray else 0, False
        self._age = self._age + 1 if len(fit.spots) else 0
        self._lifted = None
        if len(fit.spots) and (wrong := self._policy.is_wrong(fit.spots[:, CONTENT])).any():
            spots = fit.spots[wrong]
            self._lifted = spots[np.abs(spots[:, CONTENT]).argmax(), :2]
        self._raised = 0 if self._lifted is None else self._raised + 1
        self.rises = decisions.stands_as_rise(self._raised)
        self.like_touch = bool(len(fit.spots))
        if fit.beyond > 0 and not self.like_touch:
            ratio, _ = matched.ratios(solver, fit, "both")
            self.like_touch = decisions.is_like_touch(self._policy, fit, ratio.max())

    @property
    def lifted_problem(self) -> str | None:
        """That a press seems to have been on the skin when the reference was taken, or None."""
        if self._lifted is None:
            return None
        x, y = 1e3 * self._lifted
        return (
            f"the conductivity has risen near {x:.0f}, {y:.0f} mm: if a press was on the skin "
            "when the reference was taken, take a new one while nothing touches"
        )

    @property
    def noise_problem(self) -> str | None:
        """What of the newest frame is more than the noise of the idle skin, or None."""
        if len(self._before):  # what they do not explain is their model's as a rule
            return None
        return self.excess.text(self.channels, self._usual, self._times)
