"""What one frame says: what is looked at, what is accepted as a touch, and what else explains it.

The thresholds by which a frame's touches are looked for, accepted and kept stand here, with the
decisions that are taken by them; the other modules compute what is decided on. What a touch is
over frames, :mod:`tomoskin.sensing.track.policy` says.

Sizes are deviations of the noise, and a gain is a logarithm of odds: what the evidence of one
explanation has more than that of another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.skin import TouchSettings
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS
from tomoskin.sensing.fit.spot_fit import Fit
from tomoskin.sensing.track import HELD

MOST = 5
"""Touches at once: more have more parameters than 8 or 16 electrodes tell apart."""

# Evidence: does something stand out?

FAINTEST = 1.0
"""Deviations below which a candidate is none, whatever else could take it up."""

USEFUL = 0.02
"""Part of a candidate's square that the spots that are there must leave of it."""

_WIDE = 1.2
"""Deviations of the prior by which a spot is so wide that it may be two."""

_REMAINS = 1.0
"""Deviations of noise alone by which so much remains that a spot may be missing."""

# Explanation: is one touch more worth it?

_FAVOURS = math.log(200)
"""Logarithm of the odds from which one explanation is favoured."""

_FURTHER = 1.0
"""Evidence that a further spot needs where the evidence decides. Faint ones may explain much."""

_DETOUR = 1.5
"""Evidence that a spot may cost beside which one more is tried: the two may be worth it."""

_DOUBTFUL = 0.8
"""Part of the ratio at which a touch begins; above it, another touch beside one is possible."""

_DISTINCT = 4.0
"""Squared deviations from which two positions are those of two touches."""

# A rival: one touch more, that no frame alone shows.

_BORN = -4.0
"""Logarithm of the odds that one frame must give a rival, beginning apart."""

_DROPPED = -12.0
"""Logarithm of the odds below which it is given up."""

ELSEWHERE = 9.0
"""Squared deviations from where it is expected, beyond which a touch may have left its place to
explain another one that has begun."""

# Other explanations: a rise, noise.

_LIFTED = 1.0
"""A press has been lifted, or the sheet been raised, where a change of the sign that touches do not
have stands out by so many thresholds."""

_CLEAR = 1.5
"""Thresholds by which such a change stands out beside touches."""

_ASTRAY = 1.0
"""Squares of the threshold from which what touches leave of a frame is looked at for it."""

_LOOKS = 4
"""Frames in a row that are looked at so; later those whose number is a power of two."""

_HALF = 0.5
"""Part of what touches of the skin's sign leave beyond noise that may still remain with both."""

_YOUNG = 3
"""Frames of a touch in which what it does not explain is held for noise; later it is the error of
its model. And frames for which a rise must stand."""

_STANDS = 600
"""Frames for which a change of the sign that touches do not have is no part of the idle skin."""

_CHANCE = 6.0
"""Deviations by which the squares of a residual must be too many to be more noise."""

_EXPLAINS = 0.3
"""Part of what is beyond noise: a candidate that explains as much may be a touch not yet found."""

_SIGNS = {"decrease": -1.0, "increase": 1.0, "both": 0.0}

# Other explanations: a jump of the common mode (a test over frames: Wald 1945).

SUDDEN = 1.0
"""Logarithm of how much more often the common mode jumps than a touch begins."""

SURE = 8.0
"""Logarithm of the odds from which frames have decided between the two."""

_LEAVES = 5.0
"""Deviations that a frame leaves along a jump, from which the common mode may have jumped."""

_USUAL = 3.0
"""Deviations along a jump within which the common mode is where it is expected."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How much is tried in one frame: all there is to try, or what leaves time for the next one.

    Steps are those of Levenberg–Marquardt, by the table.

    Attributes
    ----------
    warm
        Steps from the touches of the frame before.
    glance, cold
        Steps from each of the positions where a new touch may begin, and then from the best one.
    finalists
        Of these positions, the best ones that are gone on with.
    rounds, closing
        Solves of the exact model, each with a few more steps: for each set of touches that is
        tried, and for what is accepted in the end.
    near
        Part of radius and content by which a touch may differ before the exact model is solved
        for it again.
    tolerance
        Part of the noise, measurement by measurement in the mean square, that what stands for the
        exact model may differ from it by; 0: nothing stands for it.
    tries
        New touches that are tried in a frame.
    look
        Part of the likelihood ratio at which a touch begins from which a further one is tried.
    rare
        Logarithm of the odds against a touch's beginning in a frame: evidence that it needs.
    joint
        Sets of as many new touches as there may be in all that are tried beside, for each number:
        the evidence alone decides on further touches then.
    restart
        Whether a frame that does not go on as it was is looked at without what was there too.
    speed
        Of touches along each axis, standard deviation, m/s; 0 where frames do not follow each
        other.
    scan_time
        Seconds that a scan takes: in it touches move and grow. 0 where rows are read all at once.
    interval
        Seconds between two frames.
    """

    warm: int = 4
    glance: int = 1
    cold: int = 4
    finalists: int = 1
    rounds: int = 0
    closing: int = 1
    near: float = 0.5
    tolerance: float = 0.1
    tries: int = 3
    look: float = 0.6
    rare: float = _FAVOURS
    joint: int = 0
    restart: bool = False
    speed: float = 0.1
    scan_time: float = 0.0
    interval: float = 0.0

    @property
    def reach(self) -> float:
        """How far a touch goes within a scan along each axis, standard deviation, m."""
        return self.speed * self.scan_time


