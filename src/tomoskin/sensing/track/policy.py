"""What a touch is over frames: its initiation, association and deletion, and its residual response.

The thresholds by which a touch begins, goes on and ends stand here, with the decisions that are
taken by them; the other modules compute what is decided on. What one frame says,
:mod:`tomoskin.sensing.fit.policy` decides.

Odds are logarithms. They grow and shrink with what frames show. Their numbers were chosen on the
moving plant, seeds 1 to 3 (docs/theory/tracking.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tomoskin.core import Detection

HELD = 0.6
"""Part of the signal-to-noise ratio at which a touch begins, above which it goes on: between the
two it neither begins nor ends. The only such threshold, in images and fits too."""

# Existence.

BEGUN = math.log(99.0)
"""Odds from which a touch is reported."""

MOST = 7.0
"""No touch is surer than that: it may be lifted at any time."""

ENDED = 0.0
"""Odds below which a reported touch is released."""

_BEGINS = 3.0
"""Logarithm of how many times as often a touch begins as a finder sees one that is none."""

_BESIDE = 2.0
"""By so much that is less beside another touch, whose model errs in frame after frame."""

_TAIL, _MISFIT = 0.6, 0.03
"""Deviations over which detections of nothing get rare above the threshold; beside other touches
at least so much of the strongest one's."""

_AGAIN = 7.0
"""Logarithm of how much rarer a detection of nothing is where another has been the frame before; of
what a misfit may be, less: that is the same in the next frame."""

_CLUTTER = 3.0
"""Logarithm of the range of ratios that touches have."""

_LIFE = 2.0
"""Seconds that a touch lasts, as an expectation before it has ended."""

_MISSES = 0.15
"""Probability that a finder loses a touch, however strong, for a frame."""

_COHERENCE = 0.02
"""Seconds within which frames tell the same."""

_REACH, _SOUGHT = 0.025, 0.15
"""Metres within which a touch must be where it is reported, as surely as it is there at all; and
seconds after which it is reported wherever it may be."""

# Association.

GATE = 16.0
"""Squared Mahalanobis distance beyond which a detection is of another touch: one in 3,000."""

APART = 7.5
"""Cost of a touch that ends and another that begins: of a pair that is as likely."""

STRENGTH = 4.0
"""What a strength costs at the most, in logarithms of a likelihood: forces come and go."""

JUMP = 4.0
"""What it costs that two touches are seen as one, half-way between."""

EXCHANGED = -6.0
"""Odds from which two touches may have changed places."""

MET = 2.0
"""Odds from which a touch that has just gone missing is held to have met another; later any odds
do."""


@dataclass(frozen=True, slots=True)
class ResidualModel:
    """What stays in the sheet of a touch that has been lifted.

    Textiles, foams and gels do not come back at once, and some not before the next press (play,
    Prandtl 1928). The residual response has the press's sign, a fraction of its size, and fades.
    It lies where the press has been: at its footprints.

    Attributes
    ----------
    part
        Of the press that it has at most.
    spacing
        A touch that slides leaves a footprint every so many metres.
    recovery
        Seconds in which a sheet recovers: a press that is lifted falls from half its size to
        that part within these, and for so long the sheet remembers its strength.
    growth, noise
        What grows by this factor, and by so many deviations of its noise, is a new press.
    reach
        It lies within this many radii of its region, or of its press's.
    lasts
        Seconds for which a touch must look like it to be it.
    gone
        Seconds without any detection after which there is none where it is below the noise: a
        finder loses what is faint for a few frames.
    most
        Footprints that are kept, the newest: half a metre of a slide.
    """

    part: float = 0.25
    spacing: float = 0.012
    recovery: float = 1.0
    growth: float = 1.5
    noise: float = 2.0
    reach: float = 1.25
    lasts: float = 0.05
    gone: float = 0.5
    most: int = 40

    @property
    def deviation(self) -> float:
        """Of its size, in parts of the press: the largest stands out by five."""
        return self.part / 5

    def holds(self, size: float, press: float) -> bool:
        """Whether so much may be what is left of a ``press``."""
        return size <= self.part * press

    def has_grown(self, size: float, level: float, noise: float) -> bool:
        """Whether what was at a ``level`` is a new press; ``noise``: a deviation of the size."""
        return size > self.growth * level + self.noise * noise


RESIDUAL = ResidualModel()
"""The only model of it: the tracker's, and that of the noise of a fit."""


def initiated(detection: Detection, threshold: float, strongest: float, *, stands: bool) -> float:
    """Odds that a new ``detection`` is a touch; ``strongest`` is the largest ratio of others, 0
    where there are none: beside one that ``stands`` already one frame is never enough."""
    if math.isnan(detection.snr):
        return 0.0
    odds = _BEGINS + _standing_out(detection.snr, threshold, strongest)
    odds -= _BESIDE if strongest > 0 else 0.0
    return min(odds, BEGUN - 1) if stands else odds


def confirmed(
    odds: float, detection: Detection, threshold: float, strongest: float, seconds: float
) -> float:
    """Odds after a further detection, so many ``seconds`` after the frame before."""
    snr = 2 * threshold if math.isnan(detection.snr) else max(detection.snr, threshold)
    again = _AGAIN / (1 + (_MISFIT * strongest / snr) ** 2) - (_BESIDE if strongest > 0 else 0.0)
    gain = again + _standing_out(snr, threshold, strongest)
    return min(odds + _share(seconds) * max(gain, 0.0), MOST)


def missed(odds: float, snr: float, threshold: float, seconds: float) -> float:
    """Odds after a frame without a detection of a touch of that ratio: below a part of the
    ``threshold`` there is none."""
    lasts = math.exp(-seconds / _LIFE)
    there = lasts / (1 + math.exp(-odds))
    faint = (
        0.0
        if math.isnan(snr)
        else 0.5 * math.erfc((snr - HELD * threshold) / (1 + 0.2 * snr) / 2**0.5)
    )
    lost = math.log(max(_MISSES, faint))
    return math.log(there) - math.log1p(-there) + _share(seconds) * lost


def may_begin(detection: Detection, threshold: float) -> bool:
    """Whether a detection may be of a new touch; one that is not reported yet is forgotten where
    its detection no longer may."""
    return not (detection.weak or detection.snr < threshold)


def is_reported(odds: float, detection: Detection, seconds: float) -> bool:
    """Whether a touch is sure to be there, and it is known where it is; or it has been detected
    for so many ``seconds`` that it is reported all the same: its first frames may have seen it
    come down."""
    if odds < BEGUN:
        return False
    variance = detection.sd_x**2 + detection.sd_y**2
    return not BEGUN * variance > _REACH**2 or seconds > _SOUGHT


def is_deleted(odds: float) -> bool:
    """Whether a reported touch that is missing is released."""
    return odds < ENDED


def has_met(odds: float, *, deleted: bool) -> bool:
    """Whether a touch that is missing has met another, by the odds of that."""
    return odds > MET or (deleted and odds > 0)


def _standing_out(snr: float, threshold: float, strongest: float) -> float:
    """Log likelihood ratio of a touch, whose ratio may be anything, against nothing."""
    tail = max(_TAIL, _MISFIT * strongest)
    above = max(snr - threshold, 0.0)
    return above / tail + math.log(tail) - math.log(max(snr, 1e-3)) - math.log(_CLUTTER)


def _share(seconds: float) -> float:
    """What a frame tells beside the one before."""
    return min(seconds / _COHERENCE, 1.0)
