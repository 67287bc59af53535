"""A twin whose frames come one by one, for benchmarks of what happens between frames."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tomoskin.core import FloatArray, Frame, Touch
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline
from tomoskin.twin import Faults, Press, TwinSettings, make_electronics
from twin import table_of

PROBE = 0.012
"""Radius of every press, m."""

NONE = Faults()


class Rig:
    """Frames of the twin of ``skin`` with a preset and a seed, as fast as they are asked for."""

    def __init__(self, skin: Skin, preset: str, seed: int) -> None:
        self.skin = skin
        self.board = make_electronics(skin, TwinSettings.preset(preset, seed))
        self.table = table_of(skin)
        self.interval = self.table.seconds
        self.frames = 0

    def frame(self, presses: Iterable[Press] = (), faults: Faults = NONE) -> Frame:
        """The next scan."""
        self.board.sheet.set_presses(tuple(presses))
        self.board.set_faults(faults)
        time = self.frames * self.interval
        samples = self.board.sample(self.table, time)
        ticks = round(time * self.skin.readout.tick_rate)
        self.frames += 1
        return Frame(self.frames - 1, ticks, time, 1, 0, 0, samples)

    def push(
        self,
        pipeline: Pipeline,
        count: int,
        presses: Iterable[Press] = (),
        faults: Faults = NONE,
    ) -> list[FrameResult]:
        """What a pipeline makes of the next ``count`` frames."""
        found = [pipeline.push(self.frame(presses, faults)) for _ in range(count)]
        return [result for result in found if result is not None]


def places(random: np.random.Generator, count: int, reach: float) -> FloatArray:
    """(count, 2) m, evenly over a disc of radius ``reach``."""
    radius = reach * np.sqrt(random.random(count))
    turn = 2 * np.pi * random.random(count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])


def missed_by(touches: Iterable[Touch], place: FloatArray) -> float:
    """mm from ``place`` to the nearest touch; NaN where there is none."""
    away = [1e3 * np.hypot(t.detection.x - place[0], t.detection.y - place[1]) for t in touches]
    return float(min(away, default=np.nan))