LIVE = Pace()
"""What is not found in this frame is found in the next. With one try, presses that begin together
are one touch between them for some frames."""

EXHAUSTIVE = Pace(
    warm=6,
    glance=5,
    cold=30,
    finalists=3,
    rounds=4,
    closing=0,
    near=0.0,
    tolerance=0.0,
    tries=5,
    look=0.5,
    rare=0.0,
    joint=10,
    restart=True,
    speed=0.0,
)
"""Each frame as if it were the only one, of touches that stand still."""


@dataclass(frozen=True, slots=True)
class DetectionPolicy:
    """What counts as a touch in a frame; the native engine reads it by these names.

    Attributes
    ----------
    least
        Likelihood ratio, in deviations, at which a touch begins.
    sign
        Of the skin's touches: "decrease", "increase" or "both".
    most
        Touches that are looked for at most.
    pace
        How much is tried.
    held
        Part of the ratio at which a touch begins, at which it stays.
    sure
        Times that ratio: half the square of that is more than what a simpler explanation of the
        frame is worth.
    misshapen
        Part of what touches change that a wrong profile may leave: no evidence of another one.
    within, near
        Radii of a touch within which there is no room for another one, since together they are one
        of another profile; and within which one may stand for what the profile does not say.
    """

    least: float
    sign: str
    most: int
    pace: Pace
    held: float = HELD
    sure: float = 2.0
    misshapen: float = 0.04
    within: float = 0.5
    near: float = 1.5

    @classmethod
    def of(cls, settings: TouchSettings, pace: Pace) -> Self:
        """The policy that the settings of a skin ask for."""
        return cls(settings.snr, settings.sign, min(settings.max_touches, MOST), pace)

    # Evidence: does something stand out?

    def left_by(self, fit: Fit) -> float:
        """Deviations that a wrong profile of the spots of a fit may leave."""
        return self.misshapen * math.sqrt(fit.predicted @ fit.predicted)

    def beside(self, fit: Fit) -> FloatArray:
        """(k,) the same of the spots beside each; 0 where the evidence decides on further ones."""
        if len(fit.spots) < 2 or self.pace.joint:
            return np.zeros(len(fit.spots))
        others = fit.predicted - fit.each
        return np.asarray(self.misshapen * np.sqrt(np.einsum("kc,kc->k", others, others)))

    def threshold(self, fit: Fit, part: float = 1.0) -> float:
        """Deviations for that ``part`` of a touch; a wrong profile adds to the noise."""
        return part * math.hypot(self.least, self.left_by(fit))

    def look(self, fit: Fit) -> float:
        """Deviations from which a candidate is looked at."""
        return self.threshold(fit, self.pace.look if len(fit.spots) else self.held)

    def close(self, fit: Fit) -> float:
        """Deviations of a candidate from which a touch so near cannot be ruled out."""
        return self.threshold(fit, _DOUBTFUL)

    def weighs_sets(self, fit: Fit) -> bool:
        """Whether the evidence decides on further spots: where sets are tried."""
        return bool(self.pace.joint) and len(fit.spots) > 0

    def may_be_several(self, fit: Fit, widest: float) -> bool:
        """Whether several spots may stand where a fit has one, though nothing stands out beside:
        it is so wide, in deviations of the prior, or leaves so much."""
        return widest > _WIDE or fit.beyond / math.sqrt(2 * fit.degrees) > _REMAINS

    # Explanation: is one touch more worth it?

    def stays(self, ratio: float) -> bool:
        """Whether a touch of the frame before is still there."""
        return ratio >= self.held * self.least

    def is_needed(self, fit: Fit, ratio: float) -> bool:
        """Whether no frame is explained better without the weakest of its touches."""
        return ratio >= (1.0 if fit.settled else self.sure) * self.least

    def accepts(self, fit: Fit, more: Fit, weakest: float, gain: float) -> bool:
        """Whether one spot ``more`` than a ``fit`` has is worth it, by the ratio of its weakest."""
        gain -= self.against(fit, more)
        if self.weighs_sets(fit):
            return self.stays(weakest) and gain > _FURTHER
        return weakest >= self.threshold(fit) and gain > self.pace.rare

    def goes_on(self, fit: Fit, gain: float) -> bool:
        """Whether yet another spot is tried beside one that was not worth it."""
        return self.weighs_sets(fit) and gain >= -_DETOUR

    def against(self, fit: Fit, more: Fit) -> float:
        """Logarithm of the odds that a wrong profile of a ``fit`` may give to one with one spot
        more: infinite where two are at one place."""
        apart = np.linalg.norm(more.spots[:, None, :2] - more.spots[:, :2], axis=2)
        apart[np.diag_indices_from(apart)] = np.inf
        least = float((apart / np.exp(more.spots[:, LOG_RADIUS])).min())
        if least < self.within:
            return np.inf
        return self.left_by(fit) ** 2 / 2 if least < self.near else 0.0

    def is_astray(self, fit: Fit, before: FloatArray, *, in_vain: bool) -> bool:
        """Whether what was there may keep the frame from being understood: another touch stands
        out and does not fit ``in_vain``, or, at leisure, anything has changed."""
        if not self.pace.restart:
            return in_vain
        return len(fit.spots) != len(before) or not fit.settled

    def is_wrong(self, content: FloatArray) -> NDArray[np.bool_]:
        """Whether contents are not of the skin's sign."""
        return np.asarray(content * _SIGNS[self.sign] < 0)


