"""Residual responses: told from a touch by position, sign, size and by not growing.

Textiles, foams and gels do not come back at once, and some not before the next press (play,
Prandtl 1928). The residual response has the press's sign, a fraction of its size, and fades.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tomoskin.core import Detection
from tomoskin.sensing.track.motion import region_radius
from tomoskin.sensing.track.trace import Footprint, Trace, sign_of, size_of

_PART = 0.25
"""A residual is at most this part of its press."""

_FALL = 1.0
"""A press that is lifted falls from half its size to that part within so many seconds."""

_GROWTH = 1.5
"""What grows by this factor, and by two deviations of its noise, is a new press."""

_NOISE = 2.0
_CREEP = 10.0
"""A level that rises slower than over so many seconds is the sheet's drift."""

_FALLS = 0.5
"""Part by which the level follows what is lower: the least of many frames would be their noise."""

_BESIDE = 1.25
"""A residual lies within this many radii of its region, or of its press's."""

_GONE = 0.5
"""Seconds without any detection after which there is no residual response: a finder loses what is
faint for a few frames."""

_LASTS = 0.05
"""Seconds for which a touch must look like a residual response to be one."""

_MOST = 64


@dataclass(slots=True, eq=False)
class Residual:
    """Where a press was: its sign and size, its radius, and the level of its residual response.

    ``unseen``: there was nothing above the noise since it was last looked for.
    """

    x: float
    y: float
    sign: float
    press: float
    radius: float
    level: float
    time: float
    unseen: bool = False

    def is_under(self, detection: Detection) -> bool:
        """Whether the detection lies here, with this sign, and no larger than a residual."""
        return sign_of(detection) == self.sign and _may_be_residual(
            detection, Footprint(self.x, self.y, self.press), self.radius
        )

    def explains(self, detection: Detection, time: float, least_snr: float) -> bool:
        """Whether the detection has not grown; follow its level."""
        size = size_of(detection)
        noise = size / detection.snr if detection.snr > 0 else 0.0
        if self.unseen:
            self.level, self.unseen = min(self.level, least_snr * noise), False
        grown = size > _GROWTH * self.level + _NOISE * noise
        if not grown:
            creeps = -np.expm1((self.time - time) / _CREEP)
            self.level += (size - self.level) * (creeps if size > self.level else _FALLS)
        self.time = time
        return not grown


class ResidualResponses:
    """Memory of where touches were.

    Parameters
    ----------
    least_snr
        Signal-to-noise ratio below which there is no detection.
    """

    def __init__(self, least_snr: float) -> None:
        self._least_snr = least_snr
        self._residuals: list[Residual] = []
        self._quiet_since: float | None = None

    def forget(self) -> None:
        """Forget all, as with a new reference."""
        self._residuals, self._quiet_since = [], None

    def leave(self, trace: Trace, time: float) -> None:
        """Remember where a touch was that has ended."""
        radius = region_radius(trace.detection)
        for foot in trace.footprints:
            self._residuals.append(
                Residual(foot.x, foot.y, trace.sign, foot.top, radius, _PART * foot.top, time)
            )
        del self._residuals[:-_MOST]

    def note(self, time: float, *, quiet: bool) -> None:
        """Follow whether frames are ``quiet``, without any detection: where they stay so, the
        residual responses are below the noise."""
        if not quiet:
            self._quiet_since = None
            return
        if self._quiet_since is None:
            self._quiet_since = time
        if time - self._quiet_since >= _GONE:
            for residual in self._residuals:
                residual.unseen = True

    def explain(self, detection: Detection, time: float, traces: Iterable[Trace]) -> bool:
        """Whether the detection is the residual response of an earlier touch.

        Or of one of ``traces``, behind or beside it while it still stands.
        """
        if any(_is_on_track(detection, trace) for trace in traces):
            return True
        under = [residual for residual in self._residuals if residual.is_under(detection)]
        answers = [residual.explains(detection, time, self._least_snr) for residual in under]
        return any(answers)  # each of them follows the level


def _is_on_track(detection: Detection, trace: Trace) -> bool:
    if not trace.reported or sign_of(detection) != trace.sign:
        return False
    radius = region_radius(trace.detection)
    return any(_may_be_residual(detection, foot, radius) for foot in trace.footprints)


def _may_be_residual(detection: Detection, foot: Footprint, radius: float) -> bool:
    """Whether it lies where something was, and is no larger than a residual of that."""
    reach = _BESIDE * max(radius, region_radius(detection))
    near = (detection.x - foot.x) ** 2 + (detection.y - foot.y) ** 2 <= reach**2
    return near and size_of(detection) <= _PART * foot.top


def is_residual(trace: Trace, time: float) -> bool:
    """Whether a touch has ended and only its residual response is seen.

    It must have fallen fast and not grown since.
    """
    size, top = size_of(trace.detection), trace.top
    if size > _PART * top or (trace.low is None and time - trace.strong > _FALL):
        trace.low = None
        return False
    if trace.low is None or size > _GROWTH * trace.least:
        trace.low, trace.least = time, size
    trace.least = min(trace.least, size)
    return time - trace.low >= _LASTS and time > trace.low
