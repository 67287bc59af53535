"""Scenes of fingers that come, move, meet, part and go on a plant, drawn by a seed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from plant import Finger, Plant, plant_mesh
from rig import scan_time, stage
from tomoskin.model.mesh import Mesh
from tomoskin.pipeline import FrameResult, Pipeline
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES

UNEVEN = 0.1
RAMP = 0.05
"""Seconds in which a finger comes down, and in which it is lifted."""

SETTLED = 260
"""Idle frames before a scene: the reference, and those in which the sheet is learnt from it."""

SPEED, APART, INSIDE = 0.06, 0.045, 0.075
RADII, FALLS = (0.012, 0.020), (0.15, 0.35)
STRAYS = 0.015
"""Two that meet pass each other, or stop, at up to so many metres: closer than is told apart."""


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
        here = {"x": float(np.interp(time, times, x)), "y": float(np.interp(time, times, y))}
        return replace(self.finger, **here, fall=self.finger.fall * depth)


@dataclass(frozen=True)
class Shown:
    """What the pipeline makes of a frame, and its number, begin and end in s of the scene."""

    result: FrameResult
    number: int
    begin: float
    end: float


@cache
def _mesh(electrodes: int) -> Mesh:
    return plant_mesh(stage(electrodes).skin)


class Sheet:
    """A plant with a pipeline that has its reference: one scene after the other."""

    def __init__(self, electrodes: int, seed: int) -> None:
        prepared = stage(electrodes)
        self.plant = Plant(prepared.skin, _mesh(electrodes), UNEVEN, seed)
        self.pipeline = Pipeline(prepared)
        self._interval, self._number = scan_time(prepared), 0
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


def moving(random: np.random.Generator, count: int) -> tuple[list[Slide], float]:
    """Fingers that come at different times, slide at 60 mm/s, never near each other, and go."""
    while True:
        slides = [_course(random) for _ in range(count)]
        times = np.linspace(0, 3.4, 69)
        ways = [
            np.column_stack([np.interp(times, *np.array(s.path).T[[0, k]]) for k in (1, 2)])
            for s in slides
        ]
        gaps = [
            np.linalg.norm(ways[i] - ways[j], axis=1).min() for i in range(count) for j in range(i)
        ]
        if min(gaps, default=APART) >= APART:
            return slides, 3.4


def _course(random: np.random.Generator) -> Slide:
    """From one place to another, over 0.5 to 1.5 s, then it stands."""
    start, end = random.uniform(0.2, 1.0), random.uniform(2.4, 3.2)
    while True:
        ends = random.uniform(-INSIDE, INSIDE, (2, 2))
        far = float(np.linalg.norm(ends[1] - ends[0]))
        if (np.linalg.norm(ends, axis=1) < INSIDE).all() and 0.03 < far < 0.09:
            break
    go = start + 0.3
    path = ((0.0, *ends[0]), (go, *ends[0]), (go + far / SPEED, *ends[1]))
    return Slide(_finger(random), start, end, path)


def quick(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Six taps of 0.2 s, 0.1 s after each other, each 60 mm from the last at least."""
    slides: list[Slide] = []
    place = np.array([np.inf, np.inf])
    for number in range(6):
        while True:
            fresh = random.uniform(-INSIDE, INSIDE, 2)
            if np.linalg.norm(fresh) < INSIDE and not np.linalg.norm(fresh - place) < 0.06:
                break
        place, start = fresh, 0.2 + 0.3 * number
        slides.append(Slide(_finger(random), start, start + 0.2, ((0.0, *place),)))
    return slides, 2.2


def past(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Two fingers from 90 mm apart past each other, as far on; with one speed."""
    middle, along, across = _line(random)
    stray, speed = random.uniform(0, STRAYS), random.uniform(0.04, 0.10)
    slides, going = [], 0.09 / speed
    for side in (1, -1):
        a, b = (middle + side * (s * 0.045 * along + stray / 2 * across) for s in (1, -1))
        path = ((0.0, *a), (0.8, *a), (0.8 + going, *b))
        slides.append(Slide(_finger(random), 0.2, 1.4 + going, path))
    return slides, 1.4 + going


def together(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Two fingers from 90 mm apart to each other, a rest of up to 0.6 s, and back."""
    middle, along, _ = _line(random)
    near, speed = random.uniform(0.004, STRAYS), random.uniform(0.04, 0.10)
    rest, going = random.uniform(0.1, 0.6), (0.045 - 0.5 * near) / speed
    slides, back = [], 0.8 + going + rest
    for side in (1, -1):
        a, b = middle + side * 0.045 * along, middle + side * near / 2 * along
        path = ((0.0, *a), (0.8, *a), (0.8 + going, *b), (back, *b), (back + going, *a))
        slides.append(Slide(_finger(random), 0.2, back + going + 0.6, path))
    return slides, back + going + 0.6


def _line(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle = random.uniform(0, 2 * np.pi)
    along = np.array([np.cos(angle), np.sin(angle)])
    return random.uniform(-0.02, 0.02, 2), along, np.array([-along[1], along[0]])


def _finger(random: np.random.Generator) -> Finger:
    return Finger(0.0, 0.0, random.uniform(*RADII), random.uniform(*FALLS))