def is_weak(policy: DetectionPolicy, ratio: float, fresh: float, beside: float) -> bool:
    """Whether a touch may go on but not begin: it does not stand out of what others have left, or
    may be what a wrong profile of those ``beside`` it leaves in frame after frame."""
    return fresh < policy.least or ratio < math.hypot(policy.least, beside)


# A rival: one touch more, that no frame alone shows.


def begins_rival(gain: float) -> bool:
    """Whether one spot more is followed, by what this frame says for it."""
    return gain >= _BORN


def drops_rival(odds: float) -> bool:
    """Whether frames have spoken against a rival."""
    return odds < _DROPPED


def elects_rival(policy: DetectionPolicy, fit: Fit, weakest: float, odds: float) -> bool:
    """Whether frames speak for a rival of a ``fit``, each of whose touches stands out as one
    that stays does."""
    return odds > 0 and weakest >= math.hypot(policy.held * policy.least, policy.left_by(fit))


# Other explanations: a rise, noise.


def may_be_lifted(policy: DetectionPolicy, square: float, degrees: int) -> bool:
    """Whether so much is in a frame without touches that it is looked at for a rise."""
    return square >= degrees + policy.least**2


def lifted(policy: DetectionPolicy, ratio: float, content: FloatArray) -> bool:
    """Whether a press has been lifted that was there when the reference was taken."""
    return bool(policy.is_wrong(content)) and ratio > _LIFTED * policy.least


def leaves_much(policy: DetectionPolicy, fit: Fit) -> bool:
    """Whether touches leave so much that some of it may be a rise."""
    return fit.beyond >= _ASTRAY * policy.least**2


def rises_beside(policy: DetectionPolicy, fit: Fit, both: Fit, ratio: FloatArray) -> bool:
    """Whether touches of ``both`` signs explain what those of a ``fit`` leave: some clearly are
    not of the skin's sign, and little remains then. Where much does, more touches come."""
    wrong = ratio[policy.is_wrong(both.spots[:, CONTENT])]
    clear = bool((wrong > _CLEAR * policy.threshold(fit)).any())
    return clear and both.beyond < _HALF * fit.beyond


def is_like_touch(policy: DetectionPolicy, fit: Fit, ratio: float) -> bool:
    """Whether a candidate of that ratio may be a touch too faint to be accepted."""
    return bool(ratio**2 > max(policy.least**2, _EXPLAINS * fit.beyond))


# Other explanations: a jump of the common mode.


def may_have_jumped(policy: DetectionPolicy, moved: float, fit: Fit) -> bool:
    """Whether touches leave so much more along a jump than before."""
    return moved > _LEAVES and moved > math.hypot(_LEAVES, policy.left_by(fit))


def is_no_jump(policy: DetectionPolicy, along: float, fit: Fit | None = None) -> bool:
    """Whether the common mode is where it is expected, so much being left along a jump."""
    most = _USUAL if fit is None else math.hypot(_USUAL, policy.left_by(fit))
    return abs(along) < most


def favours(gain: float) -> bool:
    """Whether a frame speaks for one explanation against another, by odds of 200."""
    return gain > _FAVOURS


def are_distinct(square: float, variance: float) -> bool:
    """Whether two positions are those of two touches: a squared distance beside its variance."""
    return square >= _DISTINCT * variance


def looks_again(frames: int) -> bool:
    """Whether touches that have left much in so many frames in a row are looked at once more."""
    return frames < _LOOKS or frames.bit_count() == 1


def stands_as_rise(frames: int) -> bool:
    """Whether a change of the other sign in so many frames is one. Not where it stands for long: a
    faint press may have become part of the reference."""
    return _YOUNG <= frames < _STANDS


def may_be_noise(fit: Fit, age: int) -> bool:
    """Whether what touches of that ``age`` in frames leave is beyond chance, and no error of their
    model."""
    return age < _YOUNG and fit.misfit / fit.degrees >= 1 + _CHANCE * math.sqrt(2 / fit.degrees)


def may_be_found(fit: Fit, ratio: float) -> bool:
    """Whether what a ``fit`` leaves may be a further touch, the best candidate of that ratio."""
    return ratio**2 > _EXPLAINS * fit.beyond
