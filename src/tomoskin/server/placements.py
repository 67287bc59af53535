"""Takes what is laid on the skin, from the touches of frame after frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tomoskin.core import Detection, FloatArray, Touch
from tomoskin.server.press_taker import OFTEN

PlacingPhase = Literal["rest", "press", "hold", "several", "release"]
"""Lift everything; lay something on; let it lie; too much lies there; lift it."""

_STILL_FOR, _FEWEST = 0.6, 8
"""Seconds, and frames, for which something must lie still: a hand that lowers it does not."""

_CREEPS, _WAVERS = 0.04, 2.0
"""How far it may move meanwhile, from the first half to the second: its change of the sheet as a
part of itself, or in deviations of such a mean where that is more."""

_SLIDES = 3e-3
"""The same of its position, m."""

_GONE = 3
"""Frames without a touch after which nothing lies there."""


@dataclass(frozen=True, eq=False)
class Placement:
    """What one thing did from the moment it was laid on until it lay still: detections in the order
    of ``time`` (n,) s, and the one of them, ``still``, that stands for it lying still."""

    detections: tuple[Detection, ...]
    time: FloatArray
    still: int

    @property
    def xy(self) -> tuple[float, float]:
        """Position of the weight, m."""
        detection = self.detections[self.still]
        return detection.x, detection.y


class PlacementTaker:
    """Takes placements, one at a time; each lies alone, and is lifted before the next.

    What leads up to it is kept: a sheet remembers.
    """

    def __init__(self) -> None:
        self.phase: PlacingPhase = "rest"
        self._rows: list[tuple[float, Detection]] = []
        self._id = 0
        self._empty = 0

    def push(self, time: float, touches: Sequence[Touch]) -> Placement | None:
        """Take the touches of a frame at ``time`` s; the placement when it has lain still."""
        if not touches:
            self._empty += 1
            if self._empty >= _GONE:
                self.phase = "press"
                self._rows.clear()
            return None
        self._empty = 0
        if self.phase in {"rest", "release"}:
            return None
        if len(touches) > 1 or touches[0].merged:
            self.phase = "several"
            self._rows.clear()
            return None
        return self._alone(time, touches[0])

    def _alone(self, time: float, touch: Touch) -> Placement | None:
        self.phase = "hold"
        if touch.id != self._id:
            self._id = touch.id
            self._rows.clear()
        if self._rows and 0 <= time - self._rows[-1][0] < OFTEN:
            return None
        self._rows.append((time, touch.detection))
        still = self._still()
        if still is None:
            return None
        self.phase = "release"
        times, detections = zip(*self._rows, strict=True)
        self._rows.clear()
        return Placement(detections, np.array(times), still)

    def _still(self) -> int | None:
        """Number of the row that stands for it, once it lies still."""
        times = np.array([time for time, _ in self._rows])
        first = int(np.searchsorted(times, times[-1] - _STILL_FOR))
        if times[-1] - times[0] < _STILL_FOR or len(times) - first < _FEWEST:
            return None
        late = [detection for _, detection in self._rows[first:]]
        content = np.array([abs(d.peak) * d.area for d in late])
        xy = np.array([(d.x, d.y) for d in late])
        half = len(late) // 2
        moved = abs(content[half:].mean() - content[:half].mean())
        usual = content.std() * np.sqrt(2 / half)
        slid = np.linalg.norm(xy[half:].mean(axis=0) - xy[:half].mean(axis=0))
        if moved > max(_CREEPS * content.mean(), _WAVERS * usual) or slid > _SLIDES:
            return None
        middle = np.argsort(content)[len(content) // 2]
        return first + int(middle)
