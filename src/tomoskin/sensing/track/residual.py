"""Where touches have been, and which detections are only what they left behind in the sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tomoskin.core import Detection
from tomoskin.sensing.track.motion import region_radius
from tomoskin.sensing.track.policy import RESIDUAL
from tomoskin.sensing.track.trace import Footprint, Trace, sign_of, size_of

_CREEP = 10.0
"""A level that rises slower than over so many seconds is the sheet's drift."""

_FALLS = 0.5
"""Part by which the level follows what is lower: the least of many frames would be their noise."""

_MOST = 64


@dataclass(slots=True, eq=False)
class Residual:
    """What is left at a ``foot`` of a touch of this sign and ``radius``, and its ``level``."""

    foot: Footprint
    sign: float
    radius: float
    level: float
    time: float

    def explains(self, detection: Detection, time: float) -> bool:
        """Whether the detection has not grown; follow its level."""
        size = size_of(detection)
        noise = size / detection.snr if detection.snr > 0 else 0.0
        grown = RESIDUAL.has_grown(size, self.level, noise)
        if not grown:
            creeps = -np.expm1((self.time - time) / _CREEP)
            self.level += (size - self.level) * (creeps if size > self.level else _FALLS)
        self.time = time
        return not grown


class ResidualResponses:
    """Memory of where touches were."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget all: nothing of them shows in detections any more."""
        self._residuals: list[Residual] = []
        self._shown = -math.inf

    def leave(self, trace: Trace, time: float) -> None:
        """Remember where a touch was that has ended."""
        radius = region_radius(trace.detection)
        self._residuals += [
            Residual(foot, trace.sign, radius, RESIDUAL.part * foot.top, time)
            for foot in trace.footprints
        ]
        del self._residuals[:-_MOST]

    def note(self, time: float, *, quiet: bool) -> None:
        """Follow whether frames are ``quiet``, without any detection: where they stay so, the
        residual responses are below the noise."""
        if not quiet:
            self._shown = time
        elif time - self._shown >= RESIDUAL.gone:
            self._residuals.clear()

    def explain(self, detection: Detection, time: float, traces: Iterable[Trace]) -> bool:
        """Whether the detection is the residual response of an earlier touch.

        Or of one of ``traces``, behind or beside it while it still stands.
        """
        for trace in traces:
            radius = region_radius(trace.detection)
            if trace.reported and any(
                _is_under(detection, foot, trace.sign, radius) for foot in trace.footprints
            ):
                return True
        answers = [
            residual.explains(detection, time)
            for residual in self._residuals
            if _is_under(detection, residual.foot, residual.sign, residual.radius)
        ]
        return any(answers)  # each of them follows the level


def _is_under(detection: Detection, foot: Footprint, sign: float, radius: float) -> bool:
    """Whether it lies where something was, with this sign, and no larger than a residual."""
    reach = RESIDUAL.reach * max(radius, region_radius(detection))
    near = (detection.x - foot.x) ** 2 + (detection.y - foot.y) ** 2 <= reach**2
    return near and sign_of(detection) == sign and RESIDUAL.holds(size_of(detection), foot.top)


def is_residual(trace: Trace, time: float, *, alone: bool) -> bool:
    """Whether a touch has ended and only its residual response is seen.

    It must have fallen fast and not grown since. Not ``alone`` it may stand out little only since
    others are given, and then it is what it changes that must have fallen.
    """
    size, top = size_of(trace.detection), trace.top
    slow = trace.low is None and time - trace.strong > RESIDUAL.recovery
    if slow or (trace.is_full and not alone) or not RESIDUAL.holds(size, top):
        trace.low = None
        return False
    if trace.low is None or RESIDUAL.has_grown(size, trace.least, 0.0):
        trace.low, trace.least = time, size
    trace.least = min(trace.least, size)
    return time - trace.low >= RESIDUAL.lasts and time > trace.low
