"""Why a touch began, stayed, moved, ended or did not begin, in a sentence each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from tomoskin.core import Detection
from tomoskin.sensing.track import policy
from tomoskin.sensing.track.association import FrameOfTouches
from tomoskin.sensing.track.trace import Trace

STEP = "decision"
"""The step under which an observer gets them (:func:`tomoskin.core.observe_steps`)."""


@dataclass(frozen=True, slots=True)
class TrackDecision:
    """One decision of the tracker.

    Attributes
    ----------
    touch
        Identity of the touch; None of a detection that is none, or not yet.
    x, y
        m, where its detection or the touch is.
    what
        Initiated, associated, missing, deleted, waiting or refused.
    why
        The reason, in a sentence.
    """

    touch: int | None
    x: float
    y: float
    what: str
    why: str

    @classmethod
    def refused(cls, detection: Detection, threshold: float) -> Self:
        """A detection that may not begin a touch."""
        why = f"its signal-to-noise ratio is {detection.snr:.1f}, and a touch needs {threshold:g}"
        if detection.weak:
            why = "it is too weak beside others: it can carry a touch on, not begin one"
        return cls(None, detection.x, detection.y, "refused", why)

    @classmethod
    def residual(cls, detection: Detection) -> Self:
        """A detection that an earlier press has left behind."""
        why = "it lies where a press has been, is a small part of it, and does not grow"
        return cls(None, detection.x, detection.y, "refused", why)

    @classmethod
    def waiting(cls, trace: Trace) -> Self:
        """A newcomer that is not reported yet."""
        d, needed = trace.detection, policy.BEGUN
        why = f"the logarithm of its odds is {trace.odds:.1f}, and a touch needs {needed:.1f}"
        if trace.odds >= needed:
            why = "it is a touch, but where is not known well enough yet"
        return cls(None, d.x, d.y, "waiting", why)

    @classmethod
    def initiated(cls, trace: Trace, touch: int) -> Self:
        """A touch that is reported from this frame on."""
        why = f"the logarithm of its odds is {trace.odds:.1f}, and a touch needs {policy.BEGUN:.1f}"
        return cls(touch, trace.detection.x, trace.detection.y, "initiated", why)

    @classmethod
    def followed(cls, trace: Trace, touch: int, frame: FrameOfTouches) -> Self:
        """A reported touch that has taken a detection of this frame, or is missing."""
        d, ahead = trace.detection, trace.ahead
        if trace.missing is None:
            away = 1e3 * ((d.x - ahead.x) ** 2 + (d.y - ahead.y) ** 2) ** 0.5
            why = (
                f"a detection lies {away:.1f} mm from where it was expected, its signal-to-noise "
                f"ratio is {d.snr:.1f}, and the logarithm of its odds {trace.odds:.1f}"
            )
            return cls(touch, d.x, d.y, "associated", why)
        since = frame.clock.now - trace.missing
        why = (
            f"no detection has been its own for {since:.2f} s; it ends where the logarithm of its "
            f"odds, {trace.odds:.1f}, falls below {policy.ENDED:g}"
        )
        return cls(touch, d.x, d.y, "missing", why)

    @classmethod
    def deleted(cls, trace: Trace, touch: int) -> Self:
        """A touch that has ended."""
        why = "what is left of it is what a lifted press leaves in the sheet"
        if trace.missing is not None:
            why = (
                f"no detection was its own until the logarithm of its odds fell to {trace.odds:.1f}"
            )
        return cls(touch, trace.detection.x, trace.detection.y, "deleted", why)
