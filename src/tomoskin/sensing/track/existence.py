"""Whether there is a touch: odds that grow and shrink with what frames show."""

from __future__ import annotations

import math

from tomoskin.core import Detection

BEGUN = math.log(99.0)
"""Logarithm of the odds from which a touch is reported."""

MOST = 7.0
"""No touch is surer than that: it may be lifted at any time."""

ENDED = 0.0
"""Logarithm of the odds below which a reported touch is released."""

MET = 2.0
"""Logarithm of the odds from which a touch that has just gone missing is held to have met another;
later any odds do."""

# Chosen on the moving plant, seeds 1 to 3 (docs/theory/tracking.md).

_BEGINS = 3.0
"""Logarithm of how many times as often a touch begins as a finder sees one that is none."""

_BESIDE = 2.0
"""By so much that is less beside another touch, whose model errs in frame after frame."""

_TAIL, _MISFIT = 0.6, 0.03
"""Deviations over which detections of nothing get rare above the threshold; beside other touches
at least so much of the strongest one's."""

_AGAIN = 7.0
"""Logarithm of how much rarer a detection of nothing is where another has been the frame before."""

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


def first(detection: Detection, threshold: float, strongest: float) -> float:
    """Log odds that a new ``detection`` is a touch; ``strongest`` is the largest ratio of others
    that stand, 0 where there are none: beside others one frame is never enough."""
    if math.isnan(detection.snr):
        return 0.0
    odds = _BEGINS + _standing_out(detection.snr, threshold, strongest)
    return min(odds - _BESIDE, BEGUN - 1) if strongest > 0 else odds


def seen(
    odds: float, detection: Detection, threshold: float, strongest: float, seconds: float
) -> float:
    """Log odds after a further detection, so many ``seconds`` after the frame before."""
    snr = 2 * threshold if math.isnan(detection.snr) else max(detection.snr, threshold)
    gain = _AGAIN - (_BESIDE if strongest > 0 else 0.0) + _standing_out(snr, threshold, strongest)
    return min(odds + _share(seconds) * max(gain, 0.0), MOST)


def missed(odds: float, snr: float, least: float, seconds: float) -> float:
    """Log odds after a frame without a detection of a touch of that ratio, ``least`` the ratio
    below which there is none."""
    lasts = math.exp(-seconds / _LIFE)
    there = lasts / (1 + math.exp(-odds))
    faint = 0.0 if math.isnan(snr) else 0.5 * math.erfc((snr - least) / (1 + 0.2 * snr) / 2**0.5)
    lost = math.log(max(_MISSES, faint))
    return math.log(there) - math.log1p(-there) + _share(seconds) * lost


def placed(detection: Detection, seconds: float) -> bool:
    """Whether it is known where a touch is, or it has been seen for so many ``seconds`` that it is
    reported all the same: its first frames may have seen it come down."""
    variance = detection.sd_x**2 + detection.sd_y**2
    return not BEGUN * variance > _REACH**2 or seconds > _SOUGHT


def _standing_out(snr: float, threshold: float, strongest: float) -> float:
    """Log likelihood ratio of a touch, whose ratio may be anything, against nothing."""
    tail = max(_TAIL, _MISFIT * strongest)
    above = max(snr - threshold, 0.0)
    return above / tail + math.log(tail) - math.log(max(snr, 1e-3)) - math.log(_CLUTTER)


def _share(seconds: float) -> float:
    """What a frame tells beside the one before."""
    return min(seconds / _COHERENCE, 1.0)
