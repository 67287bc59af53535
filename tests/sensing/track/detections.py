"""Readings as a finder would give them, and a tracker fed with them at some frame rate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tomoskin.core import Detection, Touch
from tomoskin.sensing.track import TouchEvent, Tracker, TrackSettings

AREA = math.pi * 0.015**2


def detection(x: float, y: float = 0.0, peak: float = -1.0, **more: Any) -> Detection:
    """A region of 15 mm radius, well above its noise."""
    values = {"sd_x": 0.001, "sd_y": 0.001, "area": AREA, "snr": 50.0} | more
    return Detection(x=x, y=y, peak=peak, cells=np.array([0]), **values)


@dataclass
class Run:
    """A tracker, and what it has said so far."""

    rate: float = 40.0
    settings: TrackSettings = field(default_factory=TrackSettings)
    touches: list[tuple[Touch, ...]] = field(default_factory=list)
    events: list[TouchEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.tracker = Tracker(self.settings)
        self.frame = 0

    def __call__(self, frames: Iterable[Sequence[Detection]]) -> Run:
        """Feed frames; ``touches`` are theirs alone."""
        self.touches = []
        for detections in frames:
            time = self.frame / self.rate
            self.touches.append(self.tracker.update(detections, time, 100 + time))
            self.events += self.tracker.events
            self.frame += 1
        return self

    @property
    def shown(self) -> list[list[int]]:
        """Identities, frame by frame."""
        return [[touch.id for touch in touches] for touches in self.touches]

    @property
    def happened(self) -> list[tuple[str, int]]:
        """Events but for moves."""
        return [(e.kind, e.touch.id) for e in self.events if e.kind != "move"]
