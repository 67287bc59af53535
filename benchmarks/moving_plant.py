"""Fingers that come, move, meet, part and go on a sheet that shares nothing with twin and fit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from plant import Finger, Plant, plant_mesh
from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES

FAST = {8: 4, 16: 2}
"""Conversions to a sample at which a board makes about 40 frames a second, by electrodes."""

UNEVEN = 0.1
RAMP = 0.05
"""Seconds in which a finger comes down, and in which it is lifted."""

SETTLED = 260
"""Idle frames before a scene: the reference, and those in which the sheet is learnt from it."""


@dataclass(frozen=True)
class Slide:
    """A finger from ``start`` to ``end`` s along ``path``, rows of s, x and y m."""

    finger: Finger
    start: float
    end: float
    path: tuple[tuple[float, float, float], ...]

    def at(self, time: float) -> Finger | None:
        """It at a moment; None where it does not touch."""
        depth = min((time - self.start) / RAMP, (self.end - time) / RAMP, 1.0)
        if depth <= 0:
            return None
        times, x, y = np.array(self.path).T
        place = (float(np.interp(time, times, values)) for values in (x, y))
        x_now, y_now = place
        return replace(self.finger, x=x_now, y=y_now, fall=self.finger.fall * depth)


@dataclass(frozen=True)
class Shown:
    """What the pipeline makes of a frame, and its number, begin and end in s of the scene."""

    result: FrameResult
    number: int
    begin: float
    end: float


@cache
def stage(electrodes: int, oversampling: int) -> tuple[Prepared, Mesh]:
    """A textile disc with so many conversions to a sample, and the plant's mesh of it."""
    skin = Skin.load(f"textile-disc-{electrodes}")
    text = re.sub(r"oversampling = \d+", f"oversampling = {oversampling}", skin.to_toml())
    prepared = prepare(Skin.from_toml(text))
    return prepared, plant_mesh(prepared.skin)


def interval(prepared: Prepared) -> float:
    """Seconds of a frame."""
    return Configuration.of(prepared.scan, ScanSettings.of(prepared.skin)).scan_time


class Sheet:
    """A plant with a pipeline that has its reference: one scene after the other."""

    def __init__(self, electrodes: int, seed: int, oversampling: int | None = None) -> None:
        self.prepared, mesh = stage(electrodes, oversampling or FAST[electrodes])
        self.plant = Plant(self.prepared.skin, mesh, UNEVEN, seed)
        self.pipeline = Pipeline(self.prepared)
        self._interval, self._number = interval(self.prepared), 0
        for _ in range(REFERENCE_FRAMES + SETTLED):
            self._push((), 0.0)

    def scene(self, slides: Sequence[Slide], seconds: float) -> Iterator[Shown]:
        """Frames of a scene, and of half a second without anything after it."""
        for number in range(round((seconds + 0.5) / self._interval)):
            begin = number * self._interval
            result = self._push(slides, begin)
            assert result is not None
            yield Shown(result, number, begin, begin + self._interval)

    def _push(self, slides: Sequence[Slide], begin: float) -> FrameResult | None:
        moments = (begin, begin + self._interval / 2, begin + self._interval)
        pressed = [[f for slide in slides if (f := slide.at(time))] for time in moments]
        frame = self.plant.scan_of(*pressed)
        now = self._number * self._interval
        ticks = round(now * self.pipeline.tick_rate)
        self._number += 1
        return self.pipeline.push(replace(frame, sequence=self._number, ticks=ticks, host_time=now))
